/* Error-state extended Kalman filter of an inertial navigation aided by position, velocity and heading.

   J. Sola: Quaternion kinematics for the error-state Kalman filter (2017), sections 5 and 7 (global angular error).
   World axes x east, y north, z up. Errors: position, velocity, attitude (rotation vector, world axes), biases of gyroscopes and
   accelerometers (body axes). */

#include <math.h>
#include <string.h>

#define EKF_SIZE 15
#define EKF_GRAVITY 9.81

enum { EKF_POSITION = 0, EKF_VELOCITY = 3, EKF_ATTITUDE = 6, EKF_GYRO = 9, EKF_FORCE = 12 };

/* Packed state of Fleet.InertialFilter. */
typedef struct {
    double position[3], velocity[3], q[4], gyro_bias[3], force_bias[3], specific_force[3];
    double P[EKF_SIZE][EKF_SIZE];
} EkfState;

static void ekf_rotation(const double q[4], double R[3][3])
{
    double w = q[0], x = q[1], y = q[2], z = q[3];
    R[0][0] = 1 - 2 * (y * y + z * z), R[0][1] = 2 * (x * y - w * z), R[0][2] = 2 * (x * z + w * y);
    R[1][0] = 2 * (x * y + w * z), R[1][1] = 1 - 2 * (x * x + z * z), R[1][2] = 2 * (y * z - w * x);
    R[2][0] = 2 * (x * z - w * y), R[2][1] = 2 * (y * z + w * x), R[2][2] = 1 - 2 * (x * x + y * y);
}

/* q := a b, normalised. */
static void ekf_product(const double a[4], const double b[4], double q[4])
{
    double r[4] = {
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
    double norm = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
    for (int i = 0; i < 4; i++) q[i] = r[i] / norm;
}

static void ekf_small_rotation(const double v[3], double q[4])
{
    double angle = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]), scale = angle > 1e-8 ? sin(angle / 2) / angle : 0.5;
    q[0] = cos(angle / 2);
    for (int i = 0; i < 3; i++) q[1 + i] = scale * v[i];
}

/* Adds one step of the error dynamics to the rows (by_column 0) or columns (1) of P: half of F P F'. */
static void ekf_propagate(double P[EKF_SIZE][EKF_SIZE], double R[3][3], const double f[3], double h, int by_column)
{
    const double C[3][3] = {{0, h * f[2], -h * f[1]}, {-h * f[2], 0, h * f[0]}, {h * f[1], -h * f[0], 0}};
#define EKF_AT(i, j) (*(by_column ? &P[j][i] : &P[i][j]))
    for (int j = 0; j < EKF_SIZE; j++) {
        for (int i = 0; i < 3; i++) EKF_AT(EKF_POSITION + i, j) += h * EKF_AT(EKF_VELOCITY + i, j);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                EKF_AT(EKF_VELOCITY + i, j) += C[i][k] * EKF_AT(EKF_ATTITUDE + k, j) - h * R[i][k] * EKF_AT(EKF_FORCE + k, j);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) EKF_AT(EKF_ATTITUDE + i, j) -= h * R[i][k] * EKF_AT(EKF_GYRO + k, j);
    }
#undef EKF_AT
}

/* Integrates rates (rad/s) and specific force (m/s2) over h (s). density: noise of velocity, attitude, gyroscope bias and
   accelerometer bias (unit of the state per square root of s). */
