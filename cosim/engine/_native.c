/* The native executor: runs macro steps of a plan that was laid out as a list of operations.

   Nothing is looked up or allocated while it runs. Addresses come from cosim/engine/native_executor.py, which also keeps what they
   point to alive. Values, order and rounding are those of the pure Python executor, bit for bit.                            */

#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include <stdbool.h>
#include <stdint.h>
#include <string.h>
#include <time.h>

#if defined(__x86_64__) || defined(_M_X64)
#include <xmmintrin.h>
#define FLOAT_CONTROL 0xFFC0u /* rounding, flush to zero, denormals are zero, traps: all but the sticky flags */
static unsigned float_state(void) { return _mm_getcsr() & FLOAT_CONTROL; }
static void set_float_state(unsigned state) { _mm_setcsr((_mm_getcsr() & ~FLOAT_CONTROL) | state); }
#else
#include <fenv.h>
static unsigned float_state(void) { return (unsigned)fegetround(); }
static void set_float_state(unsigned state) { fesetround((int)state); }
#endif

enum { WARNING = 1, DISCARD = 2 };                      /* FMI statuses; OK is 0, everything else is bad */
enum { AFTER_STEP = 1, WITHOUT_STEP = 2 };              /* the simulation ends with this macro step, or with the one before */
/* what is reported beside FMI statuses, and an exception of Python: no FMU can return these, whatever it returns */
static const int64_t FLOAT_STATE_CHANGED = INT64_C(1) << 33, NOT_FINITE = INT64_C(1) << 34, RAISED = INT64_MIN;
enum { TRIALS = 3 };                                    /* so often the duration of a doStep is measured */
enum { LOOK = 50000000, OPERATION = 20 };               /* ns between two looks for signals; of an operation, about */

/* The C functions of FMI 2.0 and 3.0 that a step calls; values are of any type. */
typedef int Access2(void *instance, const uint32_t *references, size_t count, void *values);
typedef int Access3(void *instance, const uint32_t *references, size_t count, void *values, size_t size);
typedef int Step2(void *instance, double time, double step_size, int no_set_state);
typedef int Step3(void *instance, double time, double step_size, bool no_set_state, bool *event, bool *terminate, bool *early,
                  double *reached);

typedef struct {                /* target[i] = factor[i] * source[i] + offset[i], late by `delay` macro steps */
    char *target, *source;
    char target_kind, source_kind; /* as in Python's struct module */
    const Py_ssize_t *target_indices, *source_indices; /* none: consecutive */
    Py_ssize_t count;
    const double *factor, *offset; /* none: copied */
    char *ring;
    Py_ssize_t delay, oldest;
} Move;

typedef struct {
    bool *flags;                /* event, terminate, early return */
    double *reached;
    int64_t shortest;           /* ns */
    int trials;
} StepMemory;

typedef enum { COPY, MOVE, EVERY, TURNS, ACCESS2, ACCESS3, STEP2, STEP3, FLAGS, PYTHON } Kind;

/* What nearly every turn is, packed: set, doStep, get of one FMU. */
typedef struct {
    void *instance, *set, *step, *get, *set_values, *get_values;
    const uint32_t *set_references, *get_references;
    uint32_t set_count, get_count, set_size, get_size;
    double step_size;
    const StepMemory *memory;
    int version, number;        /* of FMI; of the first call */
} UsualTurn;

typedef struct {
    Kind kind;
    int number;                 /* of the call, for marker and messages */
    Py_ssize_t after;           /* of EVERY and TURNS: first operation after the turns */
    void *function, *instance;
    union {
        struct { const uint32_t *references; size_t count; void *values; size_t size; } access;
        struct { StepMemory *memory; double size; } step;
        Move *move;
        struct { const UsualTurn *first, *end; } turns;
        struct { PyObject *callable, *arguments; } python;
        int64_t divisor;
    };
} Operation;

typedef struct { const char *source; const Py_ssize_t *indices; Py_ssize_t count, width, position; } Piece;

