/* The native executor: runs the macro steps of a plan that is given as a flat list of operations.

   The stepping loop does no lookup and no allocation. All addresses come from
   cosim/engine/native_executor.py, which keeps the memory behind them alive. Results are
   bit-identical to those of the pure Python executor (values, order, rounding). */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#if defined(__x86_64__) || defined(_M_X64)
#include <xmmintrin.h>
/* rounding, flush to zero, denormals are zero, traps; not the sticky flags */
#define MXCSR_CONTROL 0xFFC0u
static unsigned sse_control(void) { return _mm_getcsr() & MXCSR_CONTROL; }
#else
static unsigned sse_control(void) { return 0; }
#endif

static unsigned x87_control(void) {
    uint16_t word = 0;
#if defined(__x86_64__) && defined(__GNUC__)
    __asm__ volatile("fnstcw %0" : "=m"(word));
#endif
    return word;
}

/* also in native_executor.py, where it is described */
enum { INTERFACE = 9 };
/* FMI statuses; 0 is OK, everything but OK and WARNING is bad */
enum { WARNING = 1, DISCARD = 2 };
/* Codes passed to `on_status` like an FMI status. They exceed 32 bits, so no FMU can return
   them. */
#define FLOAT_MODE_CHANGED (INT64_C(1) << 33)
#define FLOAT_TRAPS_ENABLED (INT64_C(1) << 34)
#define NOT_FINITE (INT64_C(1) << 35)
#define CONDITIONS_CHANGED (INT64_C(1) << 36)
#define PYTHON_EXCEPTION INT64_MIN
/* answers of `on_status`; the last one discards the macro step */
enum { CONTINUE = 0, END_AFTER_STEP = 1, END_BEFORE_STEP = 2 };
/* marker: number of the current call, completed steps, rows */
enum { MARKER_CALL = 0, MARKER_STEPS = 1, MARKER_ROWS = 2 };
/* the first doStep calls of each instance, whose durations are measured */
enum { MEASURED_STEPS = 3 };
/* macro steps; reading the control register takes longer than some steps */
enum { TRAP_CHECK_INTERVAL = 8 };
/* ns; estimated duration of one operation */
enum { SIGNAL_CHECK_INTERVAL = 50000000, OPERATION_DURATION = 20 };

/* C functions of FMI 2.0 and FMI 3.0; `values` has the element type of the function. */
typedef int Fmi2GetSet(void *instance, const uint32_t *value_references, size_t count,
                       void *values);
typedef int Fmi3GetSet(void *instance, const uint32_t *value_references, size_t count, void *values,
                       size_t value_count);
typedef int Fmi2DoStep(void *instance, double time, double step_size, int no_set_state);
typedef int Fmi3DoStep(void *instance, double time, double step_size, bool no_set_state,
                       bool *event_needed, bool *terminate, bool *early_return,
                       double *last_successful_time);

/* target[i] = factor[i] * source[i] + offset[i], `delay` macro steps late */
typedef struct {
    char *target, *source;
    /* format characters of Python's struct module */
    char target_kind, source_kind;
    const Py_ssize_t *target_indices, *source_indices; /* NULL: consecutive elements */
    Py_ssize_t count;
    const double *factor, *offset;                     /* NULL: no unit conversion */
    char *ring;                                        /* `delay` rows of source values */
    Py_ssize_t delay, oldest;                          /* oldest: index of the oldest row */
    /* not 0: rows of source_indices, whose double values are added */
    Py_ssize_t terms;
    const Py_ssize_t *slope_indices;                   /* not NULL: see `run_linear_transfer` */
    int interpolates;
    double step_size;                                  /* s */
} Transfer;

typedef struct {
    bool *flags;                /* eventHandlingNeeded, terminateSimulation, earlyReturn */
    double *last_successful_time;
    int64_t shortest_ns;
    int measurements_left;
} DoStepData;

typedef enum {
    BLOCK_COPY, INDEXED_COPY, TRANSFER, STEP_BEGIN, PACKED_STEPS, GET_SET2, GET_SET3, DO_STEP2,
    DO_STEP3, FLAG_CHECK, PYTHON_CALL
} OperationKind;

/* The most frequent step in compact form: set, doStep and get of one FMU; `set` is NULL without
   connected inputs. Consecutive instances of an FMU whose variables are the same share their
   `StepCalls`, which then stay in the cache. */
typedef struct {
    void *set, *do_step, *get;
    const uint32_t *set_references, *get_references;
    size_t set_reference_count, get_reference_count, set_value_count, get_value_count;
    double step_size;
    int fmi_version;
} StepCalls;

typedef struct {
    const StepCalls *calls;
    void *instance, *set_values, *get_values;
    union {
        /* FMI 2.0: instance for doStep, that of the integrator of a Model Exchange FMU */
        void *stepped;
        bool *flags;            /* FMI 3.0, like the next member */
    };
    double *last_successful_time;
    int first_call;
} PackedStep;

typedef struct {
    OperationKind kind;
    int call_number;
    /* STEP_BEGIN, PACKED_STEPS: index of the first operation after the step or steps */
    Py_ssize_t end;
    void *function, *instance;
    union {
        struct {
            const uint32_t *references;
            size_t reference_count;
            void *values;
            size_t value_count;
        } get_set;
        struct { DoStepData *data; double step_size; } do_step;
        Transfer *transfer;
        struct { char *target; const char *source; size_t size; } block;
        struct { const PackedStep *first, *end; } packed;
        struct { PyObject *callable, *arguments; } python;
        int64_t divisor;
    };
} Operation;

typedef struct {
    const char *source;
    const Py_ssize_t *indices;
    Py_ssize_t count, item_size, position;
} RowPart;

/* Instructions of a stop condition; cosim/engine/stop_conditions.py describes them. */
typedef enum {
    PUSH, LOAD, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, NEGATE, NOT, ABS, SQRT, EXP, LOG, MIN, MAX,
    LT, LE, GT, GE, EQ, NE, AND, OR,
    TRUTH
} InstructionKind;
/* more than an expression of 1000 characters needs */
enum { MAX_STACK_DEPTH = 512 };

typedef struct {
    InstructionKind kind;
    double value;
    const char *source;
    char source_kind;
    Py_ssize_t skip;
} Instruction;

/* `met`: whether it was met at the last recorded point, -1 before the first one. */
typedef struct { Instruction *instructions; Py_ssize_t count, depth; int met; } Condition;

