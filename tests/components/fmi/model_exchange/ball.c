/* A Model Exchange FMU of FMI 1.0, 2.0 or 3.0 (macro FMI), written by hand: a lag, a bouncing ball
   and a counter. With FMI 1.0 it is a Co-Simulation FMU too, which makes one Euler step per
   communication step.

   Real: 0 u (input), 1 x (x' = u - x), 2 x', 3 h, 4 h' = v, 5 v, 6 v' = -9.81 or 0, 7 restitution
   (parameter), 8 time Integer: 10 i_in (discrete input), 11 i_out = 10 i_in after events, 12 count
   (one more every 0.25 s), 13 last_count (the simulation ends there), 14 fault (parameter): 1
   GetDerivatives returns error, 2 the event indicator is NaN, 3 the event iteration never ends, 4
   the next time event is always now, 5 GetDerivatives crashes, 6 discarded derivatives, 7 an event
   after every step, 8 nominal values of 0, 9 derivatives are NaN, 10 the next time event is NaN, 11
   the event indicator changes its sign at each call, 12 the states are NaN after events, 13 the
   number of states changes (FMI 3.0), 14 the next time event is a second ago, 15 it is at minus
   infinity, 16 a derivative is infinite, 17 and 18 the number of states or event indicators is 2^40
   (FMI 3.0), 19 the process receives SIGTERM, 100 k + n: function k (see `enum functions`) returns
   status n, or fails as `enum failures` says */
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

#if FMI == 1
#define F(NAME) ball_fmi##NAME
typedef void *Handle;
typedef int Status, Integer;
typedef unsigned Reference;
#elif FMI == 3
#include "fmi3Functions.h"
#define F(NAME) fmi3##NAME
typedef fmi3Instance Handle;
typedef fmi3Status Status;
typedef fmi3ValueReference Reference;
typedef fmi3Int32 Integer;
#else
#include "fmi2Functions.h"
#define F(NAME) fmi2##NAME
typedef fmi2Component Handle;
typedef fmi2Status Status;
typedef fmi2ValueReference Reference;
typedef fmi2Integer Integer;
#endif

enum { U, X, DX, H, DH, V, DV, RESTITUTION, TIME, REALS };
enum { I_IN = 10, I_OUT, COUNT, LAST_COUNT, FAULT, INTEGERS_END };
enum { GOOD = 0, BAD = 3, DISCARDED = 2 };

enum functions {
    GET_STATES = 1,
    SET_STATES,
    DERIVATIVES,
    INDICATORS,
    SET_TIME,
    EVENT_MODE,
    CONTINUOUS_MODE,
    UPDATE,
    COMPLETE,
    EXIT_INITIALIZATION,
    INITIALIZE,
    TERMINATE,
    GET,
    SET,
    STEP,
    NOMINALS
};
enum failures { CRASH = 90, ABORT, EXIT };

typedef struct {
    double r[REALS];
    Integer i[INTEGERS_END - I_IN];
    double next_event, time;
    int steps;
} Model;

#define INTEGER(m, name) ((m)->i[name - I_IN])

/* Return the status that the fault makes a function return, after 0.5 s or before the first
   step. */
static int failure(Handle c, int function) {
    Model *m = c;
    int fault = INTEGER(m, FAULT),
        early = function == INITIALIZE || function == EXIT_INITIALIZATION;
    if (fault / 100 != function || !(early || m->time > 0.5)) return GOOD;
    if (fault % 100 == CRASH) *(volatile int *)8 = 1;
    if (fault % 100 == ABORT) abort();
    if (fault % 100 == EXIT) exit(7);
    return fault % 100;
}
#define MAY_FAIL(FUNCTION) \
    do { \
        int status = failure(c, FUNCTION); \
        if (status) return (Status)status; \
    } while (0)

static Handle create(void) {
    Model *m = calloc(1, sizeof(Model));
    m->r[X] = m->r[H] = 1;
    m->r[RESTITUTION] = 0.7;
    m->r[DV] = -9.81;
    INTEGER(m, LAST_COUNT) = 1000;
    m->next_event = 0.25;
    return m;
}

static void compute(Model *m) {
    m->r[DX] = m->r[U] - m->r[X];
    m->r[DH] = m->r[V];
    m->r[TIME] = m->time;
}