typedef struct {
    PyObject_HEAD
    Operation *operations;
    Py_ssize_t count, capacity, turn; /* turn: where the present turn began while building */
    double *clock;
    volatile int64_t *marker;   /* number of the present call, macro steps finished, rows recorded */
    PyObject *on_status, *record;
    unsigned float_state;
    const uint64_t *doubles;    /* bits of the values that must stay finite */
    const uint32_t *singles;
    Py_ssize_t doubles_count, singles_count;
    const char *block;          /* recorded as a whole, or in pieces */
    Py_ssize_t block_size, every, row_size;
    Piece *pieces;
    Py_ssize_t piece_count;
    char *row;
    UsualTurn *turns;
    uint32_t *references;       /* of the usual turns */
    int packed;
    PyThreadState *thread;      /* while the interpreter lock is released */
    long end;                   /* whether a component asked to end the simulation, and when */
} Program;

/* ---- values ---------------------------------------------------------------------------------------------------------- */

static Py_ssize_t width(char kind) {
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
    default: return (int64_t)as_double(values, kind, i); /* exact: 32 bits or fewer */
    }
}

static void put_integer(char *values, char kind, Py_ssize_t i, int64_t value) {
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

static void copy_one(const Move *m, char *target, const char *source, Py_ssize_t i, Py_ssize_t to, Py_ssize_t from) {
    if (m->target_kind == 'd' || m->target_kind == 'f') {
        double value = as_double(source, m->source_kind, from);
        if (m->factor) value = m->factor[i] * value + m->offset[i];
        if (m->target_kind == 'd') ((double *)target)[to] = value;
        else ((float *)target)[to] = (float)value;
    } else {
        put_integer(target, m->target_kind, to, as_integer(source, m->source_kind, from));
    }
}

static void convert(const Move *m, char *target, const Py_ssize_t *to, const char *source, const Py_ssize_t *from) {
    for (Py_ssize_t i = 0; i < m->count; i++) copy_one(m, target, source, i, to ? to[i] : i, from ? from[i] : i);
}

static void move(Move *m) {
    if (!m->delay) {
        convert(m, m->target, m->target_indices, m->source, m->source_indices);
        return;
    }
    Py_ssize_t size = width(m->source_kind);
    char *oldest = m->ring + m->oldest * m->count * size;
    convert(m, m->target, m->target_indices, oldest, NULL);
    for (Py_ssize_t i = 0; i < m->count; i++)
        memcpy(oldest + i * size, m->source + (m->source_indices ? m->source_indices[i] : i) * size, (size_t)size);
    m->oldest = (m->oldest + 1) % m->delay;
}

static bool all_finite(const Program *p) {
    const uint64_t exponent = UINT64_C(0x7FF0000000000000);
    const uint32_t exponent_single = UINT32_C(0x7F800000);
    uint64_t found = 0;
    for (Py_ssize_t i = 0; i < p->doubles_count; i++) found |= (p->doubles[i] & exponent) == exponent;
    for (Py_ssize_t i = 0; i < p->singles_count; i++) found |= (p->singles[i] & exponent_single) == exponent_single;
    return !found;
}

/* ---- running --------------------------------------------------------------------------------------------------------- */

/* Macro steps run without the interpreter lock: FMUs may take their time, and may call back from threads of their own. */
static void enter_python(Program *p) { PyEval_RestoreThread(p->thread); }
static void leave_python(Program *p) { p->thread = PyEval_SaveThread(); }

static inline int is_bad(int64_t status) { return status != 0 && status != WARNING; }

/* Tell Python; returns -1 with an exception set when the run has failed. Otherwise the turn goes on. */
static int report(Program *p, int number, int64_t status) {
    enter_python(p);
    PyObject *answer = PyObject_CallFunction(p->on_status, "iL", number, (long long)status);
    long end = answer ? PyLong_AsLong(answer) : -1;
    if (end > p->end) p->end = end;
    Py_XDECREF(answer);
    leave_python(p);
    return end < 0 ? -1 : 0;
}

static int64_t nanoseconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000 + t.tv_nsec;
}

static int step_once(const Operation *op, double time) {
    StepMemory *m = op->step.memory;
    if (op->kind == STEP2) return ((Step2 *)op->function)(op->instance, time, op->step.size, 1);
    return ((Step3 *)op->function)(op->instance, time, op->step.size, true, m->flags, m->flags + 1, m->flags + 2, m->reached);
}