typedef struct {
    PyObject_HEAD
    Operation *operations;
    Py_ssize_t count, capacity;
    Py_ssize_t step_start;      /* index of the STEP_BEGIN of the step that is being added */
    double *current_time;
    volatile int64_t *marker;
    PyObject *on_status, *record;
    unsigned sse_control, x87_control; /* in the usual floating-point mode */
    double one, tiny, smallest; /* see `rounds_as_usual` */
    const uint64_t *doubles;    /* bit patterns of the monitored floats */
    const uint32_t *singles;
    Py_ssize_t double_count, single_count;
    const char *buffer;         /* copied whole into every row; NULL: rows consist of row parts */
    Py_ssize_t buffer_size, record_every, row_size;
    RowPart *row_parts;
    Py_ssize_t row_part_count;
    char *row, *rows_end;       /* address of the next row, and of the end of the chunk */
    Condition *conditions;
    Py_ssize_t condition_count;
    /* from here on CONDITIONS_CHANGED is reported even without a change */
    int64_t wake_point;
    PackedStep *packed_steps;
    StepCalls *step_calls;
    uint32_t *references;       /* value references of the step calls */
    int is_packed;
    PyThreadState *thread_state; /* saved while the interpreter lock is released */
    long end_request;           /* highest answer of `on_status` so far */
} Program;

/* ---- values ---------------------------------------------------------------------------------- */

static Py_ssize_t item_size(char kind) {
    switch (kind) {
    case 'd': case 'q': case 'Q': return 8;
    case 'f': case 'i': case 'I': return 4;
    case 'h': case 'H': return 2;
    default: return 1;
    }
}

static double as_double(const char *values, char kind, Py_ssize_t i) {
    switch (kind) {
    case 'd': return ((const double *)values)[i];
    case 'f': return ((const float *)values)[i];
    case 'b': return ((const int8_t *)values)[i];
    case 'B': return ((const uint8_t *)values)[i];
    case 'h': return ((const int16_t *)values)[i];
    case 'H': return ((const uint16_t *)values)[i];
    case 'i': return ((const int32_t *)values)[i];
    case 'I': return ((const uint32_t *)values)[i];
    case 'q': return (double)((const int64_t *)values)[i];
    case 'Q': return (double)((const uint64_t *)values)[i];
    default: return ((const bool *)values)[i];
    }
}

static int64_t as_integer(const char *values, char kind, Py_ssize_t i) {
    switch (kind) {
    case 'q': return ((const int64_t *)values)[i];
    case 'Q': return (int64_t)((const uint64_t *)values)[i];
    default: return (int64_t)as_double(values, kind, i); /* exact: at most 32 bits */
    }
}

static void store_integer(char *values, char kind, Py_ssize_t i, int64_t value) {
    switch (kind) {
    case 'b': ((int8_t *)values)[i] = (int8_t)value; break;
    case 'B': ((uint8_t *)values)[i] = (uint8_t)value; break;
    case 'h': ((int16_t *)values)[i] = (int16_t)value; break;
    case 'H': ((uint16_t *)values)[i] = (uint16_t)value; break;
    case 'i': ((int32_t *)values)[i] = (int32_t)value; break;
    case 'I': ((uint32_t *)values)[i] = (uint32_t)value; break;
    case 'q': ((int64_t *)values)[i] = value; break;
    case 'Q': ((uint64_t *)values)[i] = (uint64_t)value; break;
    default: ((bool *)values)[i] = value != 0; break;
    }
}

/* target[to] = source[from], converted by element `i` of factor and offset. */
static void convert_value(const Transfer *transfer, char *target, const char *source, Py_ssize_t i,
                          Py_ssize_t to, Py_ssize_t from) {
    if (transfer->target_kind == 'd' || transfer->target_kind == 'f') {
        double value = as_double(source, transfer->source_kind, from);
        if (transfer->factor) value = transfer->factor[i] * value + transfer->offset[i];
        if (transfer->target_kind == 'd') ((double *)target)[to] = value;
        else ((float *)target)[to] = (float)value;
    } else {
        store_integer(target, transfer->target_kind, to,
                      as_integer(source, transfer->source_kind, from));
    }
}

static void convert_values(const Transfer *transfer, char *target, const Py_ssize_t *target_indices,
                           const char *source, const Py_ssize_t *source_indices) {
    for (Py_ssize_t i = 0; i < transfer->count; i++)
        convert_value(transfer, target, source, i, target_indices ? target_indices[i] : i,
                      source_indices ? source_indices[i] : i);
}

static void add_terms(const Transfer *transfer) {
    const double *source = (const double *)transfer->source;
    for (Py_ssize_t i = 0; i < transfer->count; i++) {
        double sum = source[transfer->source_indices[i]];
        for (Py_ssize_t k = 1; k < transfer->terms; k++)
            sum += source[transfer->source_indices[k * transfer->count + i]];
        Py_ssize_t to = transfer->target_indices ? transfer->target_indices[i] : i;
        if (transfer->target_kind == 'd') ((double *)transfer->target)[to] = sum;
        else ((float *)transfer->target)[to] = (float)sum;
    }
}

/* Inputs that change linearly within the next step. The slopes are those of the outputs since the
   last transfer, whose values are in `ring`. `interpolates`: the outputs already have their values
   of the end of the step. */
static void run_linear_transfer(Transfer *transfer) {
    const double *source = (const double *)transfer->source, *factor = transfer->factor;
    double *target = (double *)transfer->target, *before = (double *)transfer->ring;
    for (Py_ssize_t i = 0; i < transfer->count; i++) {
        double now = source[transfer->source_indices[i]],
               value = transfer->interpolates ? before[i] : now;
        double slope = (now - before[i]) / transfer->step_size;
        target[transfer->target_indices[i]] =
            factor ? factor[i] * value + transfer->offset[i] : value;
        target[transfer->slope_indices[i]] = factor ? factor[i] * slope : slope;
        before[i] = now;
    }
}

static void run_transfer(Transfer *transfer) {
    if (transfer->slope_indices) {
        run_linear_transfer(transfer);
        return;
    }
    if (transfer->terms) {
        add_terms(transfer);
        return;
    }
    if (!transfer->delay) {
        convert_values(transfer, transfer->target, transfer->target_indices, transfer->source,
                       transfer->source_indices);
        return;
    }
    Py_ssize_t size = item_size(transfer->source_kind);
    char *oldest = transfer->ring + transfer->oldest * transfer->count * size;
    convert_values(transfer, transfer->target, transfer->target_indices, oldest, NULL);
    const Py_ssize_t *indices = transfer->source_indices;
    for (Py_ssize_t i = 0; i < transfer->count; i++)
        memcpy(oldest + i * size, transfer->source + (indices ? indices[i] : i) * size,
               (size_t)size);
    transfer->oldest = (transfer->oldest + 1) % transfer->delay;
}

/* A number is infinite or NaN if all bits of its exponent are set; one unit more then carries into
   the sign. Four accumulators, because the processor adds four numbers at a time. */
