/* A foreign FMI 3.0 FMU, written by hand: a lag, an array, a copy of each type, and failures on
   demand. Value references: 0 time, 1 u, 2 y (y' = (u - y) / 0.5 s), 3 y_start, 4 fail_time, 5
   v_in[3], 6 v_out[3] (Float64); 10 f_in, 11 f_out (Float32); 20 + 2k, 21 + 2k (integers, k = 0..7:
   Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64); 40 e_in, 41 e_out (Enumeration); 50 b_in, 51
   b_out (Boolean); 60 s_in, 61 s_out (String). */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3FunctionTypes.h"

typedef struct {
    fmi3Float64 time, lag[4], vector[2][3];
    fmi3Float32 f[2];
    fmi3Int64 number[8][2], e[2];
    fmi3Boolean b[2];
    char s[2][64];
    fmi3LogMessageCallback log;
    fmi3InstanceEnvironment environment;
} Probe;

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[]) {
    return fmi3OK;
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    if (strcmp(token, "probe")) {
        log(environment, fmi3Error, "error", "wrong token");
        return NULL;
    }
    Probe *m = calloc(1, sizeof(Probe));
    m->log = log;
    m->environment = environment;
    m->lag[1] = m->lag[2] = 1;
    m->lag[3] = 1e9;
    return m;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 t,
                                       fmi3Float64 start, fmi3Boolean sd, fmi3Float64 stop) {
    ((Probe *)c)->time = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Probe *m = c;
    m->lag[1] = m->lag[2];
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { return fmi3OK; }

static fmi3Float64 *floats(Probe *m, fmi3ValueReference vr, size_t *n) {
    *n = vr >= 5 ? 3 : 1;
    if (vr > 6) return NULL;
    return vr == 0 ? &m->time : vr >= 5 ? m->vector[vr - 5] : &m->lag[vr - 1];
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                          fmi3Float64 v[], size_t nv) {
    size_t n, place = 0;
    for (size_t k = 0; k < nvr; k++, place += n) {
        fmi3Float64 *from = floats(c, vr[k], &n);
        if (!from || place + n > nv) return fmi3Error;
        memcpy(v + place, from, n * sizeof *v);
    }
    return place == nv ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                          const fmi3Float64 v[], size_t nv) {
    size_t n, place = 0;
    for (size_t k = 0; k < nvr; k++, place += n) {
        fmi3Float64 *to = floats(c, vr[k], &n);
        if (!to || place + n > nv) return fmi3Error;
        memcpy(to, v + place, n * sizeof *v);
    }
    return place == nv ? fmi3OK : fmi3Error;
}

#define SCALARS(TYPE, EXPRESSION) \
    fmi3Status fmi3Get##TYPE(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, \
                             fmi3##TYPE v[], size_t nv) { \
        Probe *m = c; \
        if (nvr != nv) return fmi3Error; \
        for (size_t k = 0; k < nv; k++) v[k] = (fmi3##TYPE)(EXPRESSION); \
        return fmi3OK; \
    } \
    fmi3Status fmi3Set##TYPE(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, \
                             const fmi3##TYPE v[], size_t nv) { \
        Probe *m = c; \
        if (nvr != nv) return fmi3Error; \
        for (size_t k = 0; k < nv; k++) EXPRESSION = v[k]; \
        return fmi3OK; \
    }
#define NUMBER m->number[(vr[k] - 20) / 2][vr[k] % 2]
SCALARS(Float32, m->f[vr[k] - 10])
SCALARS(Int8, NUMBER)
SCALARS(UInt8, NUMBER)
SCALARS(Int16, NUMBER)
SCALARS(UInt16, NUMBER)
SCALARS(UInt32, NUMBER)
SCALARS(UInt64, NUMBER)
SCALARS(Boolean, m->b[vr[k] - 50])
SCALARS(Int32, NUMBER)
SCALARS(Int64, *(vr[k] >= 40 ? &m->e[vr[k] - 40] : &NUMBER))

fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3String v[],
                         size_t nv) {
    for (size_t k = 0; k < nv; k++) v[k] = ((Probe *)c)->s[vr[k] - 60];
    return fmi3OK;
}
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                         const fmi3String v[], size_t nv) {
    for (size_t k = 0; k < nv; k++) snprintf(((Probe *)c)->s[vr[k] - 60], 64, "%s", v[k]);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *reached) {
    Probe *m = c;
    *event = *early = false;
    /* b_in = true: the end of the simulation instead of a failure */
    *terminate = t + h > m->lag[3] && m->b[0];
    *reached = t + h;
    if (t + h > m->lag[3] && !m->b[0]) {
        m->log(m->environment, fmi3Error, "error", "told to fail, 100%s sure");
        return fmi3Error;
    }
    m->lag[1] += h * (m->lag[0] - m->lag[1]) / 0.5;
    for (int i = 0; i < 3; i++) m->vector[1][i] = 2 * m->vector[0][i];
    for (int i = 0; i < 8; i++) m->number[i][1] = m->number[i][0] + 1;
    m->f[1] = m->f[0];
    m->e[1] = m->e[0];
    m->b[1] = !m->b[0];
    snprintf(m->s[1], 64, "<%.60s>", m->s[0]);
    m->time = t + h;
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *s) {
    if (!*s) *s = malloc(sizeof(Probe));
    memcpy(*s, c, sizeof(Probe));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState s) {
    memcpy(c, s, sizeof(Probe));
    return fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *s) {
    free(*s);
    *s = NULL;
    return fmi3OK;
}

/* every other entry point of the standard: there, but refusing */
#define REFUSED(NAME) fmi3Status fmi3##NAME(void) { return fmi3Error; }
#define NONE(NAME) fmi3Instance fmi3##NAME(void) { return NULL; }
NONE(InstantiateModelExchange)
NONE(InstantiateScheduledExecution) REFUSED(EnterEventMode) REFUSED(GetBinary) REFUSED(SetBinary)
    REFUSED(GetClock) REFUSED(SetClock) REFUSED(GetNumberOfVariableDependencies) REFUSED(
        GetVariableDependencies) REFUSED(SerializedFMUStateSize) REFUSED(SerializeFMUState)
        REFUSED(DeserializeFMUState) REFUSED(GetDirectionalDerivative) REFUSED(GetAdjointDerivative)
            REFUSED(EnterConfigurationMode) REFUSED(ExitConfigurationMode) REFUSED(
                GetIntervalDecimal) REFUSED(GetIntervalFraction) REFUSED(GetShiftDecimal)
                REFUSED(GetShiftFraction) REFUSED(SetIntervalDecimal) REFUSED(SetIntervalFraction)
                    REFUSED(SetShiftDecimal) REFUSED(SetShiftFraction)
                        REFUSED(EvaluateDiscreteStates) REFUSED(UpdateDiscreteStates)
                            REFUSED(EnterContinuousTimeMode) REFUSED(CompletedIntegratorStep)
                                REFUSED(SetTime) REFUSED(SetContinuousStates)
                                    REFUSED(GetContinuousStateDerivatives)
                                        REFUSED(GetEventIndicators) REFUSED(GetContinuousStates)
                                            REFUSED(GetNominalsOfContinuousStates)
                                                REFUSED(GetNumberOfEventIndicators)
                                                    REFUSED(GetNumberOfContinuousStates)
                                                        REFUSED(EnterStepMode)
                                                            REFUSED(GetOutputDerivatives)
                                                                REFUSED(ActivateModelPartition)