static int step(const Operation *op, double time) {
    StepMemory *m = op->step.memory;
    if (!m->trials) return step_once(op, time);
    int64_t began = nanoseconds();
    int status = step_once(op, time);
    int64_t took = nanoseconds() - began;
    if (took < m->shortest) m->shortest = took;
    m->trials--;
    return status;
}

/* Returns a status, or RAISED. */
static int64_t call_python(Program *p, const Operation *op) {
    enter_python(p);
    PyObject *result = PyObject_Call(op->python.callable, op->python.arguments, NULL);
    int64_t status = result ? PyLong_AsLongLong(result) : RAISED;
    if (PyErr_Occurred()) status = RAISED;
    Py_XDECREF(result);
    leave_python(p);
    return status;
}

static inline int access2(const Operation *op) {
    return ((Access2 *)op->function)(op->instance, op->access.references, op->access.count, op->access.values);
}

static inline int access3(const Operation *op) {
    return ((Access3 *)op->function)(op->instance, op->access.references, op->access.count, op->access.values, op->access.size);
}

static inline int look_at(const Operation *op) {
    const bool *flags = op->step.memory->flags;
    return flags[0] | flags[1] | flags[2] ? DISCARD : 0;
}

static int64_t call(Program *p, const Operation *op, double time) {
    switch (op->kind) {
    case ACCESS2: return access2(op);
    case ACCESS3: return access3(op);
    case FLAGS: return look_at(op);
    case PYTHON: return call_python(p, op);
    default: return step(op, time);
    }
}

static int float_state_changed(Program *p, int number) {
    set_float_state(p->float_state);
    return report(p, number, FLOAT_STATE_CHANGED);
}

/* The operations of one turn, one after the other. */
static int turn(Program *p, Operation *op, const Operation *end, double time) {
    for (; op < end; op++) {
        p->marker[0] = op->number;
        int64_t status = call(p, op, time);
        if (status == RAISED) return -1;
        if (float_state() != p->float_state && float_state_changed(p, op->number) < 0) return -1;
        if (is_bad(status) && report(p, op->number, status) < 0) return -1;
    }
    return 0;
}

static int bad(Program *p, int number, int64_t status) {
    if (float_state() != p->float_state && float_state_changed(p, number) < 0) return -1;
    return report(p, number, status);
}

/* As `turn`, without looking at each operation. */
static inline int usual_turn(Program *p, const UsualTurn *t, double time) {
    volatile int64_t *marker = p->marker;
    const int two = t->version == 2;
    marker[0] = t->number;
    int status = two ? ((Access2 *)t->set)(t->instance, t->set_references, t->set_count, t->set_values)
                     : ((Access3 *)t->set)(t->instance, t->set_references, t->set_count, t->set_values, t->set_size);
    if (is_bad(status) && bad(p, t->number, status) < 0) return -1;
    marker[0] = t->number + 1;
    if (two) {
        status = ((Step2 *)t->step)(t->instance, time, t->step_size, 1);
    } else {
        bool *flags = t->memory->flags;
        status = ((Step3 *)t->step)(t->instance, time, t->step_size, true, flags, flags + 1, flags + 2, t->memory->reached);
        if (!is_bad(status) && (flags[0] | flags[1] | flags[2]) && bad(p, t->number + 2, DISCARD) < 0) return -1;
    }
    if (is_bad(status) && bad(p, t->number + 1, status) < 0) return -1;
    const int last = t->number + (two ? 2 : 3);
    marker[0] = last;
    status = two ? ((Access2 *)t->get)(t->instance, t->get_references, t->get_count, t->get_values)
                 : ((Access3 *)t->get)(t->instance, t->get_references, t->get_count, t->get_values, t->get_size);
    if (is_bad(status) && bad(p, last, status) < 0) return -1;
    return float_state() == p->float_state ? 0 : float_state_changed(p, t->number + 1);
}

static inline void copy(const Move *m) {
    uint64_t *target = (uint64_t *)m->target;
    const uint64_t *source = (const uint64_t *)m->source;
    const Py_ssize_t *from = m->source_indices, count = m->count;
    for (Py_ssize_t i = 0; i < count; i++) target[i] = source[from[i]];
}

