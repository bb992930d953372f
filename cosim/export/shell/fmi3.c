/* FMI 3.0 interface of a model: Co-Simulation, and Model Exchange if the model offers it. */
#include "fmi3Functions.h"

typedef fmi3LogMessageCallback Logger;
#define ARRAYS 1
#include "common.h"

static void report(const Instance *instance, bool error, const char *message)
{
    if (instance->logger)
        instance->logger(instance->environment, error ? fmi3Error : fmi3Warning,
                         error ? "logStatusError" : "logStatusWarning", message);
}

static fmi3Status status(bool ok)
{
    return ok ? fmi3OK : fmi3Error;
}

/* ---- inquiry and life cycle ------------------------------------------------------------------ */

const char *fmi3GetVersion(void)
{
    return fmi3Version;
}

/* Errors are always logged; there are no other messages. */
fmi3Status fmi3SetDebugLogging(fmi3Instance instance, fmi3Boolean on, size_t count,
                               const fmi3String categories[])
{
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging_on,
                                         fmi3Boolean event_mode, fmi3Boolean early_return,
                                         const fmi3ValueReference intermediate[],
                                         size_t intermediate_count,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback logger,
                                         fmi3IntermediateUpdateCallback intermediate_update)
{
    if (event_mode || intermediate_count > 0) {
        Instance nobody = {.logger = logger, .environment = environment};
        return refuse(&nobody, "fmi3InstantiateCoSimulation",
                      "neither event mode nor intermediate update is offered"),
               NULL;
    }
    return create("fmi3InstantiateCoSimulation", name, token, logger, environment);
}

void fmi3FreeInstance(fmi3Instance instance)
{
    destroy(instance);
}

fmi3Status fmi3EnterInitializationMode(fmi3Instance instance, fmi3Boolean has_tolerance,
                                       fmi3Float64 tolerance, fmi3Float64 start,
                                       fmi3Boolean has_stop, fmi3Float64 stop)
{
    const char *function = "fmi3EnterInitializationMode";
    return status(set_times(instance, function, start, has_stop, stop) &&
                  enter_initialization(instance, function));
}

fmi3Status fmi3ExitInitializationMode(fmi3Instance instance)
{
    return status(exit_initialization(instance, "fmi3ExitInitializationMode"));
}

fmi3Status fmi3Terminate(fmi3Instance instance)
{
    return status(terminate(instance, "fmi3Terminate"));
}

fmi3Status fmi3Reset(fmi3Instance instance)
{
    reset(instance);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance instance, fmi3Float64 time, fmi3Float64 step_size,
                      fmi3Boolean no_rollback, fmi3Boolean *event_needed,
                      fmi3Boolean *terminate_requested, fmi3Boolean *early_return,
                      fmi3Float64 *time_reached)
{
    const bool ok = step(instance, "fmi3DoStep", time, step_size);
    *event_needed = *early_return = false;
    *terminate_requested = requests_termination(instance);
    *time_reached = ((Instance *)instance)->state.time;
    return status(ok);
}

/* ---- access to variables --------------------------------------------------------------------- */

#define GET(Type) \
    fmi3Status fmi3Get##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, \
                             fmi3##Type values[], size_t value_count)
#define SET(Type) \
    fmi3Status fmi3Set##Type(fmi3Instance instance, const fmi3ValueReference vr[], size_t n, \
                             const fmi3##Type values[], size_t value_count)

