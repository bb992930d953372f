/* The misbehaving lag as FMI 2.0 FMU. Value references: Real 0 u, 1 y, 2 y_start, 3 T; String 0
   fault. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi2FunctionTypes.h"
#include "fault_actions.h"

const char PREFIX[] = "fmi2";
static const fmi2CallbackFunctions *voice;
static char voice_name[64];

void say(int status, const char *category, const char *text) {
    if (voice)
        voice->logger(voice->componentEnvironment, voice_name, (fmi2Status)status, category, text);
}

#define ENTER(NAME, ...) \
    Lag *m = c; \
    int status = enter(m, NAME, __VA_ARGS__); \
    if (status > WARNING) return (fmi2Status)status

const char *fmi2GetTypesPlatform(void) {
    return enter(NULL, "GetTypesPlatform", " ") ? NULL : fmi2TypesPlatform;
}
const char *fmi2GetVersion(void) { return enter(NULL, "GetVersion", " ") ? NULL : "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String names[]) {
    ENTER("SetDebugLogging", "%d", on);
    return (fmi2Status)status;
}
fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    voice = callbacks;
    snprintf(voice_name, sizeof voice_name, "%s", name);
    int status = enter(NULL, "Instantiate", "name=%s guid=%s visible=%d logging=%d", name, guid,
                       visible, logging);
    return status > WARNING ? NULL : new_lag(name);
}
void fmi2FreeInstance(fmi2Component c) {
    enter(c, "FreeInstance", " ");
    free(c);
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real begin,
                               fmi2Boolean sd, fmi2Real stop) {
    ENTER("SetupExperiment", "start=%.17g stop=%.17g", begin, sd ? stop : -1);
    m->time = begin;
    return (fmi2Status)status;
}
#define CALL(NAME, WORK) \
    fmi2Status fmi2##NAME(fmi2Component c) { \
        ENTER(#NAME, " "); \
        WORK; \
        return (fmi2Status)status; \
    }
CALL(EnterInitializationMode, )
CALL(ExitInitializationMode, lag_start(m))
CALL(Terminate, )
CALL(Reset, lag_start(m))
CALL(CancelStep, )

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[]) {
    for (size_t k = 0; k < n; k++) v[k] = ((Lag *)c)->x[vr[k] % REALS];
    char values[512];
    record_values(values, sizeof values, vr, n, v);
    ENTER("GetReal", "%s", values);
    for (size_t k = 0; k < n; k++) v[k] = m->x[vr[k] % REALS];
    return (fmi2Status)status;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                       const fmi2Real v[]) {
    char values[512];
    record_values(values, sizeof values, vr, n, v);
    ENTER("SetReal", "%s", values);
    for (size_t k = 0; k < n; k++) m->x[vr[k] % REALS] = v[k];
    return (fmi2Status)status;
}
fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String v[]) {
    ENTER("GetString", " ");
    for (size_t k = 0; k < n; k++) v[k] = m->speechless ? NULL : m->text;
    return (fmi2Status)status;
}
fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         const fmi2String v[]) {
    ENTER("SetString", "%s", v[0]);
    tell(m, v[0]);
    return (fmi2Status)status;
}
#define OTHER_TYPE(TYPE) \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             fmi2##TYPE v[]) { \
        return fmi2Error; \
    } \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             const fmi2##TYPE v[]) { \
        return fmi2Error; \
    }
OTHER_TYPE(Integer)
OTHER_TYPE(Boolean)

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    ((Lag *)c)->time = t;
    ENTER("DoStep", "t=%.17g h=%.17g", t, h);
    double y = m->x[Y];
    lag_step(m, t, h);
    if (y - y != 0) m->x[Y] = y; /* what is not finite stays so */
    return m->terminate ? fmi2Discard : (fmi2Status)status;
}
fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind k, fmi2Status *v) {
    return fmi2Discard;
}
fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind k, fmi2Real *v) {
    ENTER("GetRealStatus", "%d", k);
    *v = m->time;
    return (fmi2Status)status;
}
fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind k, fmi2Integer *v) {
    return fmi2Discard;
}
fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind k, fmi2Boolean *v) {
    ENTER("GetBooleanStatus", "%d", k);
    *v = m->terminate;
    return (fmi2Status)status;
}
fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind k, fmi2String *v) {
    return fmi2Discard;
}

/* every other entry point of the standard: there, but refusing */
#define REFUSED(NAME) fmi2Status fmi2##NAME(void) { return fmi2Error; }
REFUSED(GetFMUstate)
REFUSED(SetFMUstate) REFUSED(FreeFMUstate) REFUSED(SerializedFMUstateSize)
    REFUSED(SerializeFMUstate) REFUSED(DeSerializeFMUstate) REFUSED(GetDirectionalDerivative)
        REFUSED(SetRealInputDerivatives) REFUSED(GetRealOutputDerivatives)