static int macro_step(Program *p, int64_t n, double time) {
    Operation *op = p->operations, *last = op + p->count;
    while (op < last) {
        switch (op->kind) {
        case COPY: copy(op++->move); continue;
        case MOVE: move(op++->move); continue;
        case TURNS:
            for (const UsualTurn *t = op->turns.first; t < op->turns.end; t++)
                if (usual_turn(p, t, time) < 0) return -1;
            break;
        default:
            if (n % op->divisor == 0 && turn(p, op + 1, p->operations + op->after, time) < 0) return -1;
        }
        op = p->operations + op->after;
    }
    return 0;
}

static void copy_pieces(const Program *p) {
    for (Py_ssize_t k = 0; k < p->piece_count; k++) {
        const Piece *piece = p->pieces + k;
        char *cells = p->row + piece->position;
        if (piece->width == 8)
            for (Py_ssize_t i = 0; i < piece->count; i++)
                ((uint64_t *)cells)[i] = ((const uint64_t *)piece->source)[piece->indices[i]];
        else
            for (Py_ssize_t i = 0; i < piece->count; i++)
                memcpy(cells + i * piece->width, piece->source + piece->indices[i] * piece->width, (size_t)piece->width);
    }
}

static int record(Program *p, int64_t n) {
    if (p->every != 1 && n % p->every) return 0;
    if (p->record) {
        enter_python(p);
        PyObject *result = PyObject_CallFunction(p->record, "L", (long long)n);
        Py_XDECREF(result);
        leave_python(p);
        return result ? 0 : -1;
    }
    if (p->block) memcpy(p->row, p->block, (size_t)p->block_size);
    copy_pieces(p);
    p->row += p->row_size;
    p->marker[2]++;
    return 0;
}

/* ---- packing usual turns, once their steps have been measured -------------------------------------------------------- */

static const Operation *get_of(const Operation *op) { return op[2].kind == STEP2 ? op + 3 : op + 4; }

static int is_usual(const Program *p, const Operation *op) {
    Py_ssize_t calls = op->kind == EVERY && op->divisor == 1 ? op->after - (op - p->operations) - 1 : 0;
    if (calls == 3) return op[1].kind == ACCESS2 && op[2].kind == STEP2 && op[3].kind == ACCESS2;
    if (calls == 4) return op[1].kind == ACCESS3 && op[2].kind == STEP3 && op[4].kind == ACCESS3;
    return 0;
}

static const uint32_t *keep(uint32_t **pool, const Operation *access) {
    uint32_t *place = *pool;
    memcpy(place, access->access.references, access->access.count * sizeof *place);
    *pool += access->access.count;
    return place;
}

static UsualTurn packed(const Operation *op, uint32_t **pool) {
    const Operation *set = op + 1, *step = op + 2, *get = get_of(op);
    return (UsualTurn){
        step->instance, set->function, step->function, get->function, set->access.values, get->access.values,
        keep(pool, set), keep(pool, get), (uint32_t)set->access.count, (uint32_t)get->access.count,
        (uint32_t)set->access.size, (uint32_t)get->access.size, step->step.size, step->step.memory,
        step->kind == STEP2 ? 2 : 3, set->number,
    };
}

static int all_measured(const Program *p) {
    for (const Operation *op = p->operations; op < p->operations + p->count; op++)
        if (is_usual(p, op) && op[2].step.memory->trials) return 0;
    return 1;
}

/* Neighbouring usual turns become one operation. */
static int pack(Program *p) {
    Operation *op, *end = p->operations + p->count;
    size_t turns = 0, references = 0;
    for (op = p->operations; op < end; op++)
        if (is_usual(p, op)) {
            turns++;
            references += op[1].access.count + get_of(op)->access.count;
        }
    p->turns = PyMem_Calloc(turns + 1, sizeof *p->turns);
    p->references = PyMem_Calloc(references + 1, sizeof *p->references);
    if (!p->turns || !p->references) return PyErr_NoMemory(), -1;
    UsualTurn *turn = p->turns;
    uint32_t *pool = p->references;
    for (op = p->operations; op < end;) {
        Operation *first = op;
        UsualTurn *begin = turn;
        for (; op < end && is_usual(p, op); op = p->operations + op->after) *turn++ = packed(op, &pool);
        if (turn > begin) {
            first->kind = TURNS;
            first->after = op - p->operations;
            first->turns.first = begin;
            first->turns.end = turn;
        } else {
            op++;
        }
    }
    p->packed = 1;
    return 0;
}