static bool all_finite(const Program *p) {
    const uint64_t exponent = UINT64_C(0x7FF0000000000000), unit = UINT64_C(0x0010000000000000);
    const uint64_t *x = p->doubles, *end = x + p->double_count;
    uint64_t a = 0, b = 0, c = 0, d = 0;
    for (; end - x >= 4; x += 4) {
        a |= (x[0] & exponent) + unit;
        b |= (x[1] & exponent) + unit;
        c |= (x[2] & exponent) + unit;
        d |= (x[3] & exponent) + unit;
    }
    for (; x < end; x++) a |= (*x & exponent) + unit;
    uint32_t singles = 0;
    for (Py_ssize_t i = 0; i < p->single_count; i++)
        singles |= (p->singles[i] & UINT32_C(0x7F800000)) + UINT32_C(0x00800000);
    return !((a | b | c | d) >> 63 | singles >> 31);
}

/* ---- running --------------------------------------------------------------------------------- */

/* Macro steps run without the interpreter lock: FMUs may log from their own threads, and other
   Python threads continue. */
static void acquire_gil(Program *p) { PyEval_RestoreThread(p->thread_state); }
static void release_gil(Program *p) { p->thread_state = PyEval_SaveThread(); }

static inline int is_bad(int64_t status) { return status != 0 && status != WARNING; }

/* Pass a status to `on_status`. Returns -1 with a Python exception set if the run has failed;
   otherwise the step continues. */
static int report_status(Program *p, int call_number, int64_t status) {
    acquire_gil(p);
    PyObject *answer = PyObject_CallFunction(p->on_status, "iL", call_number, (long long)status);
    long end_request = answer ? PyLong_AsLong(answer) : -1;
    if (end_request > p->end_request) p->end_request = end_request;
    Py_XDECREF(answer);
    release_gil(p);
    return end_request < 0 ? -1 : 0;
}

static int64_t monotonic_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static int call_do_step(const Operation *op, double time) {
    DoStepData *data = op->do_step.data;
    if (op->kind == DO_STEP2)
        return ((Fmi2DoStep *)op->function)(op->instance, time, op->do_step.step_size, 1);
    return ((Fmi3DoStep *)op->function)(op->instance, time, op->do_step.step_size, true,
                                        data->flags, data->flags + 1, data->flags + 2,
                                        data->last_successful_time);
}

static int measured_do_step(const Operation *op, double time) {
    DoStepData *data = op->do_step.data;
    if (!data->measurements_left) return call_do_step(op, time);
    int64_t start = monotonic_ns();
    int status = call_do_step(op, time);
    int64_t duration = monotonic_ns() - start;
    if (duration < data->shortest_ns) data->shortest_ns = duration;
    data->measurements_left--;
    return status;
}

/* Returns a status or PYTHON_EXCEPTION. */
static int64_t run_python_call(Program *p, const Operation *op) {
    acquire_gil(p);
    PyObject *result = PyObject_Call(op->python.callable, op->python.arguments, NULL);
    int64_t status = result ? PyLong_AsLongLong(result) : PYTHON_EXCEPTION;
    if (PyErr_Occurred()) status = PYTHON_EXCEPTION;
    Py_XDECREF(result);
    release_gil(p);
    return status;
}

static inline int get_set2(const Operation *op) {
    return ((Fmi2GetSet *)op->function)(op->instance, op->get_set.references,
                                        op->get_set.reference_count, op->get_set.values);
}

static inline int get_set3(const Operation *op) {
    return ((Fmi3GetSet *)op->function)(op->instance, op->get_set.references,
                                        op->get_set.reference_count, op->get_set.values,
                                        op->get_set.value_count);
}

static inline int check_flags(const Operation *op) {
    const bool *flags = op->do_step.data->flags;
    return flags[0] | flags[1] | flags[2] ? DISCARD : 0;
}

static int64_t run_operation(Program *p, const Operation *op, double time) {
    switch (op->kind) {
    case GET_SET2: return get_set2(op);
    case GET_SET3: return get_set3(op);
    case FLAG_CHECK: return check_flags(op);
    case PYTHON_CALL: return run_python_call(p, op);
    default: return measured_do_step(op, time);
    }
}

/* True if sums are rounded to nearest and subnormal numbers are kept. This costs less than reading
   the control register. */
static inline bool rounds_as_usual(const Program *p) {
    return p->smallest + p->smallest > (p->one + p->tiny) - (p->one - p->tiny);
}

/* `on_status` restores the usual mode. */
static int report_float_mode(Program *p, int call_number) {
    return report_status(p, call_number, FLOAT_MODE_CHANGED);
}

/* Run the operations of one step, in order. */
static int run_step(Program *p, Operation *op, const Operation *end, double time) {
    for (; op < end; op++) {
        p->marker[MARKER_CALL] = op->call_number;
        int64_t status = run_operation(p, op, time);
        if (status == PYTHON_EXCEPTION) return -1;
        if (!rounds_as_usual(p) && report_float_mode(p, op->call_number) < 0) return -1;
        if (is_bad(status) && report_status(p, op->call_number, status) < 0) return -1;
    }
    return 0;
}

static int report_bad_status(Program *p, int call_number, int64_t status) {
    if (!rounds_as_usual(p) && report_float_mode(p, call_number) < 0) return -1;
    return report_status(p, call_number, status);
}

/* Like `run_step`, but without a switch per operation, and with one check of the floating-point
   mode per step. */
static inline int run_packed_step2(Program *p, const PackedStep *s, double time) {
    volatile int64_t *marker = p->marker;
    const StepCalls *c = s->calls;
    int status, call = s->first_call;
    if (c->set) {
        marker[MARKER_CALL] = call;
        status = ((Fmi2GetSet *)c->set)(s->instance, c->set_references, c->set_reference_count,
                                        s->set_values);
        if (is_bad(status) && report_bad_status(p, call, status) < 0) return -1;
        call++;
    }
    marker[MARKER_CALL] = call;
    status = ((Fmi2DoStep *)c->do_step)(s->stepped, time, c->step_size, 1);
    if (is_bad(status) && report_bad_status(p, call, status) < 0) return -1;
    marker[MARKER_CALL] = call + 1;
    status = ((Fmi2GetSet *)c->get)(s->instance, c->get_references, c->get_reference_count,
                                    s->get_values);
    if (is_bad(status) && report_bad_status(p, call + 1, status) < 0) return -1;
    return rounds_as_usual(p) ? 0 : report_float_mode(p, call);
}