static int update(Handle c, int *again, int *ends) {
    Model *m = c;
    MAY_FAIL(UPDATE);
    if (m->r[H] <= 0 && m->r[V] < 0) {
        m->r[H] = 0;
        m->r[V] *= -m->r[RESTITUTION];
        if (m->r[V] < 0.1) m->r[V] = m->r[DV] = 0;
    }
    if (m->time >= m->next_event) {
        INTEGER(m, COUNT)++;
        m->next_event = INTEGER(m, FAULT) == 4                     ? m->time
                        : INTEGER(m, FAULT) == 10 && m->time > 0.5 ? NAN
                                                                   : 0.25 * (INTEGER(m, COUNT) + 1);
    }
    if (INTEGER(m, FAULT) == 14 && m->time > 0.5) m->next_event = m->time - 1;
    if (INTEGER(m, FAULT) == 15 && m->time > 0.5) m->next_event = -INFINITY;
    INTEGER(m, I_OUT) = 10 * INTEGER(m, I_IN);
    *again = INTEGER(m, FAULT) == 3;
    *ends = INTEGER(m, COUNT) >= INTEGER(m, LAST_COUNT);
    return GOOD;
}

Status F(GetContinuousStates)(Handle c, double x[], size_t n) {
    Model *m = c;
    MAY_FAIL(GET_STATES);
    x[0] = m->r[X], x[1] = m->r[H], x[2] = m->r[V];
    if (INTEGER(m, FAULT) == 12 && m->time > 0.5) x[1] = NAN;
    return n == 3 ? GOOD : BAD;
}
Status F(SetContinuousStates)(Handle c, const double x[], size_t n) {
    Model *m = c;
    MAY_FAIL(SET_STATES);
    m->r[X] = x[0], m->r[H] = x[1], m->r[V] = x[2];
    return n == 3 ? GOOD : BAD;
}
#if FMI == 1
#define fmi1_GetNominals ball_fmiGetNominalContinuousStates
#else
#define fmi1_GetNominals F(GetNominalsOfContinuousStates)
#endif
Status fmi1_GetNominals(Handle c, double x[], size_t n) {
    MAY_FAIL(NOMINALS);
    x[0] = x[1] = x[2] = INTEGER((Model *)c, FAULT) == 8 ? 0 : 1;
    return n == 3 ? GOOD : BAD;
}
static Status derivatives(Handle c, double dx[]) {
    Model *m = c;
    MAY_FAIL(DERIVATIVES);
    if (INTEGER(m, FAULT) == 1 && m->time > 0.5) return BAD;
    if (INTEGER(m, FAULT) == 6 && m->time > 0.5) return DISCARDED;
    if (INTEGER(m, FAULT) == 5 && m->time > 0.5) *(volatile int *)8 = 1;
    if (INTEGER(m, FAULT) == 19 && m->time > 0.5) raise(SIGTERM);
    compute(m);
    if (INTEGER(m, FAULT) == 16 && m->time > 0.5) m->r[DX] = INFINITY;
    dx[0] = INTEGER(m, FAULT) == 9 && m->time > 0.5 ? NAN : m->r[DX], dx[1] = m->r[DH],
    dx[2] = m->r[DV];
    return GOOD;
}
#if FMI == 3
#define SEED_AND_RESULT const double dv[], size_t ndv, double dz[], size_t ndz
#else
#define SEED_AND_RESULT const double dv[], double dz[]
#endif
#if FMI > 1
/* The derivatives of x', h', x, h and v with respect to u, x, h or v. */
Status F(GetDirectionalDerivative)(Handle c, const Reference z[], size_t nz, const Reference v[],
                                   size_t nv, SEED_AND_RESULT) {
    (void)c;
    for (size_t k = 0; k < nz; k++) {
        double slope = z[k] == v[0] ? 1
                       : z[k] == DX ? (v[0] == U) - (v[0] == X)
                       : z[k] == DH ? v[0] == V
                                    : 0;
        dz[k] = slope * dv[0];
    }
    return nv == 1 ? GOOD : BAD;
}
#endif
Status F(GetEventIndicators)(Handle c, double z[], size_t n) {
    Model *m = c;
    MAY_FAIL(INDICATORS);
    if (INTEGER(m, FAULT) == 11 && m->time > 0.5) return z[0] = m->steps++ % 2 ? 1 : -1, GOOD;
    z[0] = INTEGER(m, FAULT) == 2 && m->time > 0.5 ? NAN
           : m->r[H] <= 0 && m->r[V] >= 0          ? 1e-9
                                                   : m->r[H];
    return n == 1 ? GOOD : BAD;
}
Status F(SetTime)(Handle c, double time) {
    MAY_FAIL(SET_TIME);
    ((Model *)c)->time = time;
    return GOOD;
}
Status F(EnterEventMode)(Handle c) { return (Status)failure(c, EVENT_MODE); }
Status F(EnterContinuousTimeMode)(Handle c) { return (Status)failure(c, CONTINUOUS_MODE); }
Status F(ExitInitializationMode)(Handle c) { return (Status)failure(c, EXIT_INITIALIZATION); }
Status F(Terminate)(Handle c) { return (Status)failure(c, TERMINATE); }
Status F(Reset)(Handle c) { return GOOD; }
void F(FreeInstance)(Handle c) { free(c); }
const char *F(GetVersion)(void) { return FMI == 3 ? "3.0" : FMI == 2 ? "2.0" : "1.0"; }