static void ekf_predict(EkfState *s, double h, const double *rates, const double *force, const double *density)
{
    double turn[3], half[3], middle[4], rotation[4], R[3][3];
    for (int i = 0; i < 3; i++) { turn[i] = h * (rates[i] - s->gyro_bias[i]); half[i] = turn[i] / 2; }
    ekf_small_rotation(half, rotation);
    ekf_product(s->q, rotation, middle);
    ekf_product(middle, rotation, s->q);
    ekf_rotation(middle, R);
    for (int i = 0; i < 3; i++) {
        double f = 0;
        for (int k = 0; k < 3; k++) f += R[i][k] * (force[k] - s->force_bias[k]);
        s->specific_force[i] = f;
    }
    ekf_propagate(s->P, R, s->specific_force, h, 0);
    ekf_propagate(s->P, R, s->specific_force, h, 1);
    for (int i = 0; i < 12; i++) s->P[3 + i][3 + i] += density[i / 3] * density[i / 3] * h;
    for (int i = 0; i < 3; i++) {
        double a = s->specific_force[i] - (i == 2 ? EKF_GRAVITY : 0);
        s->position[i] += h * (s->velocity[i] + h / 2 * a);
        s->velocity[i] += h * a;
    }
}

/* Corrects the state by a scalar residual whose row is `gain_of_state` at index i and `slope` at index k (0: none). */
static void ekf_correct(EkfState *s, int i, int k, double slope, double residual, double deviation)
{
    double row[EKF_SIZE], d[EKF_SIZE], rotation[4], variance = deviation * deviation;
    for (int j = 0; j < EKF_SIZE; j++) row[j] = s->P[i][j] + slope * s->P[k][j];
    double total = row[i] + slope * row[k] + variance;
    for (int j = 0; j < EKF_SIZE; j++) {
        d[j] = row[j] * residual / total;
        for (int l = 0; l < EKF_SIZE; l++) s->P[j][l] -= row[j] * row[l] / total;
    }
    for (int j = 0; j < 3; j++) {
        s->position[j] += d[EKF_POSITION + j], s->velocity[j] += d[EKF_VELOCITY + j];
        s->gyro_bias[j] += d[EKF_GYRO + j], s->force_bias[j] += d[EKF_FORCE + j];
    }
    ekf_small_rotation(d + EKF_ATTITUDE, rotation);
    ekf_product(rotation, s->q, s->q);
}

/* Starts at rest and level. deviation: standard deviations of the five groups of errors. */
static void ekf_start(const double *position, double yaw, const double *deviation, double *next)
{
    EkfState s;
    memset(&s, 0, sizeof s);
    memcpy(s.position, position, sizeof s.position);
    s.q[0] = cos(yaw / 2), s.q[3] = sin(yaw / 2), s.specific_force[2] = EKF_GRAVITY;
    for (int i = 0; i < EKF_SIZE; i++) s.P[i][i] = deviation[i / 3] * deviation[i / 3];
    memcpy(next, &s, sizeof s);
}

/* One step: prediction, then the measurements that are new. delay: age of the fix (s). noise: standard deviations of horizontal
   and vertical position, velocity and heading. */
static void ekf_step(const double *previous, double h, const double *rates, const double *force, const double *density, int has_fix,
                     const double *position, const double *velocity, double delay, int has_yaw, double yaw, const double *noise, double *next)
{
    EkfState s;
    memcpy(&s, previous, sizeof s);
    ekf_predict(&s, h, rates, force, density);
    for (int i = 0; has_fix && i < 3; i++) {
        double a = s.specific_force[i] - (i == 2 ? EKF_GRAVITY : 0);
        double past = s.position[i] - delay * (s.velocity[i] - delay / 2 * a);
        ekf_correct(&s, EKF_POSITION + i, EKF_VELOCITY + i, -delay, position[i] - past, noise[i / 2]);
        ekf_correct(&s, EKF_VELOCITY + i, 0, 0, velocity[i] - s.velocity[i] + delay * a, noise[2]);
    }
    if (has_yaw) {
        double own = atan2(2 * (s.q[0] * s.q[3] + s.q[1] * s.q[2]), 1 - 2 * (s.q[2] * s.q[2] + s.q[3] * s.q[3]));
        ekf_correct(&s, EKF_ATTITUDE + 2, 0, 0, remainder(yaw - own, 2 * 3.14159265358979323846), noise[3]);
    }
    memcpy(next, &s, sizeof s);
}