static inline int run_packed_step3(Program *p, const PackedStep *s, double time) {
    volatile int64_t *marker = p->marker;
    const StepCalls *c = s->calls;
    bool *flags = s->flags;
    marker[MARKER_CALL] = s->first_call;
    int status = ((Fmi3GetSet *)c->set)(s->instance, c->set_references, c->set_reference_count,
                                        s->set_values, c->set_value_count);
    if (is_bad(status) && report_bad_status(p, s->first_call, status) < 0) return -1;
    marker[MARKER_CALL] = s->first_call + 1;
    status = ((Fmi3DoStep *)c->do_step)(s->instance, time, c->step_size, true, flags, flags + 1,
                                        flags + 2, s->last_successful_time);
    if (!is_bad(status) && (flags[0] | flags[1] | flags[2]) &&
        report_bad_status(p, s->first_call + 2, DISCARD) < 0)
        return -1;
    if (is_bad(status) && report_bad_status(p, s->first_call + 1, status) < 0) return -1;
    marker[MARKER_CALL] = s->first_call + 3;
    status = ((Fmi3GetSet *)c->get)(s->instance, c->get_references, c->get_reference_count,
                                    s->get_values, c->get_value_count);
    if (is_bad(status) && report_bad_status(p, s->first_call + 3, status) < 0) return -1;
    return rounds_as_usual(p) ? 0 : report_float_mode(p, s->first_call + 1);
}

static inline void copy_indexed(const Transfer *transfer) {
    uint64_t *target = (uint64_t *)transfer->target;
    const uint64_t *source = (const uint64_t *)transfer->source;
    const Py_ssize_t *indices = transfer->source_indices, count = transfer->count;
    for (Py_ssize_t i = 0; i < count; i++) target[i] = source[indices[i]];
}

static int run_macro_step(Program *p, int64_t n, double time) {
    Operation *op = p->operations, *last = op + p->count;
    while (op < last) {
        switch (op->kind) {
        case BLOCK_COPY: memcpy(op->block.target, op->block.source, op->block.size); op++; continue;
        case INDEXED_COPY: copy_indexed(op++->transfer); continue;
        case TRANSFER: run_transfer(op++->transfer); continue;
        case PACKED_STEPS:
            for (const PackedStep *step = op->packed.first; step < op->packed.end; step++)
                if ((step->calls->fmi_version == 2 ? run_packed_step2(p, step, time)
                                                   : run_packed_step3(p, step, time)) < 0)
                    return -1;
            break;
        default:
            if (n % op->divisor == 0 && run_step(p, op + 1, p->operations + op->end, time) < 0)
                return -1;
        }
        op = p->operations + op->end;
    }
    return 0;
}

static void copy_row_parts(const Program *p) {
    for (Py_ssize_t k = 0; k < p->row_part_count; k++) {
        const RowPart *part = p->row_parts + k;
        char *cells = p->row + part->position;
        if (part->item_size == 8)
            for (Py_ssize_t i = 0; i < part->count; i++)
                ((uint64_t *)cells)[i] = ((const uint64_t *)part->source)[part->indices[i]];
        else
            for (Py_ssize_t i = 0; i < part->count; i++)
                memcpy(cells + i * part->item_size,
                       part->source + part->indices[i] * part->item_size, (size_t)part->item_size);
    }
}

/* Record communication point n. A row begins with its time, which is written last: readers in other
   processes take a row whose time is 0 for one that is not complete. */
static int record_row(Program *p, int64_t n, double time) {
    if (p->record_every != 1 && n % p->record_every) return 0;
    if (p->record) {
        acquire_gil(p);
        PyObject *result = PyObject_CallFunction(p->record, "d", time);
        Py_XDECREF(result);
        release_gil(p);
        return result ? 0 : -1;
    }
    if (p->buffer) memcpy(p->row + sizeof time, p->buffer, (size_t)p->buffer_size);
    else copy_row_parts(p);
    *(volatile double *)p->row = time;
    p->row += p->row_size;
    p->marker[MARKER_ROWS]++;
    if (p->row == p->rows_end && !p->end_request) p->end_request = END_AFTER_STEP;
    return 0;
}

/* Report to `on_status` that the stop conditions may have changed at the recorded point n. */
static double nan_unless_finite(double value, double a, double b) {
    return isfinite(value) || !isfinite(a) || !isfinite(b) ? value : NAN;
}

/* Value of an operation on the topmost value `b` and the one below it, `a`; NaN where Python raises
   an exception. */
static double apply_operation(InstructionKind kind, double a, double b) {
    switch (kind) {
    case ADD: return a + b;
    case SUBTRACT: return a - b;
    case MULTIPLY: return a * b;
    case DIVIDE: return b == 0 ? NAN : a / b;
    case POWER: return nan_unless_finite(pow(a, b), a, b);
    case MIN: return b < a ? b : a;
    case MAX: return b > a ? b : a;
    case LT: return a < b;
    case LE: return a <= b;
    case GT: return a > b;
    case GE: return a >= b;
    case EQ: return a == b;
    case NE: return a != b;
    case NEGATE: return -b;
    case NOT: return !b;
    case ABS: return fabs(b);
    case SQRT: return sqrt(b);
    case EXP: return nan_unless_finite(exp(b), b, 0);
    case LOG: return nan_unless_finite(log(b), b, 0);
    default: return b != 0; /* TRUTH */
    }
}

static bool is_binary(InstructionKind kind) {
    return (kind >= ADD && kind <= POWER) || (kind >= MIN && kind <= NE);
}

static bool is_met(const Condition *condition) {
    double stack[MAX_STACK_DEPTH];
    Py_ssize_t depth = 0;
    for (Py_ssize_t i = 0; i < condition->count; i++) {
        const Instruction *instruction = condition->instructions + i;
        InstructionKind kind = instruction->kind;
        if (kind == PUSH || kind == LOAD) {
            stack[depth++] = kind == PUSH
                                 ? instruction->value
                                 : as_double(instruction->source, instruction->source_kind, 0);
        } else if (kind == AND || kind == OR) {
            bool met = stack[depth - 1] != 0;
            if (met == (kind == OR)) {
                stack[depth - 1] = met;
                i += instruction->skip;
            } else {
                depth--;
            }
        } else {
            bool binary = is_binary(kind);
            double b = stack[depth - 1], a = binary ? stack[depth - 2] : 0;
            depth -= binary;
            stack[depth - 1] = apply_operation(kind, a, b);
        }
        if (depth && isnan(stack[depth - 1])) return false;
    }
    return stack[0] != 0;
}

static int report_changed_conditions(Program *p, int64_t n) {
    if (!p->condition_count || n % p->record_every) return 0;
    bool changed = n >= p->wake_point;
    for (Condition *condition = p->conditions; condition < p->conditions + p->condition_count;
         condition++) {
        int met = is_met(condition);
        changed |= met != condition->met;
        condition->met = met;
    }
    return changed ? report_status(p, -1, CONDITIONS_CHANGED) : 0;
}

/* ---- packing steps, after their durations have been measured --------------------------------- */

