/* Model Exchange: functions that the FMI 2.0 and 3.0 shells share. */
#ifndef EXCHANGE_H
#define EXCHANGE_H

/* Arrays have at least one element in C. */
enum { ADDRESSES = MODEL_STATES > 0 ? MODEL_STATES : 1 };

static bool change_mode(Instance *instance, const char *function, Phase from, Phase to)
{
    if (!expect(instance, function, from)) return false;
    instance->state.phase = to;
    return true;
}

static bool set_time(Instance *instance, const char *function, double time)
{
    if (!expect(instance, function, EVENT | CONTINUOUS)) return false;
    if (!isfinite(time)) return refuse(instance, function, "the time %g is not finite", time);
    instance->state.time = time;
    instance->state.stale = true;
    return true;
}

static bool has_size(Instance *instance, const char *function, size_t found, size_t expected)
{
    return found == expected ||
           refuse(instance, function, "found %zu values, expected %zu", found, expected);
}

static bool set_continuous_states(Instance *instance, const char *function, const double *values,
                                  size_t count)
{
    double *states[ADDRESSES], *rates[ADDRESSES];
    if (!expect(instance, function, CONTINUOUS) ||
        !has_size(instance, function, count, MODEL_STATES))
        return false;
    model_states(&instance->state.model, states, rates);
    for (size_t k = 0; k < MODEL_STATES; k++) *states[k] = values[k];
    instance->state.stale = true;
    return true;
}

/* Copies the states or their derivatives. */
static bool get_continuous(Instance *instance, const char *function, bool derivatives,
                           double *values, size_t count)
{
    double *states[ADDRESSES], *rates[ADDRESSES];
    if (!expect(instance, function, INITIALIZING | EVENT | CONTINUOUS | TERMINATED) ||
        !refresh(instance, function))
        return false;
    if (!has_size(instance, function, count, MODEL_STATES)) return false;
    model_states(&instance->state.model, states, rates);
    for (size_t k = 0; k < MODEL_STATES; k++) values[k] = derivatives ? *rates[k] : *states[k];
    return true;
}

static bool get_indicators(Instance *instance, const char *function, double *values, size_t count)
{
    if (!expect(instance, function, INITIALIZING | EVENT | CONTINUOUS | TERMINATED) ||
        !refresh(instance, function))
        return false;
    if (!has_size(instance, function, count, MODEL_INDICATORS)) return false;
#if MODEL_INDICATORS > 0
    memcpy(values, instance->state.model.indicator, sizeof instance->state.model.indicator);
#endif
    return true;
}

/* Executes an event with its iteration. `changed`: the event has set states; `next`: time of the
   next tick, or infinite. */
static bool update_discrete(Instance *instance, const char *function, bool *changed, double *next)
{
    double *states[ADDRESSES], *rates[ADDRESSES], before[ADDRESSES];
    State *state = &instance->state;
    if (!expect(instance, function, EVENT)) return false;
    model_states(&state->model, states, rates);
    for (size_t k = 0; k < MODEL_STATES; k++) before[k] = *states[k];
    if (!succeeded(instance, function, model_update(&state->model, state->time, next)))
        return false;
    report_warnings(instance);
    *changed = false;
    for (size_t k = 0; k < MODEL_STATES; k++) *changed = *changed || *states[k] != before[k];
    state->stale = true; /* for the indicators, which depend on the new values of the relations */
    return true;
}

static bool complete_step(Instance *instance, const char *function)
{
    if (!expect(instance, function, CONTINUOUS) || !refresh(instance, function)) return false;
    model_accept(&instance->state.model, instance->state.time);
    return true;
}

#endif
