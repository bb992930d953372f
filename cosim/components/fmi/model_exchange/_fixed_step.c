/* Explicit integration of a Model Exchange FMU at fixed step size, as a function with the signature
   of fmi2DoStep.

   The function returns OK at the end of the communication step, and DISCARD after a substep with an
   event or a failed call; the members `event`, `status` and `failed_function` of the state give the
   reason. Called again with the same arguments, it continues with the next substep.
   `advance_in_python` in fixed_step.py makes the same operations in the same order. */
#define Py_LIMITED_API 0x030b0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

enum { OK = 0, WARNING = 1, DISCARD = 2, NOT_A_NUMBER = -1 };
enum { STATE_EVENT = 1, TIME_EVENT = 2, STEP_EVENT = 4, TERMINATION = 8 };
enum { SET_TIME, SET_STATES, GET_DERIVATIVES, GET_INDICATORS, COMPLETE_STEP, SET_INPUTS };

/* relative to the substep: a time event so close after its end is reached */
#define TIME_TOLERANCE 1e-9

/* The same members as `FixedStepState` in fixed_step.py. */
typedef struct {
    void *instance;
    int (*set_time)(void *, double);
    int (*set_states)(void *, const double *, size_t);
    int (*get_derivatives)(void *, double *, size_t);
    int (*get_indicators)(void *, double *, size_t);
    void *complete_step; /* NULL if the FMU does not need it */
    void *set_inputs;
    int64_t version, stages, state_count, indicator_count;
    int64_t reference_count, input_count; /* of the linear inputs */
    double *states, *derivatives, *start_states, *sum, *indicators, *previous_indicators;
    const uint32_t *input_references;
    const double *input_array;
    const int64_t *input_indices;
    const double *input_slopes;
    double *input_values;
    double next_event_time, substep_size, time, begin;
    int64_t substeps, next_substep, event, status, failed_function;
} State;

#define CALL(ROLE, EXPRESSION) \
    do { \
        int status_ = (EXPRESSION); \
        if (status_ != OK && status_ != WARNING) { \
            s->status = status_; \
            s->failed_function = ROLE; \
            return DISCARD; \
        } \
    } while (0)

/* Set the linear inputs to their values at `time`. */
static int set_inputs(State *s, double time) {
    size_t references = (size_t)s->reference_count, count = (size_t)s->input_count;
    for (size_t i = 0; i < count; i++)
        s->input_values[i] =
            s->input_array[s->input_indices[i]] + s->input_slopes[i] * (time - s->begin);
    if (s->version == 3)
        CALL(SET_INPUTS,
             ((int (*)(void *, const uint32_t *, size_t, const double *, size_t))s->set_inputs)(
                 s->instance, s->input_references, references, s->input_values, count));
    else
        CALL(SET_INPUTS, ((int (*)(void *, const uint32_t *, size_t, const double *))s->set_inputs)(
                             s->instance, s->input_references, references, s->input_values));
    return OK;
}

static inline int set_time(State *s, double time) {
    CALL(SET_TIME, s->set_time(s->instance, time));
    return s->reference_count ? set_inputs(s, time) : OK;
}

static inline int set_states(State *s) {
    if (s->state_count)
        CALL(SET_STATES, s->set_states(s->instance, s->states, (size_t)s->state_count));
    return OK;
}

static inline int get_derivatives(State *s) {
    if (s->state_count)
        CALL(GET_DERIVATIVES,
             s->get_derivatives(s->instance, s->derivatives, (size_t)s->state_count));
    return OK;
}

static inline int euler_step(State *s, double end) {
    if (get_derivatives(s)) return DISCARD;
    if (set_time(s, end)) return DISCARD;
    for (int64_t i = 0; i < s->state_count; i++)
        s->states[i] += s->substep_size * s->derivatives[i];
    return set_states(s);
}

/* states = start + weight * derivatives, at `time` */
static int evaluate_stage(State *s, double time, double weight) {
    if (set_time(s, time)) return DISCARD;
    for (int64_t i = 0; i < s->state_count; i++)
        s->states[i] = s->start_states[i] + weight * s->derivatives[i];
    if (set_states(s)) return DISCARD;
    return get_derivatives(s);
}

static void add_to_sum(State *s, double weight) {
    for (int64_t i = 0; i < s->state_count; i++) s->sum[i] += weight * s->derivatives[i];
}

