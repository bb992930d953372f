/* An FMI 3.0 Co-Simulation FMU with Event Mode and early return, written by hand: a lag, a bouncing
   ball and a counter, integrated by Euler's method with steps of 1/1024 s. It refuses calls in a
   wrong mode. An instance named "refusing" cannot be instantiated with Event Mode or early return,
   one named "impossible" not at all. One named "undeclared" returns early in any case.

   Float64: 0 u (input), 1 x (x' = u - x), 2 h, 3 v Int32: 10 i_in (discrete input), 11 i_out = 10
   i_in after events, 12 count (one more every 0.25 s), 13 events (number of calls of
   fmi3EnterEventMode), 14 last_count (the simulation ends there), 15 fault (parameter, after 0.5 s
   unless stated): 1 the event iteration never ends, 2 each step returns an event at its begin, 3
   each step returns at its begin without an event, 4 lastSuccessfulTime is NaN, 5
   lastSuccessfulTime is before the step, 6 the next time event is NaN, 7 the FMU ends in the
   initial event, 8 each internal step is an event, 100 k + n: function k returns status n, or fails
   as `enum failures` says */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "fmi3Functions.h"

enum { U, X, H, V, FLOATS };
enum { I_IN = 10, I_OUT, COUNT, EVENTS, LAST_COUNT, FAULT, INTEGERS_END };
enum { EVENT_MODE = 1, UPDATE, STEP_MODE, CONTINUED_STEP, DERIVATIVES, SET_IN_EVENT };
enum failures { CRASH = 90, ABORT, EXIT };
enum mode { INITIALIZATION, EVENT, STEP };
#define INTERNAL_STEP (1.0 / 1024)

typedef struct {
    double f[FLOATS], time;
    fmi3Int32 i[INTEGERS_END - I_IN];
    enum mode mode;
    bool has_events, may_return_early, returned_early;
} Model;

#define INTEGER(m, NAME) ((m)->i[NAME - I_IN])

static fmi3Status failure(const Model *m, int function) {
    int fault = INTEGER(m, FAULT);
    if (fault / 100 != function || m->time <= 0.5) return fmi3OK;
    if (fault % 100 == CRASH) *(volatile int *)8 = 1;
    if (fault % 100 == ABORT) abort();
    if (fault % 100 == EXIT) exit(7);
    return (fmi3Status)(fault % 100);
}
#define MAY_FAIL(FUNCTION) \
    do { \
        fmi3Status status = failure(m, FUNCTION); \
        if (status) return status; \
    } while (0)

const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, bool on, size_t n, const fmi3String names[]) {
    return fmi3OK;
}

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         bool visible, bool logging, bool events, bool early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    bool refused = !strcmp(name, "impossible") || (!strcmp(name, "refusing") && (events || early));
    if (refused) log(environment, fmi3Error, "error", "this is not supported");
    if (refused) return NULL;
    Model *m = calloc(1, sizeof(Model));
    m->f[X] = m->f[H] = 1;
    INTEGER(m, LAST_COUNT) = 1000;
    m->has_events = events, m->may_return_early = early || !strcmp(name, "undeclared");
    return m;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool has_tolerance, double tolerance,
                                       double start, bool has_stop, double stop) {
    ((Model *)c)->time = start;
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) {
    Model *m = c;
    m->mode = m->has_events ? EVENT : STEP;
    return fmi3OK;
}
fmi3Status fmi3EnterEventMode(fmi3Instance c) {
    Model *m = c;
    MAY_FAIL(EVENT_MODE);
    if (m->mode != STEP || !m->has_events) return fmi3Error;
    m->mode = EVENT;
    INTEGER(m, EVENTS)++;
    return fmi3OK;
}
fmi3Status fmi3EnterStepMode(fmi3Instance c) {
    Model *m = c;
    MAY_FAIL(STEP_MODE);
    if (m->mode != EVENT) return fmi3Error;
    m->mode = STEP;
    return fmi3OK;
}
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { return fmi3OK; }

static double next_event(const Model *m) { return 0.25 * (INTEGER(m, COUNT) + 1); }

static bool is_event(const Model *m) {
    return (m->f[H] <= 0 && m->f[V] < 0) || m->time >= next_event(m) ||
           (INTEGER(m, FAULT) == 8 && m->time > 0.5);
}