static int64_t macro_steps_per_look(const Program *p) {
    int64_t duration = OPERATION * p->count;
    for (const Operation *op = p->operations; op < p->operations + p->count; op++)
        if (op->kind == STEP2 || op->kind == STEP3)
            duration += op->step.memory->trials ? LOOK : op->step.memory->shortest;
    return 1 + LOOK / (duration + 1);
}

static int look_for_signals(Program *p) {
    enter_python(p);
    int interrupted = PyErr_CheckSignals();
    leave_python(p);
    return interrupted;
}

static int run_steps(Program *p, int64_t first, int64_t count, double origin, double stride, double denominator) {
    const int64_t per_look = macro_steps_per_look(p);
    int64_t left = per_look;
    for (int64_t n = first; n < first + count && !p->end; n++) {
        double time = (origin + (double)n * stride) / denominator;
        *p->clock = time;
        if (macro_step(p, n, time) < 0) return -1;
        if (p->end == WITHOUT_STEP) return 0;
        if (!all_finite(p) && report(p, -1, NOT_FINITE) < 0) return -1;
        if (record(p, n + 1) < 0) return -1;
        p->marker[1] = n + 1;
        if (--left < 0) {
            left = per_look;
            if (look_for_signals(p) < 0) return -1;
        }
    }
    return 0;
}

/* Macro steps first, first + 1, ... Step n begins at (origin + n * stride) / denominator: rounded once, since the numbers are
   integers that a double holds exactly. */
static PyObject *run(Program *p, PyObject *arguments) {
    long long first, count;
    double origin, stride, denominator;
    if (!PyArg_ParseTuple(arguments, "LLddd", &first, &count, &origin, &stride, &denominator)) return NULL;
    p->end = 0;
    p->float_state = float_state();
    if (!p->packed && all_measured(p) && pack(p) < 0) return NULL;
    leave_python(p);
    int failed = run_steps(p, first, count, origin, stride, denominator);
    enter_python(p);
    if (failed) return NULL;
    Py_RETURN_NONE;
}

/* (number of the call, ns of the shortest so far) of every doStep. */
static PyObject *durations(Program *p, PyObject *unused) {
    PyObject *list = PyList_New(0);
    for (const Operation *op = p->operations; list && op < p->operations + p->count; op++) {
        if (op->kind != STEP2 && op->kind != STEP3) continue;
        PyObject *pair = Py_BuildValue("iL", op->number, (long long)op->step.memory->shortest);
        if (!pair || PyList_Append(list, pair) < 0) Py_CLEAR(list);
        Py_XDECREF(pair);
    }
    return list;
}

/* ---- building -------------------------------------------------------------------------------------------------------- */

static void *pointer(unsigned long long address) { return (void *)(uintptr_t)address; }

static Operation *append(Program *p, Kind kind, int number) {
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
    op->number = number;
    return op;
}

static PyObject *add_move(Program *p, PyObject *arguments) {
    unsigned long long target, to, source, from, factor, offset, ring;
    int target_kind, source_kind;
    Py_ssize_t count, delay;
    if (!PyArg_ParseTuple(arguments, "KCKKCKnKKKn", &target, &target_kind, &to, &source, &source_kind, &from, &count, &factor,
                          &offset, &ring, &delay))
        return NULL;
    Operation *op = append(p, MOVE, -1);
    if (!op || !(op->move = PyMem_Calloc(1, sizeof(Move)))) return PyErr_NoMemory();
    *op->move = (Move){pointer(target), pointer(source), (char)target_kind, (char)source_kind, pointer(to), pointer(from),
                       count, pointer(factor), pointer(offset), pointer(ring), delay, 0};
    if (target_kind == source_kind && width((char)target_kind) == 8 && !to && !factor && !delay) op->kind = COPY;
    Py_RETURN_NONE;
}

static PyObject *begin_turn(Program *p, PyObject *arguments) {
    long long divisor;
    if (!PyArg_ParseTuple(arguments, "L", &divisor)) return NULL;
    p->turn = p->count;
    Operation *op = append(p, EVERY, -1);
    if (!op) return NULL;
    op->divisor = divisor;
    Py_RETURN_NONE;
}

