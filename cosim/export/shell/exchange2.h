/* FMI 2.0 functions of Model Exchange. */
#include "exchange.h"

fmi2Status fmi2EnterEventMode(fmi2Component c)
{
    return status(change_mode(c, "fmi2EnterEventMode", CONTINUOUS, EVENT));
}

fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c)
{
    return status(change_mode(c, "fmi2EnterContinuousTimeMode", EVENT, CONTINUOUS));
}

fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info)
{
    bool changed = false;
    double next = INFINITY;
    const bool ok = update_discrete(c, "fmi2NewDiscreteStates", &changed, &next);
    *info = (fmi2EventInfo){
        .terminateSimulation = requests_termination(c),
        .valuesOfContinuousStatesChanged = changed,
        .nextEventTimeDefined = isfinite(next),
        .nextEventTime = isfinite(next) ? next : 0,
    };
    return status(ok);
}

fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_rollback,
                                       fmi2Boolean *enter_event_mode,
                                       fmi2Boolean *terminate_requested)
{
    *enter_event_mode = *terminate_requested = fmi2False;
    return status(complete_step(c, "fmi2CompletedIntegratorStep"));
}

fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time)
{
    return status(set_time(c, "fmi2SetTime", time));
}

fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real states[], size_t count)
{
    return status(set_continuous_states(c, "fmi2SetContinuousStates", states, count));
}

fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real states[], size_t count)
{
    return status(get_continuous(c, "fmi2GetContinuousStates", false, states, count));
}

fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real derivatives[], size_t count)
{
    return status(get_continuous(c, "fmi2GetDerivatives", true, derivatives, count));
}

fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t count)
{
    return status(get_indicators(c, "fmi2GetEventIndicators", indicators, count));
}

fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominals[], size_t count)
{
    for (size_t k = 0; k < count; k++) nominals[k] = 1;
    return status(has_size(c, "fmi2GetNominalsOfContinuousStates", count, MODEL_STATES));
}
