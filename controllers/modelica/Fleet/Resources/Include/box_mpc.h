/* Model predictive control of one axis: condensed quadratic program with box constraints, solved by
   a primal active-set method.

   States: errors of position and velocity (reference minus actual value), and acceleration minus
   its reference, which follows the input with a first-order lag. The program is
       minimise  sum_k  qp ep(k)^2 + qv ev(k)^2 + r u(k)^2
       subject to  lower(k) <= u(k) <= upper(k)
   J. Nocedal, S. J. Wright: Numerical optimization (2006), sections 16.5 (active set) and 16.7
   (bounds). */

#include <math.h>
#include <string.h>

#define BOX_MPC_STEPS 20

/* Moves the errors by one step of h under a constant command u: exact solution of e' = v, v' = -a,
   a' = (u - a)/lag. */
static void box_mpc_move(double h, double lag, double u, double state[3])
{
    double decay = exp(-h / lag), rest = state[2] - u;
    double speed_change = u * h + rest * lag * (1 - decay);
    state[0] += state[1] * h - u * h * h / 2 - rest * lag * (h - lag * (1 - decay));
    state[1] -= speed_change;
    state[2] = u + rest * decay;
}

/* Factors the rows and columns `free` of H by Cholesky and solves H_ff x_f = b_f; other elements of
   x are untouched. */
static void box_mpc_solve(double H[BOX_MPC_STEPS][BOX_MPC_STEPS], const int *list, int count,
                          const double *b, double *x)
{
    static const double smallest = 1e-300;
    double L[BOX_MPC_STEPS][BOX_MPC_STEPS], y[BOX_MPC_STEPS];
    for (int i = 0; i < count; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = H[list[i]][list[j]];
            for (int k = 0; k < j; k++) sum -= L[i][k] * L[j][k];
            L[i][j] = i == j ? sqrt(fmax(sum, smallest)) : sum / L[j][j];
        }
        double sum = b[list[i]];
        for (int k = 0; k < i; k++) sum -= L[i][k] * y[k];
        y[i] = sum / L[i][i];
    }
    for (int i = count - 1; i >= 0; i--) {
        double sum = y[i];
        for (int k = i + 1; k < count; k++) sum -= L[k][i] * x[list[k]];
        x[list[i]] = sum / L[i][i];
    }
}

/* Minimises x'Hx/2 + g'x within bounds, H positive definite. Returns the number of iterations, or
   -1 if the limit is reached. */
static int box_mpc_minimise(double H[BOX_MPC_STEPS][BOX_MPC_STEPS], const double *g,
                            const double *lower, const double *upper, double *x)
{
    enum { n = BOX_MPC_STEPS };
    int side[n] = {0}, list[n];
    double target[n], b[n];
    for (int i = 0; i < n; i++) x[i] = fmin(upper[i], fmax(lower[i], 0));
    for (int iteration = 1; iteration <= 10 * n; iteration++) {
        int count = 0, blocking = -1, leaving = -1;
        double step = 1, worst = -1e-9;
        for (int i = 0; i < n; i++) {
            if (!side[i]) list[count++] = i;
            b[i] = -g[i];
            target[i] = x[i];
            for (int j = 0; j < n; j++) if (side[j]) b[i] -= H[i][j] * x[j];
        }
        box_mpc_solve(H, list, count, b, target);
        for (int k = 0; k < count; k++) {
            int i = list[k];
            double d = target[i] - x[i], bound = d > 0 ? upper[i] : lower[i];
            if (d != 0 && (bound - x[i]) / d < step) {
                step = fmax(0, (bound - x[i]) / d);
                blocking = i;
            }
        }
        for (int k = 0; k < count; k++) x[list[k]] += step * (target[list[k]] - x[list[k]]);
        if (blocking >= 0) {
            side[blocking] = target[blocking] > x[blocking] ? 1 : -1;
            x[blocking] = side[blocking] > 0 ? upper[blocking] : lower[blocking];
            continue;
        }
        for (int i = 0; i < n; i++) {
            double slope = g[i];
            if (!side[i]) continue;
            for (int j = 0; j < n; j++) slope += H[i][j] * x[j];
            if (-side[i] * slope < worst) { worst = -side[i] * slope; leaving = i; }
        }
        if (leaving < 0) return iteration;
        side[leaving] = 0;
    }
    return -1;
}

/* Computes the command of the first step (m/s2, additional to the acceleration reference).
   error: the three states (m, m/s, m/s2); h: step (s); lag (s); weights qp, qv, r;
   lower, upper: bounds of the command, each for two steps. */
static double box_mpc_command(const double *error, double h, double lag, double qp, double qv,
                              double r, const double *lower, const double *upper)
{
    enum { n = BOX_MPC_STEPS };
    double response[n][3], still[n][3], H[n][n], g[n], x[n], low[n], high[n], state[3] = {0, 0, 0};
    for (int k = 0; k < n; k++) {
        box_mpc_move(h, lag, k == 0, state);
        memcpy(response[k], state, sizeof state);
    }
    memcpy(state, error, sizeof state);
    for (int k = 0; k < n; k++) {
        box_mpc_move(h, lag, 0, state);
        memcpy(still[k], state, sizeof state);
    }
    for (int i = 0; i < n; i++) {
        g[i] = 0;
        for (int k = i; k < n; k++)
            g[i] += qp * response[k - i][0] * still[k][0] + qv * response[k - i][1] * still[k][1];
        for (int j = 0; j <= i; j++) {
            double sum = i == j ? r : 0;
            for (int k = i; k < n; k++)
                sum += qp * response[k - i][0] * response[k - j][0] +
                       qv * response[k - i][1] * response[k - j][1];
            H[i][j] = H[j][i] = sum;
        }
    }
    for (int k = 0; k < n; k++) { low[k] = lower[k / 2]; high[k] = upper[k / 2]; }
    box_mpc_minimise(H, g, low, high, x);
    return x[0];
}
