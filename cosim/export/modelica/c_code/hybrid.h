/* Continuous states with events: integration with error control, location of crossings, and values
   in the past. */
#ifndef HYBRID_H
#define HYBRID_H

#include "runtime.h"

#include <float.h>

/* Pointers to the states of a model and to their derivatives. */
typedef struct {
    double *x[STATES];
    const double *dx[STATES];
} Hybrid;

/* Functions of the model. `crossed` returns the number, from 1, of a relation that differs from its
   stored value, or 0; z is positive on one side of each relation. `record` stores the present
   values of the arguments of delay(). */
static void derivatives(Model *m, double time);
static int crossed(Model *m, double time, double *z);
static void record(Model *m, double time);

enum { STAGES = 7 };

/* The error below which the step size grows by the factor 5, the largest one: (0.9/5)^5. */
#define LARGEST_GROWTH_BELOW 0.0001889568

/* One stage of the method of Dormand and Prince of order 5, whose last stage is the first one of
   the next step. */
#define STAGE(NUMBER, NODE, SLOPE) \
    for (int i = 0; i < STATES; i++) *s->x[i] = start[i] + h * (SLOPE); \
    derivatives(m, time + (NODE) * h); \
    for (int i = 0; i < STATES; i++) k[NUMBER][i] = *s->dx[i];

/* Advances the states from `start` with the slopes k[0] by h; returns the estimated error as a
   multiple of the tolerance. */
static inline double dormand_prince(Model *m, const Hybrid *s, double time, double h,
                                    const double *start, double k[STAGES][STATES])
{
    STAGE(1, 1.0 / 5, 1.0 / 5 * k[0][i])
    STAGE(2, 3.0 / 10, 3.0 / 40 * k[0][i] + 9.0 / 40 * k[1][i])
    STAGE(3, 4.0 / 5, 44.0 / 45 * k[0][i] + -56.0 / 15 * k[1][i] + 32.0 / 9 * k[2][i])
    STAGE(4, 8.0 / 9,
          19372.0 / 6561 * k[0][i] + -25360.0 / 2187 * k[1][i] + 64448.0 / 6561 * k[2][i] +
              -212.0 / 729 * k[3][i])
    STAGE(5, 1,
          9017.0 / 3168 * k[0][i] + -355.0 / 33 * k[1][i] + 46732.0 / 5247 * k[2][i] +
              49.0 / 176 * k[3][i] + -5103.0 / 18656 * k[4][i])
    STAGE(6, 1,
          35.0 / 384 * k[0][i] + 500.0 / 1113 * k[2][i] + 125.0 / 192 * k[3][i] +
              -2187.0 / 6784 * k[4][i] + 11.0 / 84 * k[5][i])
    double largest = 0;
    for (int i = 0; i < STATES; i++) {
        const double error = 71.0 / 57600 * k[0][i] + -71.0 / 16695 * k[2][i] +
                             71.0 / 1920 * k[3][i] + -17253.0 / 339200 * k[4][i] +
                             22.0 / 525 * k[5][i] + -1.0 / 40 * k[6][i];
        const double scale =
            ABSOLUTE_TOLERANCE + RELATIVE_TOLERANCE * larger(fabs(start[i]), fabs(*s->x[i]));
        const double ratio = fabs(h * error) / scale;
        if (!(ratio <= largest)) largest = ratio;
    }
    return largest;
}

static inline void set_states(const Hybrid *s, const double *values)
{
    for (int i = 0; i < STATES; i++) *s->x[i] = values[i];
}

/* Searches in (0, h] for the first time after which a relation has changed; leaves the states there
   and returns the time. */
static inline double locate(Model *m, const Hybrid *s, double time, double h, const double *start,
                            double k[STAGES][STATES])
{
    const double width = larger(1e-10, 8 * DBL_EPSILON * fabs(time + h));
    double left = 0, right = h, z[2][RELATIONS];
    crossed(m, time + h, z[1]);
    set_states(s, start);
    derivatives(m, time);
    crossed(m, time, z[0]);
    for (int n = 0, side = 1; right - left > width && n < 100; n++) {
        double at = right;
        for (int r = 0; r < RELATIONS; r++) {
            const double root = left + (right - left) * (z[0][r] / (z[0][r] - z[1][r]));
            if (root > left && root < at) at = root;
        }
        at = n % 3 == 2 ? left + (right - left) / 2 : at + (side == 0 ? width : -width) / 2;
        at = smaller(larger(at, left + width / 4), right - width / 4);
        double trial[RELATIONS];
        dormand_prince(m, s, time, at, start, k);
        side = crossed(m, time + at, trial) != 0;
        memcpy(z[side], trial, sizeof trial);
        if (side == 1) right = at;
        else left = at;
    }
    dormand_prince(m, s, time, right, start, k);
    return time + right;
}

/* Integrates from `from` to `to` or to the first event; returns the time reached. The event before
   has computed the derivatives. */
static inline double advance_hybrid(Model *m, const Hybrid *s, double from, double to, bool *event)
{
    double time = from, start[STATES], k[STAGES][STATES], z[RELATIONS];
    *event = false;
    for (int i = 0; i < STATES; i++) k[0][i] = *s->dx[i];
    if (!(m->step > 0)) m->step = to - from;
    while (time < to && m->failure == 0) {
        const bool last = !(m->step < to - time);
        const double h = last ? to - time : m->step;
        for (int i = 0; i < STATES; i++) start[i] = *s->x[i];
        const double error = dormand_prince(m, s, time, h, start, k);
        if (!(error <= 1)) {
            const double factor = 0.9 * pow(error, -0.2);
            set_states(s, start);
            m->step = h * (factor > 0.2 ? factor : 0.2);
            if (!(time + m->step > time)) fail(m, STEP_SIZE_TOO_SMALL);
            continue;
        }
        if (crossed(m, time + h, z)) {
            *event = true;
            time = locate(m, s, time, h, start, k);
            record(m, time);
            return time;
        }
        if (!last || m->step < 5 * h) {
            const double next =
                h * (error > LARGEST_GROWTH_BELOW ? smaller(0.9 * pow(error, -0.2), 5) : 5);
            m->step = last ? larger(m->step, next) : next;
        }
        time = last ? to : time + h;
        record(m, time);
        memcpy(k[0], k[STAGES - 1], sizeof k[0]);
    }
    return time;
}

#endif