/* The operations of a packable step that begins at `op`; an FMI 2.0 FMU without connected inputs
   has no set operation. */
static const Operation *do_step_operation(const Operation *op) {
    return op[1].kind == DO_STEP2 ? op + 1 : op + 2;
}
static const Operation *get_operation(const Operation *op) {
    const Operation *do_step = do_step_operation(op);
    return do_step->kind == DO_STEP2 ? do_step + 1 : do_step + 2;
}

static int is_packable(const Program *p, const Operation *op) {
    Py_ssize_t calls =
        op->kind == STEP_BEGIN && op->divisor == 1 ? op->end - (op - p->operations) - 1 : 0;
    if (calls == 2) return op[1].kind == DO_STEP2 && op[2].kind == GET_SET2;
    if (calls == 3)
        return op[1].kind == GET_SET2 && op[2].kind == DO_STEP2 && op[3].kind == GET_SET2;
    if (calls == 4)
        return op[1].kind == GET_SET3 && op[2].kind == DO_STEP3 && op[4].kind == GET_SET3;
    return 0;
}

static StepCalls step_calls(const Operation *op) {
    const Operation *do_step = do_step_operation(op), *get = get_operation(op);
    StepCalls calls = {
        .do_step = do_step->function,
        .get = get->function,
        .get_references = get->get_set.references,
        .set_references = get->get_set.references, /* not NULL, of count 0 */
        .get_reference_count = get->get_set.reference_count,
        .get_value_count = get->get_set.value_count,
        .step_size = do_step->do_step.step_size,
        .fmi_version = do_step->kind == DO_STEP2 ? 2 : 3,
    };
    if (do_step == op + 1) return calls;
    calls.set = op[1].function;
    calls.set_references = op[1].get_set.references;
    calls.set_reference_count = op[1].get_set.reference_count;
    calls.set_value_count = op[1].get_set.value_count;
    return calls;
}

static bool is_same_list(const uint32_t *a, size_t a_count, const uint32_t *b, size_t b_count) {
    return a_count == b_count && !memcmp(a, b, a_count * sizeof *a);
}

static bool are_same_calls(const StepCalls *a, const StepCalls *b) {
    return a->set == b->set && a->do_step == b->do_step && a->get == b->get &&
           a->step_size == b->step_size && a->set_value_count == b->set_value_count &&
           a->get_value_count == b->get_value_count &&
           is_same_list(a->set_references, a->set_reference_count, b->set_references,
                        b->set_reference_count) &&
           is_same_list(a->get_references, a->get_reference_count, b->get_references,
                        b->get_reference_count);
}

/* Copy value references into the pool and advance it; returns their new address. */
static const uint32_t *append_references(uint32_t **pool, const uint32_t *references,
                                         size_t count) {
    uint32_t *copied = *pool;
    memcpy(copied, references, count * sizeof *copied);
    *pool += count;
    return copied;
}

/* Return the calls of a packable step: the latest ones, `*next - 1`, if they are the same, else new
   ones. */
static const StepCalls *append_step_calls(const Program *p, StepCalls **next, uint32_t **pool,
                                          const Operation *op) {
    StepCalls calls = step_calls(op);
    if (*next > p->step_calls && are_same_calls(*next - 1, &calls)) return *next - 1;
    calls.set_references = append_references(pool, calls.set_references, calls.set_reference_count);
    calls.get_references = append_references(pool, calls.get_references, calls.get_reference_count);
    **next = calls;
    return (*next)++;
}

static PackedStep pack_step(const Operation *op, const StepCalls *calls) {
    const Operation *do_step = do_step_operation(op), *get = get_operation(op);
    PackedStep step = {
        .calls = calls,
        .instance = get->instance,
        .set_values = calls->set ? op[1].get_set.values : NULL,
        .get_values = get->get_set.values,
        .last_successful_time = do_step->do_step.data->last_successful_time,
        .first_call = op[1].call_number,
    };
    if (calls->fmi_version == 2) step.stepped = do_step->instance;
    else step.flags = do_step->do_step.data->flags;
    return step;
}

static int all_steps_measured(const Program *p) {
    for (const Operation *op = p->operations; op < p->operations + p->count; op++)
        if (is_packable(p, op) && do_step_operation(op)->do_step.data->measurements_left) return 0;
    return 1;
}

/* Replace each sequence of packable steps by one PACKED_STEPS operation. */
static int pack_steps(Program *p) {
    Operation *op, *end = p->operations + p->count;
    size_t step_count = 0, reference_count = 0;
    for (op = p->operations; op < end; op++)
        if (is_packable(p, op)) {
            step_count++;
            const StepCalls calls = step_calls(op);
            reference_count += calls.set_reference_count + calls.get_reference_count;
        }
    p->packed_steps = PyMem_Calloc(step_count + 1, sizeof *p->packed_steps);
    p->step_calls = PyMem_Calloc(step_count + 1, sizeof *p->step_calls);
    p->references = PyMem_Calloc(reference_count + 1, sizeof *p->references);
    if (!p->packed_steps || !p->step_calls || !p->references) return PyErr_NoMemory(), -1;
    PackedStep *next = p->packed_steps;
    StepCalls *next_calls = p->step_calls;
    uint32_t *pool = p->references;
    for (op = p->operations; op < end;) {
        Operation *first = op;
        PackedStep *begin = next;
        for (; op < end && is_packable(p, op); op = p->operations + op->end)
            *next++ = pack_step(op, append_step_calls(p, &next_calls, &pool, op));
        if (next > begin) {
            first->kind = PACKED_STEPS;
            first->end = op - p->operations;
            first->packed.first = begin;
            first->packed.end = next;
        } else {
            op++;
        }
    }
    p->is_packed = 1;
    return 0;
}

static int64_t macro_steps_per_signal_check(const Program *p) {
    int64_t duration = OPERATION_DURATION * p->count;
    for (const Operation *op = p->operations; op < p->operations + p->count; op++)
        if (op->kind == DO_STEP2 || op->kind == DO_STEP3)
            duration += op->do_step.data->measurements_left ? SIGNAL_CHECK_INTERVAL
                                                            : op->do_step.data->shortest_ns;
    return 1 + SIGNAL_CHECK_INTERVAL / (duration + 1);
}

static int check_signals(Program *p) {
    acquire_gil(p);
    int interrupted = PyErr_CheckSignals();
    release_gil(p);
    return interrupted;
}

static bool traps_changed(const Program *p) { return sse_control() != p->sse_control; }

/* Run macro steps first, first + 1, ... until the chunk of rows is full. Step `first` begins at
   `next_time`; the communication points n after it are at (origin + n * stride) / denominator.
   These numbers and n * stride are integers that a double represents exactly, so the division is
   the only rounding. */
