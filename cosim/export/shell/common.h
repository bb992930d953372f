/* Functions that the FMI 2.0 and 3.0 shells share: life cycle, access to variables and FMU state.
 *
 * A shell includes the FMI header, defines `Logger` (type of the importer's log callback) and
 * `ARRAYS` (true if variables may have several elements) and includes this file. Then it defines
 * `report` (below) and the functions of its FMI version. The functions in this file return true
 * on success. On failure they call `refuse` and return false, and the shell returns an error
 * status.
 */
#include <float.h>
#include <math.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "export.h"
#include "model.h"

void model_start(Model *m);
void model_parameters(Model *m);
const char *model_initialize(Model *m, double time);
const char *model_step(Model *m, double time, double step_size);

/* The FMI standard defines the parameters of its functions; not all of them are used. */
#ifdef __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

/* ---- instances ------------------------------------------------------------------------------- */

/* Phases of the life cycle of an instance; bits, so that an integer represents a set of phases. */
typedef enum {
    INSTANTIATED = 1,
    INITIALIZING = 2,
    STEPPING = 4,
    TERMINATED = 8,
    FAILED = 16,
    EVENT = 32,
    CONTINUOUS = 64
} Phase;

/* Phases between initialization and termination; the last two are those of Model Exchange. */
enum { RUNNING = STEPPING | EVENT | CONTINUOUS };

/* The FMU state; it contains no pointers, so that it is saved by a copy. */
typedef struct {
    Model model;
    double time;      /* current communication point */
    double stop_time; /* infinite if undefined */
    Phase phase;
    bool stale;       /* a variable was set after the variables that depend on it were computed */
} State;

typedef struct {
    State state;
    Logger logger;
    void *environment;
    char *name;
    bool exchange; /* an instance for Model Exchange */
} Instance;

/* ---- the table of variables ------------------------------------------------------------------ */

typedef enum { FLOAT64, INT32, BOOLEAN, ENUMERATION } Type;
typedef enum { READ_ONLY, FIXED_PARAMETER, TUNABLE_PARAMETER, INPUT } Role;

/* A variable; its value reference is its index in the table. An enumeration has the values 1 to
   `literals`. */
typedef struct {
    const char *name;
    Type type;
    Role role;
    size_t offset; /* in State */
    size_t count;  /* elements of an array, 1 for a scalar */
    int literals;
} Variable;

#include "variables.h" /* generated: VARIABLES[] and TOKEN */

#define VARIABLE_COUNT (sizeof VARIABLES / sizeof VARIABLES[0])

/* ---- failures -------------------------------------------------------------------------------- */

/* Passes an error message to the log callback of the importer; defined by each shell. */
static void report(const Instance *instance, bool error, const char *message);

/* Logs the reason for the failure of a call. After it only reading, restoring a saved state, reset
   and free are allowed. */
static bool refuse(Instance *instance, const char *function, const char *format, ...)
{
    char message[512];
    int length = snprintf(message, sizeof message, "%s: ", function);
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message + length, sizeof message - (size_t)length, format, arguments);
    va_end(arguments);
    report(instance, true, message);
    instance->state.phase = FAILED;
    return false;
}

static const char *phase_name(Phase phase)
{
    switch (phase) {
    case INSTANTIATED: return "after instantiation";
    case INITIALIZING: return "in initialization mode";
    case STEPPING: return "while stepping";
    case EVENT: return "in event mode";
    case CONTINUOUS: return "in continuous-time mode";
    case TERMINATED: return "after termination";
    default: return "after an error";
    }
}

static bool not_expected(Instance *instance, const char *function)
{
    return refuse(instance, function, "not allowed %s", phase_name(instance->state.phase));
}

static inline bool expect(Instance *instance, const char *function, int phases)
{
    return (instance->state.phase & phases) || not_expected(instance, function);
}

/* Checks the result of a function of the model: NULL, or the reason for its failure. */
static bool succeeded(Instance *instance, const char *function, const char *reason)
{
    return reason == NULL || refuse(instance, function, "%s", reason);
}