static void update(Model *m) {
    if (m->f[H] <= 0 && m->f[V] < 0) {
        m->f[H] = 0;
        m->f[V] *= -0.5;
    }
    if (m->time >= next_event(m)) INTEGER(m, COUNT)++;
    INTEGER(m, I_OUT) = 10 * INTEGER(m, I_IN);
}

fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, bool *again, bool *ends, bool *nominals,
                                    bool *values, bool *has_next, double *next) {
    Model *m = c;
    MAY_FAIL(UPDATE);
    if (m->mode != EVENT) return fmi3Error;
    update(m);
    int fault = INTEGER(m, FAULT);
    *again = fault == 1 && m->time > 0.5;
    *ends = fault == 7 || INTEGER(m, COUNT) >= INTEGER(m, LAST_COUNT);
    *nominals = false, *values = true, *has_next = true;
    *next = fault == 6 && m->time > 0.5 ? NAN : next_event(m);
    return fmi3OK;
}

fmi3Status fmi3DoStep(fmi3Instance c, double begin, double step, bool no_set_state, bool *event,
                      bool *ends, bool *early, double *reached) {
    Model *m = c;
    int fault = m->time > 0.5 ? INTEGER(m, FAULT) : 0;
    double end = begin + step;
    if (m->mode != STEP || fabs(begin - m->time) > INTERNAL_STEP) return fmi3Error;
    if (m->returned_early) MAY_FAIL(CONTINUED_STEP);
    *event = *ends = m->returned_early = false;
    if (fault != 2 && fault != 3)
        while (!*event && m->time + INTERNAL_STEP < end + 1e-9) {
            double slope = m->f[U] - m->f[X];
            m->f[X] += INTERNAL_STEP * slope, m->f[H] += INTERNAL_STEP * m->f[V],
                m->f[V] -= INTERNAL_STEP * 9.81;
            m->time += INTERNAL_STEP;
            if (!is_event(m)) continue;
            bool at_end = m->time + INTERNAL_STEP >= end + 1e-9;
            if (m->has_events && (at_end || m->may_return_early)) *event = true;
            else update(m);
        }
    *event = *event || fault == 2;
    *early = m->returned_early = m->may_return_early && m->time + INTERNAL_STEP < end + 1e-9;
    *reached = fault == 4 ? NAN : fault == 5 ? begin - 1 : m->time;
    return fmi3OK;
}

fmi3Status fmi3GetOutputDerivatives(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                                    const fmi3Int32 order[], double v[], size_t count) {
    Model *m = c;
    MAY_FAIL(DERIVATIVES);
    if (m->mode != STEP) return fmi3Error;
    for (size_t k = 0; k < n; k++) {
        if (vr[k] < X || vr[k] > V || order[k] != 1 || n != count) return fmi3Error;
        v[k] = vr[k] == X ? m->f[U] - m->f[X] : vr[k] == H ? m->f[V] : -9.81;
    }
    return fmi3OK;
}

fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, double v[],
                          size_t count) {
    for (size_t k = 0; k < n; k++) v[k] = ((Model *)c)->f[vr[k]];
    return fmi3OK;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const double v[],
                          size_t count) {
    for (size_t k = 0; k < n; k++) ((Model *)c)->f[vr[k]] = v[k];
    return fmi3OK;
}
fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Int32 v[],
                        size_t count) {
    for (size_t k = 0; k < n; k++) v[k] = ((Model *)c)->i[vr[k] - I_IN];
    return fmi3OK;
}
fmi3Status fmi3SetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n,
                        const fmi3Int32 v[], size_t count) {
    Model *m = c;
    if (m->mode == EVENT) MAY_FAIL(SET_IN_EVENT);
    if (m->mode == STEP && m->has_events) return fmi3Error;
    for (size_t k = 0; k < n; k++) m->i[vr[k] - I_IN] = v[k];
    return fmi3OK;
}

fmi3Status fmi3GetFMUState(fmi3Instance c, fmi3FMUState *state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return fmi3OK;
}
fmi3Status fmi3SetFMUState(fmi3Instance c, fmi3FMUState state) {
    return memcpy(c, state, sizeof(Model)), fmi3OK;
}
fmi3Status fmi3FreeFMUState(fmi3Instance c, fmi3FMUState *state) {
    return free(*state), *state = NULL, fmi3OK;
}