static PyObject *end_turn(Program *p, PyObject *unused) {
    p->operations[p->turn].after = p->count;
    Py_RETURN_NONE;
}

static PyObject *add_access(Program *p, PyObject *arguments) {
    int number, version;
    unsigned long long function, instance, references, values;
    Py_ssize_t count, size;
    if (!PyArg_ParseTuple(arguments, "iiKKKnKn", &number, &version, &function, &instance, &references, &count, &values, &size)) return NULL;
    Operation *op = append(p, version == 2 ? ACCESS2 : ACCESS3, number);
    if (!op) return NULL;
    op->function = pointer(function);
    op->instance = pointer(instance);
    op->access.references = pointer(references);
    op->access.count = (size_t)count;
    op->access.values = pointer(values);
    op->access.size = (size_t)size;
    Py_RETURN_NONE;
}

static PyObject *add_step_like(Program *p, PyObject *arguments, Kind kind) {
    int number;
    unsigned long long function, instance, flags, reached;
    double size;
    if (!PyArg_ParseTuple(arguments, "iKKdKK", &number, &function, &instance, &size, &flags, &reached)) return NULL;
    Operation *op = append(p, kind, number);
    if (!op || !(op->step.memory = PyMem_Calloc(1, sizeof(StepMemory)))) return PyErr_NoMemory();
    op->function = pointer(function);
    op->instance = pointer(instance);
    op->step.size = size;
    *op->step.memory = (StepMemory){pointer(flags), pointer(reached), INT64_MAX, TRIALS};
    Py_RETURN_NONE;
}

static PyObject *add_step2(Program *p, PyObject *arguments) { return add_step_like(p, arguments, STEP2); }
static PyObject *add_step3(Program *p, PyObject *arguments) { return add_step_like(p, arguments, STEP3); }
static PyObject *add_flags(Program *p, PyObject *arguments) { return add_step_like(p, arguments, FLAGS); }

static PyObject *add_python(Program *p, PyObject *arguments) {
    int number;
    PyObject *callable, *positional;
    if (!PyArg_ParseTuple(arguments, "iOO!", &number, &callable, &PyTuple_Type, &positional)) return NULL;
    Operation *op = append(p, PYTHON, number);
    if (!op) return NULL;
    op->python.callable = Py_NewRef(callable);
    op->python.arguments = Py_NewRef(positional);
    Py_RETURN_NONE;
}

static PyObject *set_watched(Program *p, PyObject *arguments) {
    unsigned long long doubles, singles;
    if (!PyArg_ParseTuple(arguments, "KnKn", &doubles, &p->doubles_count, &singles, &p->singles_count)) return NULL;
    p->doubles = pointer(doubles);
    p->singles = pointer(singles);
    Py_RETURN_NONE;
}

/* Rows are the whole block (block_size > 0), or pieces; or Python's `record` does it. */
static PyObject *set_recording(Program *p, PyObject *arguments) {
    unsigned long long block;
    PyObject *record;
    if (!PyArg_ParseTuple(arguments, "nnKnO", &p->every, &p->row_size, &block, &p->block_size, &record)) return NULL;
    p->block = p->block_size ? pointer(block) : NULL;
    Py_CLEAR(p->record);
    if (record != Py_None) p->record = Py_NewRef(record);
    Py_RETURN_NONE;
}

static PyObject *add_piece(Program *p, PyObject *arguments) {
    unsigned long long source, indices;
    Piece piece;
    if (!PyArg_ParseTuple(arguments, "KKnnn", &source, &indices, &piece.count, &piece.width, &piece.position)) return NULL;
    piece.source = pointer(source);
    piece.indices = pointer(indices);
    Piece *pieces = PyMem_Realloc(p->pieces, (size_t)(p->piece_count + 1) * sizeof piece);
    if (!pieces) return PyErr_NoMemory();
    p->pieces = pieces;
    p->pieces[p->piece_count++] = piece;
    Py_RETURN_NONE;
}

static PyObject *set_row(Program *p, PyObject *arguments) {
    unsigned long long row;
    if (!PyArg_ParseTuple(arguments, "K", &row)) return NULL;
    p->row = pointer(row);
    Py_RETURN_NONE;
}

/* ---- the type -------------------------------------------------------------------------------------------------------- */

