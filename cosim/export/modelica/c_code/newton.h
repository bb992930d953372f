/* Solution of systems of equations by Newton's method. */
#ifndef NEWTON_H
#define NEWTON_H

#include "runtime.h"

enum { NEWTON_ITERATIONS = 50 };

/* Solves a linear system by elimination with row pivoting; the solution replaces b. Returns false if the matrix is singular. */
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

/* Executes one iteration; returns true if it is the last one: the change is small, or the iteration has failed. */
static inline bool newton(Model *m, int n, double *const *unknown, double *residual, double *jacobian, int iteration, int32_t reason)
{
    if (!eliminate(n, jacobian, residual)) {
        fail(m, reason);
        return true;
    }
    double largest = 0;
    for (int k = 0; k < n; k++) {
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