/* Whether the model has requested the end of the simulation. */
static inline bool requests_termination(const Instance *instance)
{
#ifdef MODEL_TERMINATES
    return instance->state.model.terminated;
#else
    return false;
#endif
}

/* Logs the warnings of the model since the last call. */
static void report_warnings(Instance *instance)
{
#ifdef MODEL_WARNINGS
    if (instance->state.model.warning[0] == '\0') return;
    report(instance, false, instance->state.model.warning);
    instance->state.model.warning[0] = '\0';
#else
    (void)instance;
#endif
}

/* ---- life cycle ------------------------------------------------------------------------------ */

static void reset(Instance *instance)
{
    State *state = &instance->state;
    memset(state, 0, sizeof *state); /* also the padding, so that equal states have equal bytes */
    model_start(&state->model);
    model_parameters(&state->model);
    state->stop_time = INFINITY;
    state->phase = INSTANTIATED;
}

/* Returns a new instance, or NULL after an error message. */
static Instance *create(const char *function, const char *name, const char *token, Logger logger,
                        void *environment)
{
    Instance nobody = {
        .logger = logger, .environment = environment, .name = (char *)(name ? name : "")};
    if (name == NULL || name[0] == '\0')
        return refuse(&nobody, function, "the instance name is empty"), NULL;
    if (token == NULL || strcmp(token, TOKEN) != 0)
        return refuse(&nobody, function, "found token %.100s, expected %s", token ? token : "NULL",
                      TOKEN),
               NULL;
    Instance *instance = calloc(1, sizeof *instance);
    char *copy = malloc(strlen(name) + 1);
    if (instance == NULL || copy == NULL) {
        free(instance);
        free(copy);
        return refuse(&nobody, function, "out of memory"), NULL;
    }
    instance->name = strcpy(copy, name);
    instance->logger = logger;
    instance->environment = environment;
    reset(instance);
    return instance;
}

static void destroy(Instance *instance)
{
    if (instance == NULL) return;
#ifdef MODEL_FREE
    model_free(&instance->state.model);
#endif
    free(instance->name);
    free(instance);
}

static bool set_times(Instance *instance, const char *function, double start, bool has_stop,
                      double stop)
{
    if (!expect(instance, function, INSTANTIATED)) return false;
    if (!isfinite(start))
        return refuse(instance, function, "the start time %g is not finite", start);
    if (has_stop && !(stop >= start))
        return refuse(instance, function, "the stop time %.12g lies before the start time %.12g",
                      stop, start);
    instance->state.time = start;
    instance->state.stop_time = has_stop ? stop : INFINITY;
    return true;
}

static bool enter_initialization(Instance *instance, const char *function)
{
    if (!expect(instance, function, INSTANTIATED)) return false;
    instance->state.phase = INITIALIZING;
    instance->state.stale = true;
    return true;
}

/* Computes the model before a variable is read if another one was set before; not between
   communication steps. */
static bool refresh(Instance *instance, const char *function)
{
    State *state = &instance->state;
    if (!state->stale) return true;
#ifdef MODEL_EXCHANGE
    if (state->phase & (EVENT | CONTINUOUS)) {
        state->stale = false;
        return succeeded(instance, function, model_continuous(&state->model, state->time));
    }
#endif
    if (state->phase != INITIALIZING) return true;
    state->stale = false;
    if (!succeeded(instance, function, model_initialize(&state->model, state->time))) return false;
    report_warnings(instance);
    return true;
}

static bool exit_initialization(Instance *instance, const char *function)
{
    if (!expect(instance, function, INITIALIZING) || !refresh(instance, function)) return false;
    instance->state.phase = instance->exchange ? EVENT : STEPPING;
    return true;
}