static int run_macro_steps(Program *p, int64_t first, int64_t count, double next_time,
                           double origin, double stride, double denominator) {
    const int64_t steps_per_check = macro_steps_per_signal_check(p);
    int64_t left = steps_per_check;
    for (int64_t n = first; n < first + count && !p->end_request; n++) {
        double time = next_time;
        /* the division takes its time during the step */
        next_time = (origin + (double)(n + 1) * stride) / denominator;
        *p->current_time = time;
        if (run_macro_step(p, n, time) < 0) return -1;
        if (p->end_request == END_BEFORE_STEP) return 0;
        if ((n + 1) % TRAP_CHECK_INTERVAL == 0 && traps_changed(p) &&
            report_status(p, -1, FLOAT_TRAPS_ENABLED) < 0)
            return -1;
        if (!all_finite(p) && report_status(p, -1, NOT_FINITE) < 0) return -1;
        if (record_row(p, n + 1, next_time) < 0) return -1;
        p->marker[MARKER_STEPS] = n + 1;
        if (report_changed_conditions(p, n + 1) < 0) return -1;
        if (--left < 0) {
            left = steps_per_check;
            if (check_signals(p) < 0) return -1;
        }
    }
    return 0;
}

static PyObject *run(Program *p, PyObject *arguments) {
    long long first, count;
    double time, origin, stride, denominator;
    if (!PyArg_ParseTuple(arguments, "LLdddd", &first, &count, &time, &origin, &stride,
                          &denominator))
        return NULL;
    p->end_request = CONTINUE;
    p->sse_control = sse_control();
    p->x87_control = x87_control();
    if (!p->is_packed && all_steps_measured(p) && pack_steps(p) < 0) return NULL;
    release_gil(p);
    int failed = run_macro_steps(p, first, count, time, origin, stride, denominator);
    if (!failed && (traps_changed(p) || x87_control() != p->x87_control))
        failed = report_status(p, -1, FLOAT_TRAPS_ENABLED);
    acquire_gil(p);
    if (failed) return NULL;
    Py_RETURN_NONE;
}

/* List of (call number, shortest duration in ns) of all doStep operations. */
static PyObject *step_durations(Program *p, PyObject *unused) {
    PyObject *list = PyList_New(0);
    for (const Operation *op = p->operations; list && op < p->operations + p->count; op++) {
        if (op->kind != DO_STEP2 && op->kind != DO_STEP3) continue;
        PyObject *pair =
            Py_BuildValue("iL", op->call_number, (long long)op->do_step.data->shortest_ns);
        if (!pair || PyList_Append(list, pair) < 0) Py_CLEAR(list);
        Py_XDECREF(pair);
    }
    return list;
}

/* ---- adding operations ----------------------------------------------------------------------- */

static void *pointer(unsigned long long address) { return (void *)(uintptr_t)address; }

static Operation *append_operation(Program *p, OperationKind kind, int call_number) {
    if (p->count == p->capacity) {
        Py_ssize_t capacity = p->capacity ? 2 * p->capacity : 64;
        Operation *operations = PyMem_Realloc(p->operations, (size_t)capacity * sizeof *operations);
        if (!operations) return (Operation *)PyErr_NoMemory();
        p->operations = operations;
        p->capacity = capacity;
    }
    Operation *op = p->operations + p->count++;
    memset(op, 0, sizeof *op);
    op->kind = kind;
    op->call_number = call_number;
    return op;
}

static PyObject *add_transfer(Program *p, PyObject *arguments) {
    unsigned long long target, target_indices, source, source_indices, factor, offset, ring;
    int target_kind, source_kind;
    Py_ssize_t count, delay, terms;
    unsigned long long slope_indices;
    int interpolates;
    double step_size;
    if (!PyArg_ParseTuple(arguments, "KCKKCKnKKKnnKpd", &target, &target_kind, &target_indices,
                          &source, &source_kind, &source_indices, &count, &factor, &offset, &ring,
                          &delay, &terms, &slope_indices, &interpolates, &step_size))
        return NULL;
    Operation *op = append_operation(p, TRANSFER, -1);
    if (!op || !(op->transfer = PyMem_Calloc(1, sizeof(Transfer)))) return PyErr_NoMemory();
    *op->transfer = (Transfer){
        .target = pointer(target),
        .source = pointer(source),
        .target_kind = (char)target_kind,
        .source_kind = (char)source_kind,
        .target_indices = pointer(target_indices),
        .source_indices = pointer(source_indices),
        .count = count,
        .factor = pointer(factor),
        .offset = pointer(offset),
        .ring = pointer(ring),
        .delay = delay,
        .terms = terms,
        .slope_indices = pointer(slope_indices),
        .interpolates = interpolates,
        .step_size = step_size,
    };
    bool is_plain = target_kind == source_kind && !target_indices && !factor && !delay && !terms;
    if (is_plain && item_size((char)target_kind) == 8) op->kind = INDEXED_COPY;
    Py_RETURN_NONE;
}

static PyObject *add_block_copy(Program *p, PyObject *arguments) {
    unsigned long long target, source;
    Py_ssize_t size;
    if (!PyArg_ParseTuple(arguments, "KKn", &target, &source, &size)) return NULL;
    Operation *op = append_operation(p, BLOCK_COPY, -1);
    if (!op) return NULL;
    op->block.target = pointer(target);
    op->block.source = pointer(source);
    op->block.size = (size_t)size;
    Py_RETURN_NONE;
}

static PyObject *begin_step(Program *p, PyObject *arguments) {
    long long divisor;
    if (!PyArg_ParseTuple(arguments, "L", &divisor)) return NULL;
    p->step_start = p->count;
    Operation *op = append_operation(p, STEP_BEGIN, -1);
    if (!op) return NULL;
    op->divisor = divisor;
    Py_RETURN_NONE;
}

static PyObject *end_step(Program *p, PyObject *unused) {
    p->operations[p->step_start].end = p->count;
    Py_RETURN_NONE;
}

static PyObject *add_get_set(Program *p, PyObject *arguments) {
    int call_number, fmi_version;
    unsigned long long function, instance, references, values;
    Py_ssize_t reference_count, value_count;
    if (!PyArg_ParseTuple(arguments, "iiKKKnKn", &call_number, &fmi_version, &function, &instance,
                          &references, &reference_count, &values, &value_count))
        return NULL;
    Operation *op = append_operation(p, fmi_version == 2 ? GET_SET2 : GET_SET3, call_number);
    if (!op) return NULL;
    op->function = pointer(function);
    op->instance = pointer(instance);
    op->get_set.references = pointer(references);
    op->get_set.reference_count = (size_t)reference_count;
    op->get_set.values = pointer(values);
    op->get_set.value_count = (size_t)value_count;
    Py_RETURN_NONE;
}