#define ACCESSORS(Type, TYPE, Inside) \
    DEFINE_ACCESS(Type, TYPE, fmi3##Type, Inside) \
    GET(Type) { \
        return status(read_##Type(instance, "fmi3Get" #Type, vr, n, values, value_count)); \
    } \
    SET(Type) { \
        return status(write_##Type(instance, "fmi3Set" #Type, vr, n, values, value_count)); \
    }

#define NO_VARIABLES(Type) \
    GET(Type) { \
        return status(n == 0 || \
                      refuse(instance, "fmi3Get" #Type, "there are no variables of this type")); \
    } \
    SET(Type) { \
        return status(n == 0 || \
                      refuse(instance, "fmi3Set" #Type, "there are no variables of this type")); \
    }

ACCESSORS(Float64, FLOAT64, double)
ACCESSORS(Int32, INT32, int32_t)
ACCESSORS(Boolean, BOOLEAN, bool)
ACCESSORS(Int64, ENUMERATION, int32_t)

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(UInt32)
NO_VARIABLES(UInt64)
NO_VARIABLES(String)

/* ---- the FMU state --------------------------------------------------------------------------- */

fmi3Status fmi3GetFMUState(fmi3Instance instance, fmi3FMUState *saved)
{
    return status(get_state(instance, "fmi3GetFMUState", saved));
}

fmi3Status fmi3SetFMUState(fmi3Instance instance, fmi3FMUState saved)
{
    return status(set_state(instance, "fmi3SetFMUState", saved));
}

fmi3Status fmi3FreeFMUState(fmi3Instance instance, fmi3FMUState *saved)
{
    free_state(saved);
    return fmi3OK;
}

fmi3Status fmi3SerializedFMUStateSize(fmi3Instance instance, fmi3FMUState saved, size_t *size)
{
    *size = SERIALIZED_SIZE;
    return fmi3OK;
}

fmi3Status fmi3SerializeFMUState(fmi3Instance instance, fmi3FMUState saved, fmi3Byte bytes[],
                                 size_t size)
{
    return status(serialize(instance, "fmi3SerializeFMUState", saved, bytes, size));
}

fmi3Status fmi3DeserializeFMUState(fmi3Instance instance, const fmi3Byte bytes[], size_t size,
                                   fmi3FMUState *saved)
{
    return status(deserialize(instance, "fmi3DeserializeFMUState", bytes, size, saved));
}

/* ---- not offered: importers require all functions of the standard ---------------------------- */

#define NOT_OFFERED(function, ...) \
    fmi3Status function(__VA_ARGS__) { return status(refuse(instance, #function, "not offered")); }

fmi3Instance fmi3InstantiateScheduledExecution(
    fmi3String name, fmi3String token, fmi3String resources, fmi3Boolean visible,
    fmi3Boolean logging_on, fmi3InstanceEnvironment environment, fmi3LogMessageCallback logger,
    fmi3ClockUpdateCallback clock_update, fmi3LockPreemptionCallback lock,
    fmi3UnlockPreemptionCallback unlock)
{
    Instance nobody = {.logger = logger, .environment = environment};
    return refuse(&nobody, "fmi3InstantiateScheduledExecution", "only Co-Simulation is offered"),
           NULL;
}

NOT_OFFERED(fmi3GetBinary, fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
            size_t sizes[], fmi3Binary values[], size_t value_count)
NOT_OFFERED(fmi3SetBinary, fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
            const size_t sizes[], const fmi3Binary values[], size_t value_count)
NOT_OFFERED(fmi3GetClock, fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
            fmi3Clock values[])
NOT_OFFERED(fmi3SetClock, fmi3Instance instance, const fmi3ValueReference vr[], size_t n,
            const fmi3Clock values[])

NOT_OFFERED(fmi3EnterConfigurationMode, fmi3Instance instance)
NOT_OFFERED(fmi3ExitConfigurationMode, fmi3Instance instance)
NOT_OFFERED(fmi3EnterStepMode, fmi3Instance instance)
NOT_OFFERED(fmi3EvaluateDiscreteStates, fmi3Instance instance)

NOT_OFFERED(fmi3GetNumberOfVariableDependencies, fmi3Instance instance,
            fmi3ValueReference dependent, size_t *count)
NOT_OFFERED(fmi3GetVariableDependencies, fmi3Instance instance, fmi3ValueReference dependent,
            size_t dependent_elements[], fmi3ValueReference independents[],
            size_t independent_elements[], fmi3DependencyKind kinds[], size_t count)

#define NO_DERIVATIVE(function) \
    NOT_OFFERED(function, fmi3Instance instance, const fmi3ValueReference unknowns[], \
                size_t unknown_count, const fmi3ValueReference knowns[], size_t known_count, \
                const fmi3Float64 seed[], size_t seed_count, fmi3Float64 sensitivity[], \
                size_t sensitivity_count)
NO_DERIVATIVE(fmi3GetDirectionalDerivative)
NO_DERIVATIVE(fmi3GetAdjointDerivative)
NOT_OFFERED(fmi3GetOutputDerivatives, fmi3Instance instance, const fmi3ValueReference vr[],
            size_t n, const fmi3Int32 orders[], fmi3Float64 values[], size_t value_count)

#define NO_CLOCK(function, ...) \
    NOT_OFFERED(function, fmi3Instance instance, const fmi3ValueReference vr[], size_t n, \
                __VA_ARGS__)
NO_CLOCK(fmi3GetIntervalDecimal, fmi3Float64 intervals[], fmi3IntervalQualifier qualifiers[])
NO_CLOCK(fmi3GetIntervalFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[],
         fmi3IntervalQualifier qualifiers[])
NO_CLOCK(fmi3GetShiftDecimal, fmi3Float64 shifts[])
NO_CLOCK(fmi3GetShiftFraction, fmi3UInt64 counters[], fmi3UInt64 resolutions[])
NO_CLOCK(fmi3SetIntervalDecimal, const fmi3Float64 intervals[])
NO_CLOCK(fmi3SetIntervalFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NO_CLOCK(fmi3SetShiftDecimal, const fmi3Float64 shifts[])
NO_CLOCK(fmi3SetShiftFraction, const fmi3UInt64 counters[], const fmi3UInt64 resolutions[])
NOT_OFFERED(fmi3ActivateModelPartition, fmi3Instance instance, fmi3ValueReference clock,
            fmi3Float64 time)

/* ---- Model Exchange -------------------------------------------------------------------------- */

#ifdef MODEL_EXCHANGE
#include "exchange3.h"
#else

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging_on,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    Instance nobody = {.logger = logger, .environment = environment};
    return refuse(&nobody, "fmi3InstantiateModelExchange", "only Co-Simulation is offered"), NULL;
}

NOT_OFFERED(fmi3EnterEventMode, fmi3Instance instance)
NOT_OFFERED(fmi3EnterContinuousTimeMode, fmi3Instance instance)
NOT_OFFERED(fmi3UpdateDiscreteStates, fmi3Instance instance, fmi3Boolean *again,
            fmi3Boolean *terminate_requested, fmi3Boolean *nominals_changed,
            fmi3Boolean *states_changed, fmi3Boolean *has_next_event, fmi3Float64 *next_event)
NOT_OFFERED(fmi3SetTime, fmi3Instance instance, fmi3Float64 time)
NOT_OFFERED(fmi3SetContinuousStates, fmi3Instance instance, const fmi3Float64 states[],
            size_t count)
NOT_OFFERED(fmi3GetContinuousStates, fmi3Instance instance, fmi3Float64 states[], size_t count)
NOT_OFFERED(fmi3GetContinuousStateDerivatives, fmi3Instance instance, fmi3Float64 derivatives[],
            size_t count)
NOT_OFFERED(fmi3GetNominalsOfContinuousStates, fmi3Instance instance, fmi3Float64 nominals[],
            size_t count)
NOT_OFFERED(fmi3GetEventIndicators, fmi3Instance instance, fmi3Float64 indicators[], size_t count)
NOT_OFFERED(fmi3GetNumberOfContinuousStates, fmi3Instance instance, size_t *count)
NOT_OFFERED(fmi3GetNumberOfEventIndicators, fmi3Instance instance, size_t *count)
NOT_OFFERED(fmi3CompletedIntegratorStep, fmi3Instance instance, fmi3Boolean no_rollback,
            fmi3Boolean *enter_event_mode, fmi3Boolean *terminate_requested)

#endif
