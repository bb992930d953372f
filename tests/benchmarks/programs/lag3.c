/* The lag as an FMI 3.0 Co-Simulation FMU. */
#include "fmi3FunctionTypes.h"
#include "lag.h"

#pragma GCC visibility push(default)

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean on, size_t n, const fmi3String names[])
{
    return fmi3OK;
}

/* ---- life cycle ------------------------------------------------------------------------------ */

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update)
{
    return create();
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start_time,
                                       fmi3Boolean has_stop, fmi3Float64 stop_time)
{
    ((Lag *)c)->values[TIME] = start_time;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 step_size,
                      fmi3Boolean no_rollback, fmi3Boolean *event, fmi3Boolean *terminate,
                      fmi3Boolean *early, fmi3Float64 *reached)
{
    step(c, time, step_size);
    *event = *terminate = *early = fmi3False;
    *reached = time + step_size;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c)
{
    start(c);
    return fmi3OK;
}

/* ---- values and states ----------------------------------------------------------------------- */

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                          fmi3Float64 values[], size_t size)
{
    for (size_t i = 0; i < n; i++) values[i] = ((Lag *)c)->values[references[i]];
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference references[], size_t n,
                          const fmi3Float64 values[], size_t size)
{
    for (size_t i = 0; i < n; i++) ((Lag *)c)->values[references[i]] = values[i];
    return fmi3OK;
}
fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state)
{
    return (*state = copy(*state, c)) ? fmi3OK : fmi3Error;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state)
{
    return copy(c, state) ? fmi3OK : fmi3Error;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state)
{
    free(*state);
    *state = NULL;
    return fmi3OK;
}
fmi3Status fmi3SerializedFMUStateSize(fmi3Instance c, fmi3FMUState state, size_t *size)
{
    *size = sizeof(Lag);
    return fmi3OK;
}
fmi3Status fmi3SerializeFMUState(fmi3Instance c, fmi3FMUState state, fmi3Byte bytes[], size_t size)
{
    return size >= sizeof(Lag) && copy(bytes, state) ? fmi3OK : fmi3Error;
}
fmi3Status fmi3DeserializeFMUState(fmi3Instance c, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *state)
{
    return size >= sizeof(Lag) && (*state = copy(*state, bytes)) ? fmi3OK : fmi3Error;
}

/* ---- unsupported functions: importers look them up, but do not call them --------------------- */

#define UNSUPPORTED(NAME) \
    fmi3Status fmi3##NAME(void) { return fmi3Error; }
#define NO_INSTANCE(NAME) \
    fmi3Instance fmi3##NAME(void) { return NULL; }
#define NO_VARIABLES(TYPE) UNSUPPORTED(Get##TYPE) UNSUPPORTED(Set##TYPE)
/* clang-format off */
NO_INSTANCE(InstantiateModelExchange) NO_INSTANCE(InstantiateScheduledExecution)
NO_VARIABLES(Float32) NO_VARIABLES(Int8) NO_VARIABLES(UInt8) NO_VARIABLES(Int16)
NO_VARIABLES(UInt16) NO_VARIABLES(Int32) NO_VARIABLES(UInt32) NO_VARIABLES(Int64)
NO_VARIABLES(UInt64) NO_VARIABLES(Boolean) NO_VARIABLES(String) NO_VARIABLES(Binary)
NO_VARIABLES(Clock) UNSUPPORTED(GetNumberOfVariableDependencies)
UNSUPPORTED(GetVariableDependencies) UNSUPPORTED(GetDirectionalDerivative)
UNSUPPORTED(GetAdjointDerivative) UNSUPPORTED(GetOutputDerivatives)
UNSUPPORTED(EnterConfigurationMode) UNSUPPORTED(ExitConfigurationMode)
UNSUPPORTED(GetIntervalDecimal) UNSUPPORTED(GetIntervalFraction) UNSUPPORTED(SetIntervalDecimal)
UNSUPPORTED(SetIntervalFraction) UNSUPPORTED(GetShiftDecimal) UNSUPPORTED(GetShiftFraction)
UNSUPPORTED(SetShiftDecimal) UNSUPPORTED(SetShiftFraction) UNSUPPORTED(EnterEventMode)
UNSUPPORTED(EvaluateDiscreteStates) UNSUPPORTED(UpdateDiscreteStates)
UNSUPPORTED(EnterContinuousTimeMode) UNSUPPORTED(CompletedIntegratorStep) UNSUPPORTED(SetTime)
UNSUPPORTED(SetContinuousStates) UNSUPPORTED(GetContinuousStates)
UNSUPPORTED(GetContinuousStateDerivatives) UNSUPPORTED(GetNominalsOfContinuousStates)
UNSUPPORTED(GetNumberOfContinuousStates) UNSUPPORTED(GetEventIndicators)
UNSUPPORTED(GetNumberOfEventIndicators) UNSUPPORTED(EnterStepMode)
UNSUPPORTED(ActivateModelPartition)