#define ACCESS(NAME, TYPE, MEMBER, FIRST, EXTRA) \
    Status F(Get##NAME)(Handle c, const Reference vr[], size_t n, TYPE v[] EXTRA) { \
        MAY_FAIL(GET); \
        compute(c); \
        for (size_t k = 0; k < n; k++) v[k] = ((Model *)c)->MEMBER[vr[k] - FIRST]; \
        return GOOD; \
    } \
    Status F(Set##NAME)(Handle c, const Reference vr[], size_t n, const TYPE v[] EXTRA) { \
        MAY_FAIL(SET); \
        for (size_t k = 0; k < n; k++) ((Model *)c)->MEMBER[vr[k] - FIRST] = v[k]; \
        return GOOD; \
    }
#define COUNT_ARGUMENT , size_t count

Status F(GetState)(Handle c, void **state) {
    if (!*state) *state = malloc(sizeof(Model));
    memcpy(*state, c, sizeof(Model));
    return GOOD;
}

#if FMI == 1
ACCESS(Real, double, r, 0, )
ACCESS(Integer, Integer, i, I_IN, )

typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*free)(void *);
    void (*finished)(void *, int);
} Callbacks;
typedef struct {
    char converged, references_changed, values_changed, ends, has_next;
    double next_event;
} EventInfo;

void *ball_fmiInstantiateModel(const char *name, const char *guid, Callbacks callbacks,
                               char logging) {
    if (!strcmp(name, "impossible")) return NULL;
    callbacks.logger(NULL, name, 0, "info", "a ball of FMI %.1f", 1.0);
    return create();
}
void ball_fmiFreeModelInstance(void *c) { free(c); }
int ball_fmiCompletedIntegratorStep(void *c, char *event) {
    MAY_FAIL(COMPLETE);
    *event = INTEGER((Model *)c, FAULT) == 7;
    return GOOD;
}
int ball_fmiEventUpdate(void *c, char intermediate, EventInfo *info) {
    int again, ends, status = update(c, &again, &ends);
    if (status) return status;
    info->converged = !again, info->values_changed = 1, info->ends = (char)ends, info->has_next = 1;
    info->next_event = ((Model *)c)->next_event;
    return GOOD;
}
int ball_fmiInitialize(void *c, char has_tolerance, double tolerance, EventInfo *info) {
    MAY_FAIL(INITIALIZE);
    return ball_fmiEventUpdate(c, 0, info);
}
int ball_fmiGetDerivatives(void *c, double dx[], size_t n) { return derivatives(c, dx); }

void *ball_fmiInstantiateSlave(const char *name, const char *guid, const char *location,
                               const char *mime, double timeout, char visible, char interactive,
                               Callbacks callbacks, char logging) {
    return strncmp(location, "file:///", 8) ? NULL : create();
}
int ball_fmiInitializeSlave(void *c, double start, char has_stop, double stop) {
    MAY_FAIL(INITIALIZE);
    ((Model *)c)->time = start;
    return GOOD;
}
int ball_fmiTerminateSlave(void *c) { return failure(c, TERMINATE); }
void ball_fmiFreeSlaveInstance(void *c) { free(c); }
int ball_fmiDoStep(void *c, double time, double step, char new_step) {
    Model *m = c;
    int again, ends;
    if (new_step != 1) return BAD;
    MAY_FAIL(STEP);
    if (INTEGER(m, FAULT) == 6 && time > 0.5) return DISCARDED;
    compute(m);
    if (INTEGER(m, FAULT) == 9 && time > 0.5) m->r[DX] = NAN;
    m->r[X] += step * m->r[DX], m->r[H] += step * m->r[DH], m->r[V] += step * m->r[DV];
    m->time = time + step;
    update(m, &again, &ends);
    return GOOD;
}
int ball_fmiGetRealStatus(void *c, int kind, double *value) {
    *value = ((Model *)c)->time;
    return kind == 2 ? GOOD : BAD;
}
#elif FMI == 3
ACCESS(Float64, double, r, 0, COUNT_ARGUMENT)
ACCESS(Int32, Integer, i, I_IN, COUNT_ARGUMENT)

fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                          fmi3Boolean visible, fmi3Boolean logging,
                                          fmi3InstanceEnvironment environment,
                                          fmi3LogMessageCallback log) {
    return create();
}
Status fmi3EnterInitializationMode(Handle c, bool has_tolerance, double tolerance, double start,
                                   bool has_stop, double stop) {
    MAY_FAIL(INITIALIZE);
    ((Model *)c)->time = start;
    return GOOD;
}
Status fmi3GetContinuousStateDerivatives(Handle c, double dx[], size_t n) {
    return derivatives(c, dx);
}
Status fmi3GetNumberOfContinuousStates(Handle c, size_t *n) {
    return *n = INTEGER((Model *)c, FAULT) == 13   ? 4
                : INTEGER((Model *)c, FAULT) == 17 ? (size_t)1 << 40
                                                   : 3,
           GOOD;
}
Status fmi3GetNumberOfEventIndicators(Handle c, size_t *n) {
    return *n = INTEGER((Model *)c, FAULT) == 18 ? (size_t)1 << 40 : 1, GOOD;
}
Status fmi3CompletedIntegratorStep(Handle c, bool no_set_state, bool *event, bool *ends) {
    MAY_FAIL(COMPLETE);
    *event = INTEGER((Model *)c, FAULT) == 7;
    *ends = false;
    return GOOD;
}
Status fmi3UpdateDiscreteStates(Handle c, bool *again, bool *ends, bool *nominals, bool *values,
                                bool *has_next, double *next) {
    int more, last, status = update(c, &more, &last);
    if (status) return (Status)status;
    *again = more, *ends = last, *nominals = false, *values = true, *has_next = true;
    *next = ((Model *)c)->next_event;
    return GOOD;
}
Status fmi3GetFMUState(Handle c, fmi3FMUState *state) { return fmi3GetState(c, state); }
Status fmi3SetFMUState(Handle c, fmi3FMUState state) {
    return memcpy(c, state, sizeof(Model)), GOOD;
}
Status fmi3FreeFMUState(Handle c, fmi3FMUState *state) { return free(*state), *state = NULL, GOOD; }
#else
ACCESS(Real, double, r, 0, )
ACCESS(Integer, Integer, i, I_IN, )

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    return type == fmi2ModelExchange ? create() : NULL;
}
Status fmi2SetupExperiment(Handle c, fmi2Boolean has_tolerance, double tolerance, double start,
                           fmi2Boolean has_stop, double stop) {
    ((Model *)c)->time = start;
    return GOOD;
}
Status fmi2EnterInitializationMode(Handle c) { return (Status)failure(c, INITIALIZE); }
Status fmi2GetDerivatives(Handle c, double dx[], size_t n) { return derivatives(c, dx); }
Status fmi2CompletedIntegratorStep(Handle c, fmi2Boolean no_set_state, fmi2Boolean *event,
                                   fmi2Boolean *ends) {
    MAY_FAIL(COMPLETE);
    *event = INTEGER((Model *)c, FAULT) == 7;
    *ends = fmi2False;
    return GOOD;
}
Status fmi2NewDiscreteStates(Handle c, fmi2EventInfo *info) {
    memset(info, 0, sizeof *info);
    int status = update(c, &info->newDiscreteStatesNeeded, &info->terminateSimulation);
    if (status) return (Status)status;
    info->valuesOfContinuousStatesChanged = info->nextEventTimeDefined = fmi2True;
    info->nextEventTime = ((Model *)c)->next_event;
    return GOOD;
}
Status fmi2GetFMUstate(Handle c, fmi2FMUstate *state) { return fmi2GetState(c, state); }
Status fmi2SetFMUstate(Handle c, fmi2FMUstate state) {
    return memcpy(c, state, sizeof(Model)), GOOD;
}
Status fmi2FreeFMUstate(Handle c, fmi2FMUstate *state) { return free(*state), *state = NULL, GOOD; }
#endif