static bool step(Instance *instance, const char *function, double time, double step_size)
{
    State *state = &instance->state;
    /* n * h and t + h have different rounding */
    const double slack = 1e-6 * step_size + 4 * DBL_EPSILON * fabs(state->time);
    if (!expect(instance, function, STEPPING)) return false;
    if (!(step_size > 0) || !isfinite(step_size))
        return refuse(instance, function, "found step size %.12g, expected a positive one",
                      step_size);
    if (!(fabs(time - state->time) <= slack))
        return refuse(instance, function, "found time %.12g, expected %.12g", time, state->time);
    if (time + step_size > state->stop_time + slack)
        return refuse(instance, function, "the step to %.12g passes the stop time %.12g",
                      time + step_size, state->stop_time);
    if (!succeeded(instance, function, model_step(&state->model, time, step_size))) return false;
    report_warnings(instance);
    state->time = time + step_size;
    return true;
}

static bool terminate(Instance *instance, const char *function)
{
    if (!expect(instance, function, RUNNING)) return false;
    instance->state.phase = TERMINATED;
    return true;
}

/* ---- access to variables --------------------------------------------------------------------- */

/* Error messages are created in separate functions, so that the functions that check are short and
   compilers inline them. */
static const Variable *not_found(Instance *instance, const char *function, unsigned reference,
                                 Type type)
{
    static const char *const TYPES[] = {"Float64", "Int32", "Boolean", "Enumeration"};
    if (reference >= VARIABLE_COUNT)
        refuse(instance, function, "found value reference %u, expected less than %zu", reference,
               VARIABLE_COUNT);
    else
        refuse(instance, function, "%s is of type %s", VARIABLES[reference].name,
               TYPES[VARIABLES[reference].type]);
    return NULL;
}

static inline const Variable *find(Instance *instance, const char *function, unsigned reference,
                                   Type type)
{
    if (reference < VARIABLE_COUNT && VARIABLES[reference].type == type)
        return &VARIABLES[reference];
    return not_found(instance, function, reference, type);
}

static bool not_writable(Instance *instance, const char *function, const Variable *variable)
{
    const char *name = variable->name, *when = phase_name(instance->state.phase);
    if (variable->role == READ_ONLY)
        return refuse(instance, function, "%s is neither parameter nor input", name);
    return refuse(instance, function, "%s is a fixed parameter and cannot be set %s", name, when);
}

static inline bool writable(Instance *instance, const char *function, const Variable *variable)
{
    const Role role = variable->role;
    if (role > FIXED_PARAMETER || (role == FIXED_PARAMETER && !(instance->state.phase & RUNNING)))
        return true;
    return not_writable(instance, function, variable);
}

static bool not_acceptable(Instance *instance, const char *function, const Variable *variable,
                           double value)
{
    if (!isfinite(value))
        return refuse(instance, function, "%s: found %g, expected a finite value", variable->name,
                      value);
    return refuse(instance, function, "%s: found %g, expected 1 to %d", variable->name, value,
                  variable->literals);
}

static inline bool acceptable(Instance *instance, const char *function, const Variable *variable,
                              double value)
{
    if (isfinite(value) && (variable->literals == 0 || (value >= 1 && value <= variable->literals)))
        return true;
    return not_acceptable(instance, function, variable, value);
}

static bool not_fitting(Instance *instance, const char *function, size_t expected, size_t found,
                        bool complete)
{
    return refuse(instance, function, "found %zu values, expected %s%zu", found,
                  complete ? "" : "at least ", expected);
}

static inline size_t elements(const Variable *variable)
{
    return ARRAYS ? variable->count : 1;
}

/* Checks the number of values in the importer's array; for scalars (ARRAYS == 0) it equals the
   number of variables. */
static inline bool fits(Instance *instance, const char *function, size_t expected, size_t found,
                        bool complete)
{
    if (!ARRAYS || (complete ? found == expected : found >= expected)) return true;
    return not_fitting(instance, function, expected, found, complete);
}

static bool after_writing(Instance *instance, bool parameters)
{
    if (parameters) model_parameters(&instance->state.model);
    instance->state.stale = true;
    return true;
}

/* Defines read_NAME and write_NAME, which copy between the importer's values (Outside) and members
   of the model (Inside). */
