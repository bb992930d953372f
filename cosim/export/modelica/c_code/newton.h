/* Solution of systems of equations by Newton's method. */
#ifndef NEWTON_H
#define NEWTON_H

#include "runtime.h"

enum { NEWTON_ITERATIONS = 100 };

/* Smallest fraction of a step, and residual relative to its largest terms that is rounding. */
static const double SMALLEST_FRACTION = 1e-6, RESIDUAL_ROUNDING = 1e-13;

/* State of an iteration: applied fraction of the last step, and scaled residual in front of it. */
typedef struct {
    double fraction, merit;
} NewtonSearch;

/* Solves a linear system by elimination with row pivoting; the solution replaces b. Returns false
   if the matrix is singular. */
static inline bool eliminate(int n, double *a, double *b)
{
    for (int column = 0; column < n; column++) {
        int pivot = column;
        for (int row = column + 1; row < n; row++)
            if (fabs(a[row * n + column]) > fabs(a[pivot * n + column])) pivot = row;
        if (!(fabs(a[pivot * n + column]) > 0)) return false;
        for (int k = 0; k < n; k++) {
            const double value = a[column * n + k];
            a[column * n + k] = a[pivot * n + k];
            a[pivot * n + k] = value;
        }
        const double value = b[column];
        b[column] = b[pivot];
        b[pivot] = value;
        for (int row = column + 1; row < n; row++) {
            const double factor = a[row * n + column] / a[column * n + column];
            for (int k = column; k < n; k++) a[row * n + k] -= factor * a[column * n + k];
            b[row] -= factor * b[column];
        }
    }
    for (int row = n - 1; row >= 0; row--) {
        for (int k = row + 1; k < n; k++) b[row] -= a[row * n + k] * b[k];
        b[row] /= a[row * n + row];
    }
    return true;
}

/* Returns the largest residual over its scale. */
static inline double largest_ratio(int n, const double *residual, const double *scale)
{
    double largest = 0;
    for (int k = 0; k < n; k++) {
        const double ratio = fabs(residual[k]) / scale[k];
        if (!(ratio <= largest)) largest = ratio;
    }
    return largest;
}

/* Executes one iteration; returns true if it is the last one: the change is small, or the iteration
   has failed. A step that increases the scaled residual is halved. The scale of a residual is the
   sum of its terms |derivative| (1 + |unknown|). */
static inline bool newton(Model *m, int n, double *const *unknown, double *residual,
                          double *jacobian, double *step, double *scale, NewtonSearch *search,
                          int iteration, int32_t reason)
{
    if (iteration) {
        const double merit = largest_ratio(n, residual, scale);
        if (!(merit <= search->merit || merit <= RESIDUAL_ROUNDING)) {
            search->fraction /= 2;
            for (int k = 0; k < n; k++) *unknown[k] += search->fraction * step[k];
            if (search->fraction > SMALLEST_FRACTION && iteration + 1 < NEWTON_ITERATIONS)
                return false;
            fail(m, reason);
            return true;
        }
    }
    for (int row = 0; row < n; row++) {
        scale[row] = 0;
        for (int k = 0; k < n; k++)
            scale[row] += fabs(jacobian[row * n + k]) * (1 + fabs(*unknown[k]));
    }
    search->merit = largest_ratio(n, residual, scale);
    search->fraction = 1;
    if (!eliminate(n, jacobian, residual)) {
        fail(m, reason);
        return true;
    }
    double largest = 0;
    for (int k = 0; k < n; k++) {
        step[k] = residual[k];
        *unknown[k] -= residual[k];
        const double change = fabs(residual[k]) / (1 + fabs(*unknown[k]));
        if (!(change <= largest)) largest = change;
    }
    if (largest <= 1e-11) return true;
    if (isfinite(largest) && iteration + 1 < NEWTON_ITERATIONS) return false;
    fail(m, reason);
    return true;
}

#endif
