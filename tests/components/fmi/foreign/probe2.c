/* A foreign FMI 2.0 FMU, written by hand: a lag, a copy of each type, and failures on demand. Value
   references: 0 u, 1 y (y' = (u - y) / 0.5 s, one Euler step per doStep), 2 y_start, 3 fail_time
   (Real); 0 i_in, 1 i_out, 2 e_in, 3 e_out, 4 fail_status (Integer); 0 b_in, 1 b_out (Boolean); 0
   s_in, 1 s_out (String). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2FunctionTypes.h"

typedef struct {
    fmi2Real r[4];
    fmi2Integer i[5];
    fmi2Boolean b[2];
    char s[2][64];
    fmi2Real time;
    const fmi2CallbackFunctions *callbacks;
    char name[64];
} Probe;

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String names[]) {
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    if (*guid && strcmp(guid, "probe")) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "error", "wrong GUID");
        return NULL;
    }
    Probe *m = calloc(1, sizeof(Probe));
    m->callbacks = callbacks;
    m->r[1] = m->r[2] = 1;
    m->r[3] = 1e9;
    m->i[4] = fmi2Error;
    snprintf(m->name, sizeof m->name, "%s", name);
    return m;
}
void fmi2FreeInstance(fmi2Component c) {
    Probe *m = c;
    if (m->i[0] == 9) /* i_in = 9 means: say that free was called */
        m->callbacks->logger(m->callbacks->componentEnvironment, m->name, fmi2OK, "info", "freed");
    free(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start,
                               fmi2Boolean sd, fmi2Real stop) {
    ((Probe *)c)->time = start;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
    Probe *m = c;
    m->r[1] = m->r[2];
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return fmi2OK; }

#define ACCESS(TYPE, MEMBER, COUNT) \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             fmi2##TYPE v[]) { \
        for (size_t k = 0; k < n; k++) { \
            if (vr[k] >= COUNT) return fmi2Error; \
            v[k] = ((Probe *)c)->MEMBER[vr[k]]; \
        } \
        return fmi2OK; \
    } \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             const fmi2##TYPE v[]) { \
        for (size_t k = 0; k < n; k++) ((Probe *)c)->MEMBER[vr[k]] = v[k]; \
        return fmi2OK; \
    }
ACCESS(Real, r, 4)
ACCESS(Integer, i, 5)
ACCESS(Boolean, b, 2)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String v[]) {
    for (size_t k = 0; k < n; k++) v[k] = ((Probe *)c)->s[vr[k]];
    return fmi2OK;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         const fmi2String v[]) {
    for (size_t k = 0; k < n; k++) snprintf(((Probe *)c)->s[vr[k]], 64, "%s", v[k]);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Probe *m = c;
    if (t + h > m->r[3]) {
        m->callbacks->logger(m->callbacks->componentEnvironment, m->name, (fmi2Status)m->i[4],
                             "error", "told to fail, %d%s%s sure, %.1f s", 100, "%", "s", t);
        return (fmi2Status)m->i[4];
    }
    m->r[1] += h * (m->r[0] - m->r[1]) / 0.5;
    m->i[1] = m->i[0] + 1;
    m->i[3] = m->i[2];
    m->b[1] = !m->b[0];
    snprintf(m->s[1], 64, "<%.60s>", m->s[0]);
    m->time = t + h;
    return fmi2OK;
}
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *v) {
    return fmi2Discard;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real *v) {
    *v = ((Probe *)c)->time;
    return fmi2OK;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *v) {
    return fmi2Discard;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v) {
    /* i_in = 7 means: discard is meant as the end of the simulation */
    *v = ((Probe *)c)->i[0] == 7;
    return fmi2OK;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *v) {
    return fmi2Discard;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *s) {
    if (!*s) *s = malloc(sizeof(Probe));
    memcpy(*s, c, sizeof(Probe));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate s) {
    memcpy(c, s, sizeof(Probe));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *s) {
    free(*s);
    *s = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate s, size_t *n) {
    return fmi2Error;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate s, fmi2Byte b[], size_t n) {
    return fmi2Error;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte b[], size_t n, fmi2FMUstate *s) {
    return fmi2Error;
}
fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference u[], size_t nu,
                                        const fmi2ValueReference k[], size_t nk, const fmi2Real d[],
                                        fmi2Real o[]) {
    return fmi2Error;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
                                       const fmi2Integer o[], const fmi2Real x[]) {
    return fmi2Error;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference v[], size_t n,
                                        const fmi2Integer o[], fmi2Real x[]) {
    return fmi2Error;
}