static PyObject *append_do_step(Program *p, PyObject *arguments, OperationKind kind) {
    int call_number;
    unsigned long long function, instance, flags, last_successful_time;
    double step_size;
    if (!PyArg_ParseTuple(arguments, "iKKdKK", &call_number, &function, &instance, &step_size,
                          &flags, &last_successful_time))
        return NULL;
    Operation *op = append_operation(p, kind, call_number);
    if (!op || !(op->do_step.data = PyMem_Calloc(1, sizeof(DoStepData)))) return PyErr_NoMemory();
    op->function = pointer(function);
    op->instance = pointer(instance);
    op->do_step.step_size = step_size;
    *op->do_step.data =
        (DoStepData){pointer(flags), pointer(last_successful_time), INT64_MAX, MEASURED_STEPS};
    Py_RETURN_NONE;
}

static PyObject *add_do_step2(Program *p, PyObject *arguments) {
    return append_do_step(p, arguments, DO_STEP2);
}
static PyObject *add_do_step3(Program *p, PyObject *arguments) {
    return append_do_step(p, arguments, DO_STEP3);
}
static PyObject *add_flag_check(Program *p, PyObject *arguments) {
    return append_do_step(p, arguments, FLAG_CHECK);
}

static PyObject *add_python_call(Program *p, PyObject *arguments) {
    int call_number;
    PyObject *callable, *argument_tuple;
    if (!PyArg_ParseTuple(arguments, "iOO!", &call_number, &callable, &PyTuple_Type,
                          &argument_tuple))
        return NULL;
    Operation *op = append_operation(p, PYTHON_CALL, call_number);
    if (!op) return NULL;
    op->python.callable = Py_NewRef(callable);
    op->python.arguments = Py_NewRef(argument_tuple);
    Py_RETURN_NONE;
}

static PyObject *set_monitored_floats(Program *p, PyObject *arguments) {
    unsigned long long doubles, singles;
    if (!PyArg_ParseTuple(arguments, "KnKn", &doubles, &p->double_count, &singles,
                          &p->single_count))
        return NULL;
    p->doubles = pointer(doubles);
    p->singles = pointer(singles);
    Py_RETURN_NONE;
}

/* After its time, a row is a copy of the whole buffer if buffer_size > 0, else the row parts. A
   callable `record` replaces both. */
static PyObject *set_recording(Program *p, PyObject *arguments) {
    unsigned long long buffer;
    PyObject *record;
    if (!PyArg_ParseTuple(arguments, "nnKnO", &p->record_every, &p->row_size, &buffer,
                          &p->buffer_size, &record))
        return NULL;
    p->buffer = p->buffer_size ? pointer(buffer) : NULL;
    Py_CLEAR(p->record);
    if (record != Py_None) p->record = Py_NewRef(record);
    Py_RETURN_NONE;
}

static PyObject *add_row_part(Program *p, PyObject *arguments) {
    unsigned long long source, indices;
    RowPart part;
    if (!PyArg_ParseTuple(arguments, "KKnnn", &source, &indices, &part.count, &part.item_size,
                          &part.position))
        return NULL;
    part.source = pointer(source);
    part.indices = pointer(indices);
    RowPart *row_parts = PyMem_Realloc(p->row_parts, (size_t)(p->row_part_count + 1) * sizeof part);
    if (!row_parts) return PyErr_NoMemory();
    p->row_parts = row_parts;
    p->row_parts[p->row_part_count++] = part;
    Py_RETURN_NONE;
}

static PyObject *begin_condition(Program *p, PyObject *unused) {
    Condition *conditions =
        PyMem_Realloc(p->conditions, (size_t)(p->condition_count + 1) * sizeof *conditions);
    if (!conditions) return PyErr_NoMemory();
    p->conditions = conditions;
    p->conditions[p->condition_count++] = (Condition){.met = -1};
    Py_RETURN_NONE;
}

static PyObject *add_instruction(Program *p, PyObject *arguments) {
    unsigned long long source;
    int kind, source_kind;
    Instruction instruction = {0};
    if (!PyArg_ParseTuple(arguments, "idKCn", &kind, &instruction.value, &source, &source_kind,
                          &instruction.skip))
        return NULL;
    instruction.kind = (InstructionKind)kind;
    instruction.source = pointer(source);
    instruction.source_kind = (char)source_kind;
    Condition *condition = p->conditions + p->condition_count - 1;
    bool removes = is_binary(instruction.kind) || instruction.kind == AND || instruction.kind == OR;
    condition->depth += (instruction.kind == PUSH || instruction.kind == LOAD) - removes;
    if (condition->depth > MAX_STACK_DEPTH)
        return PyErr_SetString(PyExc_ValueError, "the condition is nested too deeply"), NULL;
    Instruction *instructions = PyMem_Realloc(
        condition->instructions, (size_t)(condition->count + 1) * sizeof *instructions);
    if (!instructions) return PyErr_NoMemory();
    condition->instructions = instructions;
    condition->instructions[condition->count++] = instruction;
    Py_RETURN_NONE;
}

static PyObject *set_wake_point(Program *p, PyObject *arguments) {
    long long point;
    if (!PyArg_ParseTuple(arguments, "L", &point)) return NULL;
    p->wake_point = point;
    Py_RETURN_NONE;
}

static PyObject *set_rows(Program *p, PyObject *arguments) {
    unsigned long long row;
    Py_ssize_t count;
    if (!PyArg_ParseTuple(arguments, "Kn", &row, &count)) return NULL;
    p->row = pointer(row);
    p->rows_end = p->row + count * p->row_size;
    Py_RETURN_NONE;
}

/* ---- the type -------------------------------------------------------------------------------- */

static int initialize(Program *p, PyObject *arguments, PyObject *named) {
    unsigned long long current_time, marker;
    PyObject *on_status;
    if (!PyArg_ParseTuple(arguments, "KKO", &current_time, &marker, &on_status)) return -1;
    p->current_time = pointer(current_time);
    p->marker = pointer(marker);
    p->on_status = Py_NewRef(on_status);
    p->record_every = 1;
    p->one = 1;
    p->tiny = 0x1p-54;
    p->smallest = 0x1p-1074;
    return 0;
}

static void free_operation(Operation *op) {
    switch (op->kind) {
    case INDEXED_COPY: case TRANSFER: PyMem_Free(op->transfer); break;
    case DO_STEP2: case DO_STEP3: case FLAG_CHECK: PyMem_Free(op->do_step.data); break;
    case PYTHON_CALL:
        Py_CLEAR(op->python.callable);
        Py_CLEAR(op->python.arguments);
        break;
    default: break;
    }
}

