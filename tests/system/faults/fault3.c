/* The misbehaving lag as FMI 3.0 FMU. Value references: Float64 0 time, 1 u, 2 y, 3 y_start, 4 T;
   String 5 fault; Float64 6 v, an array of 3 elements: y, 2 y, 3 y. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3FunctionTypes.h"
#include "fault_actions.h"

enum { ARRAY = 6, LENGTH = 3 };
const char PREFIX[] = "fmi3";
static fmi3LogMessageCallback voice;
static fmi3InstanceEnvironment voice_environment;

void say(int status, const char *category, const char *text) {
    if (voice) voice(voice_environment, (fmi3Status)status, category, text);
}

#define ENTER(NAME, ...) \
    Lag *m = c; \
    int status = enter(m, NAME, __VA_ARGS__); \
    if (status > WARNING) return (fmi3Status)status

const char *fmi3GetVersion(void) { return enter(NULL, "GetVersion", " ") ? NULL : "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[]) {
    ENTER("SetDebugLogging", "%d", on);
    return (fmi3Status)status;
}
fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    voice = log;
    voice_environment = environment;
    int status = enter(NULL, "InstantiateCoSimulation", "name=%s token=%s events=%d early=%d", name,
                       token, events, early);
    return status > WARNING ? NULL : new_lag(name);
}
void fmi3FreeInstance(fmi3Instance c) {
    enter(c, "FreeInstance", " ");
    free(c);
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean td, fmi3Float64 t,
                                       fmi3Float64 begin, fmi3Boolean sd, fmi3Float64 stop) {
    ENTER("EnterInitializationMode", "start=%.17g stop=%.17g", begin, sd ? stop : -1);
    m->time = begin;
    return (fmi3Status)status;
}
#define CALL(NAME, WORK) \
    fmi3Status fmi3##NAME(fmi3Instance c) { \
        ENTER(#NAME, " "); \
        WORK; \
        return (fmi3Status)status; \
    }
CALL(ExitInitializationMode, lag_start(m))
CALL(EnterStepMode, )
CALL(Terminate, )
CALL(Reset, lag_start(m))

static double value(Lag *m, fmi3ValueReference vr) { return vr ? m->x[(vr - 1) % REALS] : m->time; }
/* 1 when there is no room for exactly these variables */
static int get(Lag *m, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[], size_t nv) {
    size_t needed = 0, place = 0;
    for (size_t k = 0; k < n; k++) needed += vr[k] == ARRAY ? LENGTH : 1;
    if (nv != needed) {
        say(ERROR, "error", "the number of values is not that of these variables");
        return 1;
    }
    for (size_t k = 0; k < n; k++)
        if (vr[k] == ARRAY)
            for (int i = 1; i <= LENGTH; i++) v[place++] = m->spoiled && i == 2 ? NAN : i * m->x[Y];
        else
            v[place++] = value(m, vr[k]);
    return 0;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 v[],
                          size_t nv) {
    if (get(c, vr, n, v, nv)) return fmi3Error;
    char values[512];
    record_values(values, sizeof values, vr, n, v);
    ENTER("GetFloat64", "%s", values);
    get(m, vr, n, v, nv);
    return (fmi3Status)status;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                          const fmi3Float64 v[], size_t nv) {
    char values[512];
    record_values(values, sizeof values, vr, n, v);
    ENTER("SetFloat64", "%s", values);
    for (size_t k = 0; k < n; k++) m->x[(vr[k] - 1) % REALS] = v[k];
    return (fmi3Status)status;
}
fmi3Status fmi3GetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3String v[],
                         size_t nv) {
    ENTER("GetString", " ");
    for (size_t k = 0; k < n; k++) v[k] = m->speechless ? NULL : m->text;
    return (fmi3Status)status;
}
fmi3Status fmi3SetString(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                         const fmi3String v[], size_t nv) {
    ENTER("SetString", "%s", v[0]);
    tell(m, v[0]);
    return (fmi3Status)status;
}
fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[],
                         fmi3Binary v[], size_t nv) {
    ENTER("GetBinary", " ");
    for (size_t k = 0; k < nv; k++) {
        v[k] = (fmi3Binary)m->text;
        sizes[k] = m->vast ? (size_t)-1 : strlen(m->text);
    }
    return (fmi3Status)status;
}
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean no_set_state,
                      fmi3Boolean *event, fmi3Boolean *terminate, fmi3Boolean *early,
                      fmi3Float64 *reached) {
    ((Lag *)c)->time = t;
    ENTER("DoStep", "t=%.17g h=%.17g", t, h);
    double y = m->x[Y];
    lag_step(m, t, m->early ? m->part * h : h);
    if (y - y != 0) m->x[Y] = y; /* what is not finite stays so */
    *event = m->event;
    *terminate = m->terminate;
    *early = m->early;
    *reached = m->reached;
    return (fmi3Status)status;
}

/* every other entry point of the standard: there, but refusing */
#define REFUSED(NAME) fmi3Status fmi3##NAME(void) { return fmi3Error; }
#define NONE(NAME) fmi3Instance fmi3##NAME(void) { return NULL; }
#define OTHER_TYPE(TYPE) REFUSED(Get##TYPE) REFUSED(Set##TYPE)
NONE(InstantiateModelExchange)
NONE(InstantiateScheduledExecution) OTHER_TYPE(Float32) OTHER_TYPE(Int8) OTHER_TYPE(UInt8)
    OTHER_TYPE(Int16) OTHER_TYPE(UInt16) OTHER_TYPE(Int32) OTHER_TYPE(UInt32) OTHER_TYPE(Int64)
        OTHER_TYPE(UInt64) OTHER_TYPE(Boolean) OTHER_TYPE(Clock) REFUSED(SetBinary) REFUSED(
            EnterEventMode) REFUSED(GetFMUState) REFUSED(SetFMUState) REFUSED(FreeFMUState)
            REFUSED(GetNumberOfVariableDependencies) REFUSED(GetVariableDependencies) REFUSED(
                SerializedFMUStateSize) REFUSED(SerializeFMUState) REFUSED(DeserializeFMUState)
                REFUSED(GetDirectionalDerivative) REFUSED(GetAdjointDerivative)
                    REFUSED(EnterConfigurationMode) REFUSED(ExitConfigurationMode) REFUSED(
                        GetIntervalDecimal) REFUSED(GetIntervalFraction) REFUSED(GetShiftDecimal)
                        REFUSED(GetShiftFraction) REFUSED(SetIntervalDecimal) REFUSED(
                            SetIntervalFraction) REFUSED(SetShiftDecimal) REFUSED(SetShiftFraction)
                            REFUSED(EvaluateDiscreteStates) REFUSED(UpdateDiscreteStates)
                                REFUSED(EnterContinuousTimeMode) REFUSED(CompletedIntegratorStep)
                                    REFUSED(SetTime) REFUSED(SetContinuousStates)
                                        REFUSED(GetContinuousStateDerivatives)
                                            REFUSED(GetEventIndicators) REFUSED(GetContinuousStates)
                                                REFUSED(GetNominalsOfContinuousStates)
                                                    REFUSED(GetNumberOfEventIndicators)
                                                        REFUSED(GetNumberOfContinuousStates)
                                                            REFUSED(GetOutputDerivatives)
                                                                REFUSED(ActivateModelPartition)