static int runge_kutta_step(State *s, double begin, double end) {
    double half = 0.5 * s->substep_size;
    if (get_derivatives(s)) return DISCARD;
    memcpy(s->start_states, s->states, (size_t)s->state_count * sizeof(double));
    memcpy(s->sum, s->derivatives, (size_t)s->state_count * sizeof(double));
    if (evaluate_stage(s, begin + half, half)) return DISCARD;
    add_to_sum(s, 2.0);
    if (evaluate_stage(s, begin + half, half)) return DISCARD;
    add_to_sum(s, 2.0);
    if (evaluate_stage(s, end, s->substep_size)) return DISCARD;
    add_to_sum(s, 1.0);
    double sixth = s->substep_size / 6.0;
    for (int64_t i = 0; i < s->state_count; i++)
        s->states[i] = s->start_states[i] + sixth * s->sum[i];
    return set_states(s);
}

static int find_state_event(State *s) {
    size_t count = (size_t)s->indicator_count;
    CALL(GET_INDICATORS, s->get_indicators(s->instance, s->indicators, count));
    for (size_t i = 0; i < count; i++)
        CALL(GET_INDICATORS, s->indicators[i] == s->indicators[i] ? OK : NOT_A_NUMBER);
    for (size_t i = 0; i < count; i++)
        if ((s->previous_indicators[i] <= 0) != (s->indicators[i] <= 0)) s->event |= STATE_EVENT;
    memcpy(s->previous_indicators, s->indicators, count * sizeof(double));
    return OK;
}

static inline int complete_step(State *s) {
    bool event, terminate = false;
    if (s->version == 2) {
        int event_needed = 0, ends = 0;
        CALL(COMPLETE_STEP, ((int (*)(void *, int, int *, int *))s->complete_step)(
                                s->instance, 1, &event_needed, &ends));
        event = event_needed != 0, terminate = ends != 0;
    } else if (s->version == 3) {
        bool event_needed = false, ends = false;
        CALL(COMPLETE_STEP, ((int (*)(void *, bool, bool *, bool *))s->complete_step)(
                                s->instance, true, &event_needed, &ends));
        event = event_needed, terminate = ends;
    } else {
        char event_needed = 0;
        CALL(COMPLETE_STEP,
             ((int (*)(void *, char *))s->complete_step)(s->instance, &event_needed));
        event = event_needed != 0;
    }
    if (event || terminate) s->event |= (event ? STEP_EVENT : 0) | (terminate ? TERMINATION : 0);
    return OK;
}

static int advance(void *state, double time, double step_size, int unused) {
    State *s = state;
    (void)unused;
    s->begin = time;
    s->event = 0;
    s->status = OK;
    const int64_t substeps = s->substeps;
    const double size = s->substep_size;
    for (int64_t n = s->next_substep; n < substeps; n++) {
        double end = n + 1 < substeps ? time + (double)(n + 1) * size : time + step_size;
        s->next_substep = n;
        if (s->stages == 1 ? euler_step(s, end) : runge_kutta_step(s, time + (double)n * size, end))
            return DISCARD;
        s->time = end;
        s->next_substep = n + 1;
        if (s->indicator_count && find_state_event(s)) return DISCARD;
        if (s->complete_step && complete_step(s)) return DISCARD;
        if (end >= s->next_event_time - TIME_TOLERANCE * size) s->event |= TIME_EVENT;
        if (s->event) return DISCARD;
    }
    s->next_substep = 0;
    return OK;
}

static struct PyModuleDef definition = {
    .m_base = PyModuleDef_HEAD_INIT,
    .m_name = "_fixed_step",
    .m_doc = "Explicit integration of a Model Exchange FMU at fixed step size.",
    .m_size = -1,
};

PyMODINIT_FUNC PyInit__fixed_step(void) {
    PyObject *module = PyModule_Create(&definition);
    if (!module) return NULL;
    PyObject *address = PyLong_FromVoidPtr((void *)(uintptr_t)advance);
    if (!address || PyModule_AddObjectRef(module, "ADVANCE", address) < 0 ||
        PyModule_AddIntConstant(module, "STATE_SIZE", sizeof(State)) < 0) {
        Py_XDECREF(address);
        Py_DECREF(module);
        return NULL;
    }
    Py_DECREF(address);
    return module;
}
