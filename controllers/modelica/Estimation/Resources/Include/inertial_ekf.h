/* Error-state extended Kalman filter of an inertial navigation aided by position, velocity and
   magnetic field.

   J. Sola: Quaternion kinematics for the error-state Kalman filter (2017), section 5 (local angular
   error). World axes x east, y north, z up. Errors: position, velocity (world axes), attitude
   (rotation vector), biases of gyroscopes and accelerometers (body axes). At rest only the sum of
   the effects of tilt and accelerometer bias is observable. In body axes this sum does not depend
   on the estimated attitude, so that corrections of the heading do not pretend to know more. */

#include <math.h>
#include <string.h>

#define EKF_SIZE 15
#define EKF_GRAVITY 9.81

enum { EKF_POSITION = 0, EKF_VELOCITY = 3, EKF_ATTITUDE = 6, EKF_GYRO = 9, EKF_FORCE = 12 };

/* Packed state of Estimation.InertialFilter. */
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
    double r[4] = {a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
                   a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
                   a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
                   a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]};
    double norm = sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2] + r[3] * r[3]);
    for (int i = 0; i < 4; i++) q[i] = r[i] / norm;
}

static void ekf_small_rotation(const double v[3], double q[4])
{
    double angle = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]),
           scale = angle > 1e-8 ? sin(angle / 2) / angle : 0.5;
    q[0] = cos(angle / 2);
    for (int i = 0; i < 3; i++) q[1 + i] = scale * v[i];
}

/* Adds one step of the error dynamics to the rows (by_column 0) or columns (1) of P: half of F P
   F'. R: attitude; f: specific force (body axes); T: turn of the body in the step, transposed. */
static void ekf_propagate(double P[EKF_SIZE][EKF_SIZE], double R[3][3], const double f[3],
                          double T[3][3], double h, int by_column)
{
    double C[3][3], old[3];
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++)
            C[i][k] = h * (R[i][(k + 1) % 3] * f[(k + 2) % 3] - R[i][(k + 2) % 3] * f[(k + 1) % 3]);
#define EKF_AT(i, j) (*(by_column ? &P[j][i] : &P[i][j]))
    for (int j = 0; j < EKF_SIZE; j++) {
        for (int i = 0; i < 3; i++) {
            EKF_AT(EKF_POSITION + i, j) += h * EKF_AT(EKF_VELOCITY + i, j);
            old[i] = EKF_AT(EKF_ATTITUDE + i, j);
        }
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++)
                EKF_AT(EKF_VELOCITY + i, j) -=
                    C[i][k] * old[k] + h * R[i][k] * EKF_AT(EKF_FORCE + k, j);
        for (int i = 0; i < 3; i++)
            EKF_AT(EKF_ATTITUDE + i, j) = T[0][i] * old[0] + T[1][i] * old[1] + T[2][i] * old[2] -
                                          h * EKF_AT(EKF_GYRO + i, j);
    }
#undef EKF_AT
}

/* Integrates rates (rad/s) and specific force (m/s2) over h (s). density: noise of velocity,
   attitude, gyroscope bias and accelerometer bias (unit of the state per square root of s). */
static void ekf_predict(EkfState *s, double h, const double *rates, const double *force,
                        const double *density)
{
    double turn[3], half[3], middle[4], rotation[4], f[3], R[3][3], T[3][3];
    for (int i = 0; i < 3; i++) {
        turn[i] = h * (rates[i] - s->gyro_bias[i]);
        half[i] = turn[i] / 2;
    }
    ekf_small_rotation(half, rotation);
    ekf_product(s->q, rotation, middle);
    ekf_product(middle, rotation, s->q);
    ekf_rotation(middle, R);
    ekf_small_rotation(turn, rotation);
    ekf_rotation(rotation, T);
    for (int i = 0; i < 3; i++) f[i] = force[i] - s->force_bias[i];
    for (int i = 0; i < 3; i++)
        s->specific_force[i] = R[i][0] * f[0] + R[i][1] * f[1] + R[i][2] * f[2];
    ekf_propagate(s->P, R, f, T, h, 0);
    ekf_propagate(s->P, R, f, T, h, 1);
    for (int i = 0; i < 12; i++) s->P[3 + i][3 + i] += density[i / 3] * density[i / 3] * h;
    for (int i = 0; i < 3; i++) {
        double a = s->specific_force[i] - (i == 2 ? EKF_GRAVITY : 0);
        s->position[i] += h * (s->velocity[i] + h / 2 * a);
        s->velocity[i] += h * a;
    }
}

/* Corrects the state by a scalar residual with the row `slope` of the measurement matrix. */
static void ekf_correct(EkfState *s, const double slope[EKF_SIZE], double residual,
                        double deviation)
{
    double row[EKF_SIZE] = {0}, d[EKF_SIZE], rotation[4], total = deviation * deviation;
    for (int i = 0; i < EKF_SIZE; i++)
        for (int j = 0; slope[i] != 0 && j < EKF_SIZE; j++) row[j] += slope[i] * s->P[i][j];
    for (int j = 0; j < EKF_SIZE; j++) total += slope[j] * row[j];
    for (int j = 0; j < EKF_SIZE; j++) {
        d[j] = row[j] * residual / total;
        for (int l = 0; l < EKF_SIZE; l++) s->P[j][l] -= row[j] * row[l] / total;
    }
    for (int j = 0; j < 3; j++) {
        s->position[j] += d[EKF_POSITION + j], s->velocity[j] += d[EKF_VELOCITY + j];
        s->gyro_bias[j] += d[EKF_GYRO + j], s->force_bias[j] += d[EKF_FORCE + j];
    }
    ekf_small_rotation(d + EKF_ATTITUDE, rotation);
    ekf_product(s->q, rotation, s->q);
}

