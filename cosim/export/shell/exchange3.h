/* FMI 3.0 functions of Model Exchange. */
#include "exchange.h"

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging_on,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback logger)
{
    Instance *instance = create("fmi3InstantiateModelExchange", name, token, logger, environment);
    if (instance != NULL) instance->exchange = true;
    return instance;
}

fmi3Status fmi3EnterEventMode(fmi3Instance instance)
{
    return status(change_mode(instance, "fmi3EnterEventMode", CONTINUOUS, EVENT));
}

fmi3Status fmi3EnterContinuousTimeMode(fmi3Instance instance)
{
    return status(change_mode(instance, "fmi3EnterContinuousTimeMode", EVENT, CONTINUOUS));
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance instance, fmi3Boolean *again,
                                    fmi3Boolean *terminate_requested, fmi3Boolean *nominals_changed,
                                    fmi3Boolean *states_changed, fmi3Boolean *has_next_event,
                                    fmi3Float64 *next_event)
{
    *next_event = INFINITY;
    *again = *nominals_changed = *states_changed = false;
    const bool ok =
        update_discrete(instance, "fmi3UpdateDiscreteStates", states_changed, next_event);
    *terminate_requested = requests_termination(instance);
    *has_next_event = isfinite(*next_event);
    return status(ok);
}

fmi3Status fmi3CompletedIntegratorStep(fmi3Instance instance, fmi3Boolean no_rollback,
                                       fmi3Boolean *enter_event_mode,
                                       fmi3Boolean *terminate_requested)
{
    *enter_event_mode = *terminate_requested = false;
    return status(complete_step(instance, "fmi3CompletedIntegratorStep"));
}

fmi3Status fmi3SetTime(fmi3Instance instance, fmi3Float64 time)
{
    return status(set_time(instance, "fmi3SetTime", time));
}

fmi3Status fmi3SetContinuousStates(fmi3Instance instance, const fmi3Float64 states[], size_t count)
{
    return status(set_continuous_states(instance, "fmi3SetContinuousStates", states, count));
}

fmi3Status fmi3GetContinuousStates(fmi3Instance instance, fmi3Float64 states[], size_t count)
{
    return status(get_continuous(instance, "fmi3GetContinuousStates", false, states, count));
}

fmi3Status fmi3GetContinuousStateDerivatives(fmi3Instance instance, fmi3Float64 derivatives[],
                                             size_t count)
{
    return status(
        get_continuous(instance, "fmi3GetContinuousStateDerivatives", true, derivatives, count));
}

fmi3Status fmi3GetEventIndicators(fmi3Instance instance, fmi3Float64 indicators[], size_t count)
{
    return status(get_indicators(instance, "fmi3GetEventIndicators", indicators, count));
}

fmi3Status fmi3GetNominalsOfContinuousStates(fmi3Instance instance, fmi3Float64 nominals[],
                                             size_t count)
{
    for (size_t k = 0; k < count; k++) nominals[k] = 1;
    return status(has_size(instance, "fmi3GetNominalsOfContinuousStates", count, MODEL_STATES));
}

fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance instance, size_t *count)
{
    *count = MODEL_STATES;
    return fmi3OK;
}

fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance instance, size_t *count)
{
    *count = MODEL_INDICATORS;
    return fmi3OK;
}