static int clear(Program *p) {
    Py_ssize_t count = p->count;
    p->count = 0;
    for (Py_ssize_t i = 0; i < count; i++) free_operation(p->operations + i);
    Py_CLEAR(p->on_status);
    Py_CLEAR(p->record);
    return 0;
}

static int traverse(Program *p, visitproc visit, void *arg) {
    Py_VISIT(Py_TYPE((PyObject *)p));
    Py_VISIT(p->on_status);
    Py_VISIT(p->record);
    for (Py_ssize_t i = 0; i < p->count; i++)
        if (p->operations[i].kind == PYTHON_CALL) {
            Py_VISIT(p->operations[i].python.callable);
            Py_VISIT(p->operations[i].python.arguments);
        }
    return 0;
}

static void deallocate(Program *p) {
    PyTypeObject *type = Py_TYPE((PyObject *)p);
    PyObject_GC_UnTrack(p);
    clear(p);
    PyMem_Free(p->operations);
    PyMem_Free(p->row_parts);
    for (Py_ssize_t i = 0; i < p->condition_count; i++) PyMem_Free(p->conditions[i].instructions);
    PyMem_Free(p->conditions);
    PyMem_Free(p->packed_steps);
    PyMem_Free(p->step_calls);
    PyMem_Free(p->references);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(p);
    Py_DECREF(type);
}

static PyMethodDef methods[] = {
    {"add_transfer", (PyCFunction)add_transfer, METH_VARARGS,
     "Add a transfer of output values to inputs."},
    {"add_block_copy", (PyCFunction)add_block_copy, METH_VARARGS,
     "Add a copy of consecutive bytes."},
    {"begin_step", (PyCFunction)begin_step, METH_VARARGS,
     "Begin a component's step, which runs in every `divisor`-th macro step."},
    {"end_step", (PyCFunction)end_step, METH_NOARGS,
     "End the component's step that `begin_step` began."},
    {"add_get_set", (PyCFunction)add_get_set, METH_VARARGS,
     "Add one call of an FMI get or set function."},
    {"add_do_step2", (PyCFunction)add_do_step2, METH_VARARGS, "Add one call of fmi2DoStep."},
    {"add_do_step3", (PyCFunction)add_do_step3, METH_VARARGS, "Add one call of fmi3DoStep."},
    {"add_flag_check", (PyCFunction)add_flag_check, METH_VARARGS,
     "Add a check of the flags that fmi3DoStep sets; its status is discard if one is set."},
    {"add_python_call", (PyCFunction)add_python_call, METH_VARARGS,
     "Add one call of a Python function that returns a status."},
    {"set_monitored_floats", (PyCFunction)set_monitored_floats, METH_VARARGS,
     "Set the floats that are checked for finiteness after each macro step."},
    {"set_recording", (PyCFunction)set_recording, METH_VARARGS,
     "Set the recording interval (macro steps) and the content of a row."},
    {"add_row_part", (PyCFunction)add_row_part, METH_VARARGS,
     "Add indexed values of one type to each row."},
    {"begin_condition", (PyCFunction)begin_condition, METH_NOARGS, "Begin a stop condition."},
    {"add_instruction", (PyCFunction)add_instruction, METH_VARARGS,
     "Add an instruction of the stop condition."},
    {"set_wake_point", (PyCFunction)set_wake_point, METH_VARARGS,
     "Set the point from which on changed conditions are reported even without a change."},
    {"set_rows", (PyCFunction)set_rows, METH_VARARGS,
     "Set the address of the next row, and the number of rows that fit there."},
    {"step_durations", (PyCFunction)step_durations, METH_NOARGS,
     "Return (call number, shortest duration in ns) of all doStep calls."},
    {"run", (PyCFunction)run, METH_VARARGS,
     "Run `count` macro steps from `first`, at `time`; later points n are at (origin + n * stride) "
     "/ denominator (s)."},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot slots[] = {
    {Py_tp_init, initialize},
    {Py_tp_dealloc, deallocate},
    {Py_tp_traverse, traverse},
    {Py_tp_clear, clear},
    {Py_tp_methods, methods},
    {Py_tp_doc, "The operations of a plan in execution order."},
    {0, NULL},
};

static PyType_Spec specification = {
    "cosim.engine._native.Program",          sizeof(Program), 0,
    Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC, slots,
};

static struct PyModuleDef module = {
    .m_base = PyModuleDef_HEAD_INIT,
    .m_name = "_native",
    .m_doc = "The native executor.",
};

static const struct {
    const char *name;
    int64_t value;
} constants[] = {
    {"INTERFACE", INTERFACE},
    {"FLOAT_MODE_CHANGED", FLOAT_MODE_CHANGED},
    {"FLOAT_TRAPS_ENABLED", FLOAT_TRAPS_ENABLED},
    {"NOT_FINITE", NOT_FINITE},
    {"CONDITIONS_CHANGED", CONDITIONS_CHANGED},
    {"CONTINUE", CONTINUE},
    {"END_AFTER_STEP", END_AFTER_STEP},
    {"END_BEFORE_STEP", END_BEFORE_STEP},
    {"MARKER_CALL", MARKER_CALL},
    {"MARKER_STEPS", MARKER_STEPS},
    {"MARKER_ROWS", MARKER_ROWS},
    {"MEASURED_STEPS", MEASURED_STEPS},
    {"PUSH", PUSH},
    {"LOAD", LOAD},
    {"ADD", ADD},
    {"SUBTRACT", SUBTRACT},
    {"MULTIPLY", MULTIPLY},
    {"DIVIDE", DIVIDE},
    {"POWER", POWER},
    {"NEGATE", NEGATE},
    {"NOT", NOT},
    {"ABS", ABS},
    {"SQRT", SQRT},
    {"EXP", EXP},
    {"LOG", LOG},
    {"MIN", MIN},
    {"MAX", MAX},
    {"LT", LT},
    {"LE", LE},
    {"GT", GT},
    {"GE", GE},
    {"EQ", EQ},
    {"NE", NE},
    {"AND", AND},
    {"OR", OR},
    {"TRUTH", TRUTH},
};

static int add_object(PyObject *self, const char *name, PyObject *object) {
    /* fails with the pending exception if `object` is NULL */
    int failed = PyModule_AddObjectRef(self, name, object);
    Py_XDECREF(object);
    return failed;
}

PyMODINIT_FUNC PyInit__native(void) {
    PyObject *self = PyModule_Create(&module);
    int failed = !self || add_object(self, "Program", PyType_FromSpec(&specification)) < 0;
    for (size_t i = 0; !failed && i < sizeof constants / sizeof *constants; i++)
        failed = add_object(self, constants[i].name, PyLong_FromLongLong(constants[i].value)) < 0;
    if (failed) Py_CLEAR(self);
    return self;
}
