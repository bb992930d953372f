/* Runtime functions of compiled Modelica models: Integer arithmetic with overflow checks, and
   clocks. */
#ifndef RUNTIME_H
#define RUNTIME_H

#include "model.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

enum {
    OVERFLOW_OF_INTEGER = 1,
    DIVISION_BY_ZERO = 2,
    PERIOD_NOT_POSITIVE = 3,
    STEP_SIZE_TOO_SMALL = 4,
    COMPOSED_REASON = 0x7fffffff
};

/* Records a failure; the first one is reported. */
static inline void fail(Model *m, int32_t reason)
{
    if (m->failure == 0) m->failure = reason;
}

/* The C index (from 0) for subscript k (from 1) of an array with n elements; 0 after a failure. */
static inline int32_t element(Model *m, int32_t k, int32_t n, int32_t reason)
{
    if (k >= 1 && k <= n) return k - 1;
    fail(m, reason);
    return 0;
}

static inline int32_t integer(Model *m, int64_t value)
{
    if (value >= INT32_MIN && value <= INT32_MAX) return (int32_t)value;
    fail(m, OVERFLOW_OF_INTEGER);
    return 0;
}

static inline int32_t add(Model *m, int32_t a, int32_t b) { return integer(m, (int64_t)a + b); }
static inline int32_t subtract(Model *m, int32_t a, int32_t b)
{
    return integer(m, (int64_t)a - b);
}
static inline int32_t multiply(Model *m, int32_t a, int32_t b)
{
    return integer(m, (int64_t)a * b);
}
static inline int32_t absolute(Model *m, int32_t a) { return a < 0 ? subtract(m, 0, a) : a; }

/* div(a, b): the quotient, rounded toward zero. */
static inline int32_t divide(Model *m, int32_t a, int32_t b)
{
    if (b != 0) return integer(m, (int64_t)a / b);
    fail(m, DIVISION_BY_ZERO);
    return 0;
}

/* rem(a, b) has the sign of a, mod(a, b) that of b. */
static inline int32_t remainder_of(Model *m, int32_t a, int32_t b)
{
    return b == -1 ? 0 : a - b * divide(m, a, b);
}
static inline int32_t modulo(Model *m, int32_t a, int32_t b)
{
    const int32_t r = remainder_of(m, a, b);
    return r != 0 && (r < 0) != (b < 0) ? r + b : r;
}

/* integer(x): the largest Integer not above x. */
static inline int32_t integer_of(Model *m, double x)
{
    const double whole = floor(x);
    if (whole >= INT32_MIN && whole <= INT32_MAX) return (int32_t)whole;
    fail(m, OVERFLOW_OF_INTEGER);
    return 0;
}

static inline double square(double x) { return x * x; }
static inline double smaller(double a, double b) { return a < b ? a : b; }
static inline double larger(double a, double b) { return a > b ? a : b; }
static inline int32_t smaller_integer(int32_t a, int32_t b) { return a < b ? a : b; }
static inline int32_t larger_integer(int32_t a, int32_t b) { return a > b ? a : b; }
static inline int32_t sign(double x) { return (x > 0) - (x < 0); }
static inline double real_quotient(double a, double b) { return trunc(a / b); }
static inline double real_remainder(double a, double b) { return a - trunc(a / b) * b; }
static inline double real_modulo(double a, double b) { return a - floor(a / b) * b; }

/* Tolerance for comparing the times of ticks and communication points, as a fraction of the
   period. */
#define TOLERANCE 1e-6

static inline double next_tick(const Clock *c) { return c->start + (double)c->ticks * c->period; }

/* Initializes a clock: ticks before the start time of the simulation are skipped. */
static inline void set_clock(Model *m, Clock *c, double start, double period, double time)
{
    const double passed = ceil((time - start) / period - TOLERANCE);
    if (!(period > 0)) fail(m, PERIOD_NOT_POSITIVE);
    *c = (Clock){start, period, passed > 0 ? (int64_t)passed : 0};
}

static inline double shortest_period(const Clock *clocks, int count)
{
    double period = clocks[0].period;
    for (int k = 1; k < count; k++) period = smaller(clocks[k].period, period);
    return period;
}

/* Returns the time of the next event; due[k] is true if clock k ticks in it. */
static inline double next_event(const Clock *clocks, int count, bool *due)
{
    double now = next_tick(&clocks[0]);
    for (int k = 1; k < count; k++) now = smaller(next_tick(&clocks[k]), now);
    for (int k = 0; k < count; k++)
        due[k] = next_tick(&clocks[k]) <= now + TOLERANCE * clocks[k].period;
    return now;
}

#endif