#define DEFINE_ACCESS(NAME, TYPE, Outside, Inside) \
    static bool read_##NAME(Instance *instance, const char *function, const unsigned references[], \
                            size_t count, Outside values[], size_t value_count) { \
        size_t done = 0; \
        if (!refresh(instance, function)) return false; \
        for (size_t i = 0; i < count; ++i) { \
            const Variable *variable = find(instance, function, references[i], TYPE); \
            if (!variable || \
                !fits(instance, function, done + elements(variable), value_count, false)) \
                return false; \
            const Inside *source = \
                (const Inside *)((const char *)&instance->state + variable->offset); \
            for (size_t k = 0; k < elements(variable); ++k) values[done++] = source[k]; \
        } \
        return fits(instance, function, done, value_count, true); \
    } \
\
    static bool write_##NAME(Instance *instance, const char *function, \
                             const unsigned references[], size_t count, const Outside values[], \
                             size_t value_count) { \
        size_t done = 0; \
        bool parameters = false; \
        if (!expect(instance, function, INSTANTIATED | INITIALIZING | RUNNING)) return false; \
        for (size_t i = 0; i < count; ++i) { \
            const Variable *variable = find(instance, function, references[i], TYPE); \
            if (!variable || !writable(instance, function, variable)) return false; \
            if (!fits(instance, function, done + elements(variable), value_count, false)) \
                return false; \
            Inside *target = (Inside *)((char *)&instance->state + variable->offset); \
            for (size_t k = 0; k < elements(variable); ++k, ++done) { \
                if (!acceptable(instance, function, variable, (double)values[done])) return false; \
                target[k] = (Inside)values[done]; \
            } \
            parameters = parameters || variable->role != INPUT; \
        } \
        return fits(instance, function, done, value_count, true) && \
               after_writing(instance, parameters); \
    }

/* ---- the FMU state --------------------------------------------------------------------------- */

/* A serialized state consists of the token, which identifies the FMU, and the bytes of State. */
enum { SERIALIZED_SIZE = sizeof TOKEN + sizeof(State) };

/* Copies a state into `*saved`, which is allocated when NULL. */
static bool save_state(Instance *instance, const char *function, const State *state, void **saved)
{
    if (*saved == NULL) *saved = malloc(sizeof *state);
    if (*saved == NULL) return refuse(instance, function, "out of memory");
    memcpy(*saved, state, sizeof *state);
    return true;
}

static bool get_state(Instance *instance, const char *function, void **saved)
{
    if (!expect(instance, function, INSTANTIATED | INITIALIZING | RUNNING | TERMINATED))
        return false;
    return save_state(instance, function, &instance->state, saved);
}

static bool set_state(Instance *instance, const char *function, const void *saved)
{
    if (saved == NULL) return refuse(instance, function, "the state is NULL");
    memcpy(&instance->state, saved, sizeof instance->state);
    return true;
}

static void free_state(void **saved)
{
    if (saved == NULL) return;
    free(*saved);
    *saved = NULL;
}

static bool serialize(Instance *instance, const char *function, const void *saved, void *bytes,
                      size_t size)
{
    if (saved == NULL) return refuse(instance, function, "the state is NULL");
    if (size != SERIALIZED_SIZE)
        return refuse(instance, function, "found %zu bytes, expected %d", size, SERIALIZED_SIZE);
    memcpy(bytes, TOKEN, sizeof TOKEN);
    memcpy((char *)bytes + sizeof TOKEN, saved, sizeof(State));
    return true;
}

static bool deserialize(Instance *instance, const char *function, const void *bytes, size_t size,
                        void **saved)
{
    State state;
    if (size != SERIALIZED_SIZE)
        return refuse(instance, function, "found %zu bytes, expected %d", size, SERIALIZED_SIZE);
    if (memcmp(bytes, TOKEN, sizeof TOKEN) != 0)
        return refuse(instance, function, "the state is that of another FMU");
    memcpy(&state, (const char *)bytes + sizeof TOKEN, sizeof state);
    return save_state(instance, function, &state, saved);
}