/* Corrects by a position and a velocity of age `delay` (s) along the axis i. Errors of the attitude
   and of the accelerometer bias change the acceleration, and with it the velocity at the time of
   the sample. */
static void ekf_correct_by_fix(EkfState *s, int i, double position, double velocity, double delay,
                               const double *noise)
{
    const int j = (i + 1) % 3, l = (i + 2) % 3;
    double place[EKF_SIZE] = {0}, speed[EKF_SIZE] = {0}, R[3][3],
           a = s->specific_force[i] - (i == 2 ? EKF_GRAVITY : 0);
    ekf_rotation(s->q, R);
    place[EKF_POSITION + i] = speed[EKF_VELOCITY + i] = 1;
    place[EKF_VELOCITY + i] = -delay;
    for (int k = 0; k < 3; k++) {
        speed[EKF_ATTITUDE + k] =
            delay * (s->specific_force[j] * R[l][k] - s->specific_force[l] * R[j][k]);
        speed[EKF_FORCE + k] = delay * R[i][k];
    }
    for (int k = EKF_ATTITUDE; k < EKF_SIZE; k++) place[k] = -delay / 2 * speed[k];
    ekf_correct(s, place, position - s->position[i] + delay * (s->velocity[i] - delay / 2 * a),
                noise[i / 2]);
    a = s->specific_force[i] - (i == 2 ? EKF_GRAVITY : 0);
    ekf_correct(s, speed, velocity - s->velocity[i] + delay * a, noise[2]);
}

/* Corrects by a magnetic field (body axes). earth: heading of its horizontal part in the world
   (rad, counter-clockwise from east) and its dip below the horizontal (rad). Where the field dips,
   the heading that it shows depends on roll and pitch. */
static void ekf_correct_by_field(EkfState *s, const double *field, const double *earth,
                                 double deviation)
{
    const double turning[3] = {cos(earth[0]) * tan(earth[1]), sin(earth[0]) * tan(earth[1]), 1};
    double R[3][3], B[2], slope[EKF_SIZE] = {0};
    ekf_rotation(s->q, R);
    for (int i = 0; i < 3; i++)
        slope[EKF_ATTITUDE + i] =
            R[0][i] * turning[0] + R[1][i] * turning[1] + R[2][i] * turning[2];
    for (int i = 0; i < 2; i++) B[i] = R[i][0] * field[0] + R[i][1] * field[1] + R[i][2] * field[2];
    ekf_correct(s, slope, remainder(earth[0] - atan2(B[1], B[0]), 2 * 3.14159265358979323846),
                deviation);
}

/* Starts level, at the first fix, with the heading of the field. deviation: standard deviations of
   roll and pitch and of both biases; noise: those of the measurements, as in ekf_step. */
static void ekf_start(const double *position, const double *velocity, const double *field,
                      const double *earth, const double *deviation, const double *noise,
                      double *next)
{
    const double unknown = 1, yaw = earth[0] - atan2(field[1], field[0]);
    EkfState s;
    double groups[EKF_SIZE] = {noise[0], noise[0],     noise[1],     noise[2], noise[2],
                               noise[2], deviation[0], deviation[0], unknown};
    for (int i = EKF_GYRO; i < EKF_SIZE; i++) groups[i] = deviation[i / 3 - 2];
    memset(&s, 0, sizeof s);
    memcpy(s.position, position, sizeof s.position);
    memcpy(s.velocity, velocity, sizeof s.velocity);
    s.q[0] = cos(yaw / 2), s.q[3] = sin(yaw / 2), s.specific_force[2] = EKF_GRAVITY;
    for (int i = 0; i < EKF_SIZE; i++) s.P[i][i] = groups[i] * groups[i];
    ekf_correct_by_field(&s, field, earth, noise[3]);
    memcpy(next, &s, sizeof s);
}

/* One step: prediction, then the measurements that are new. delay: age of the fix (s). noise:
   standard deviations of horizontal and vertical position, velocity and heading. */
static void ekf_step(const double *previous, double h, const double *rates, const double *force,
                     const double *density, int has_fix, const double *position,
                     const double *velocity, double delay, int has_field, const double *field,
                     const double *earth, const double *noise, double *next)
{
    EkfState s;
    memcpy(&s, previous, sizeof s);
    ekf_predict(&s, h, rates, force, density);
    for (int i = 0; has_fix && i < 3; i++)
        ekf_correct_by_fix(&s, i, position[i], velocity[i], delay, noise);
    if (has_field) ekf_correct_by_field(&s, field, earth, noise[3]);
    memcpy(next, &s, sizeof s);
}
