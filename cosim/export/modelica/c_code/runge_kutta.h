/* Integration of continuous states: the classical Runge-Kutta method of order 4 in equal steps of
   at most 5 ms. */
#ifndef RUNGE_KUTTA_H
#define RUNGE_KUTTA_H

#include "runtime.h"

#define LONGEST_STEP 0.005

/* Pointers to the states of a model and to their derivatives, and the function that computes the
   derivatives. */
typedef struct {
    double *x[STATES];
    const double *dx[STATES];
    void (*derivatives)(Model *m, double time);
} System;

static inline void runge_kutta(Model *m, const System *s, double time, double h)
{
    const double part[] = {h / 2, h / 2, h}, weight[] = {1, 2, 2, 1};
    double start[STATES], sum[STATES];
    for (int k = 0; k < STATES; k++) {
        start[k] = *s->x[k];
        sum[k] = 0;
    }
    for (int stage = 0; stage < 4; stage++) {
        s->derivatives(m, stage == 0 ? time : time + part[stage - 1]);
        for (int k = 0; k < STATES; k++) {
            const double slope = *s->dx[k];
            sum[k] += weight[stage] * slope;
            *s->x[k] = start[k] + (stage < 3 ? part[stage] * slope : h / 6 * sum[k]);
        }
    }
}

/* Integrates to the time `to` if it is later than `from`; returns the time of the states. */
static inline double integrate(Model *m, const System *s, double from, double to)
{
    const double count = ceil((to - from) / LONGEST_STEP - 1e-9);
    if (!(count > 0)) return from;
    const double h = (to - from) / count;
    for (double k = 0; k < count && m->failure == 0; k++) runge_kutta(m, s, from + k * h, h);
    return to;
}

#endif