static int initialize(Program *p, PyObject *arguments, PyObject *named) {
    unsigned long long clock, marker;
    PyObject *on_status;
    if (!PyArg_ParseTuple(arguments, "KKO", &clock, &marker, &on_status)) return -1;
    p->clock = pointer(clock);
    p->marker = pointer(marker);
    p->on_status = Py_NewRef(on_status);
    p->every = 1;
    return 0;
}

static void release(Operation *op) {
    switch (op->kind) {
    case COPY: case MOVE: PyMem_Free(op->move); break;
    case STEP2: case STEP3: case FLAGS: PyMem_Free(op->step.memory); break;
    case PYTHON:
        Py_CLEAR(op->python.callable);
        Py_CLEAR(op->python.arguments);
        break;
    default: break;
    }
}

static int clear(Program *p) {
    Py_ssize_t count = p->count;
    p->count = 0;
    for (Py_ssize_t i = 0; i < count; i++) release(p->operations + i);
    Py_CLEAR(p->on_status);
    Py_CLEAR(p->record);
    return 0;
}

static int traverse(Program *p, visitproc visit, void *arg) {
    Py_VISIT(Py_TYPE((PyObject *)p));
    Py_VISIT(p->on_status);
    Py_VISIT(p->record);
    for (Py_ssize_t i = 0; i < p->count; i++)
        if (p->operations[i].kind == PYTHON) {
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
    PyMem_Free(p->pieces);
    PyMem_Free(p->turns);
    PyMem_Free(p->references);
    ((freefunc)PyType_GetSlot(type, Py_tp_free))(p);
    Py_DECREF(type);
}

static PyMethodDef methods[] = {
    {"add_transfer", (PyCFunction)add_move, METH_VARARGS, "Values go from outputs to inputs."},
    {"begin_step", (PyCFunction)begin_turn, METH_VARARGS, "What follows happens every `divisor` macro steps."},
    {"end_step", (PyCFunction)end_turn, METH_NOARGS, "The component's turn is complete."},
    {"add_get_set", (PyCFunction)add_access, METH_VARARGS, "One get or set of FMI 2.0 or 3.0."},
    {"add_do_step2", (PyCFunction)add_step2, METH_VARARGS, "fmi2DoStep."},
    {"add_do_step3", (PyCFunction)add_step3, METH_VARARGS, "fmi3DoStep."},
    {"add_flag_check", (PyCFunction)add_flags, METH_VARARGS, "Whether fmi3DoStep ended in a special way."},
    {"add_python_call", (PyCFunction)add_python, METH_VARARGS, "A call that returns a status."},
    {"set_monitored_floats", (PyCFunction)set_watched, METH_VARARGS, "Values that must stay finite."},
    {"set_recording", (PyCFunction)set_recording, METH_VARARGS, "What a row is."},
    {"add_row_part", (PyCFunction)add_piece, METH_VARARGS, "One piece of a row."},
    {"set_row_address", (PyCFunction)set_row, METH_VARARGS, "Where the next row goes."},
    {"step_durations", (PyCFunction)durations, METH_NOARGS, "The shortest of every doStep."},
    {"run", (PyCFunction)run, METH_VARARGS, "Macro steps from the times at an address."},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot slots[] = {
    {Py_tp_init, initialize}, {Py_tp_dealloc, deallocate}, {Py_tp_traverse, traverse}, {Py_tp_clear, clear},
    {Py_tp_methods, methods}, {Py_tp_doc, "Operations of a plan, in order."}, {0, NULL},
};

static PyType_Spec specification = {
    "cosim.engine._native.Program", sizeof(Program), 0, Py_TPFLAGS_DEFAULT | Py_TPFLAGS_HAVE_GC, slots,
};

static struct PyModuleDef module = {PyModuleDef_HEAD_INIT, "_native", "The native executor.", 0, NULL, NULL, NULL, NULL, NULL};

PyMODINIT_FUNC PyInit__native(void) {
    PyObject *self = PyModule_Create(&module);
    PyObject *type = PyType_FromSpec(&specification);
    if (!self || !type || PyModule_AddObjectRef(self, "Program", type) < 0) {
        Py_XDECREF(type);
        Py_XDECREF(self);
        return NULL;
    }
    Py_DECREF(type);
    return self;
}
