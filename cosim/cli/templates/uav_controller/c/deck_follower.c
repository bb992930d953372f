/* Quadcopter controller in C with the headers of FMI 2.0: it flies above the deck.

   Position control by tilting the thrust, attitude control by differences of the rotors' thrusts.
   SI units, angles in rad. */

#include <math.h>

#define GUID "deck_follower, version 1"

/* Value references, in the order of modelDescription.xml. */
enum {
    POSITION, VELOCITY = 3, TARGET_POSITION = 6, TARGET_VELOCITY = 9,
    ROLL = 12, PITCH, YAW, RATE_P, RATE_Q, RATE_R, ALTITUDE_COMMAND, YAW_COMMAND,
    POSITION_BANDWIDTH, ACCELERATION_LIMIT, ATTITUDE_BANDWIDTH, YAW_BANDWIDTH, MASS, INERTIA_XY,
    INERTIA_Z, ARM,
    TORQUE_PER_THRUST, THRUST_COEFFICIENT, ROTOR_SPEED_LIMIT,
    ROTOR_SPEED, VARIABLES = ROTOR_SPEED + 4, FIRST_OUTPUT = ROTOR_SPEED
};

static const double START[VARIABLES] = {
    [ALTITUDE_COMMAND] = 2.0,     [POSITION_BANDWIDTH] = 1.2,     [ACCELERATION_LIMIT] = 3.0,
    [ATTITUDE_BANDWIDTH] = 8.0,   [YAW_BANDWIDTH] = 2.0,          [MASS] = 0.443892,
    [INERTIA_XY] = 0.00283,       [INERTIA_Z] = 0.005131,         [ARM] = 0.1815,
    [TORQUE_PER_THRUST] = 0.0289, [THRUST_COEFFICIENT] = 8.24e-6, [ROTOR_SPEED_LIMIT] = 523.6,
};

static const double GRAVITY = 9.81;

static double clamp(double value, double limit) { return fmax(-limit, fmin(limit, value)); }

/* Commanded acceleration of a critically damped control of the position. */
static double acceleration(const double *v, double error, double rate)
{
    double w = v[POSITION_BANDWIDTH];
    return clamp(w * w * error + 2 * w * rate, v[ACCELERATION_LIMIT]);
}

/* Computes the rotor speeds from the measurements at the start of a step; they are constant until
   its end. */
static void control(double *v, double step_size)
{
    double command[3] = {v[TARGET_POSITION], v[TARGET_POSITION + 1], v[ALTITUDE_COMMAND]};
    double motion[3] = {v[TARGET_VELOCITY], v[TARGET_VELOCITY + 1], 0.0}, a[3];
    for (int i = 0; i < 3; ++i)
        a[i] = acceleration(v, command[i] - v[POSITION + i], motion[i] - v[VELOCITY + i]);

    /* A positive pitch angle lowers the nose, a positive roll angle raises the left side. */
    double pitch = atan2(a[0] * cos(v[YAW]) + a[1] * sin(v[YAW]), GRAVITY);
    double roll = -atan2(a[1] * cos(v[YAW]) - a[0] * sin(v[YAW]), GRAVITY);
    double thrust = v[MASS] * (GRAVITY + a[2]) / fmax(0.5, cos(v[ROLL]) * cos(v[PITCH]));

    /* Control of the attitude with a damping ratio of 0.8. */
    double w = v[ATTITUDE_BANDWIDTH], w_yaw = v[YAW_BANDWIDTH], turn = v[YAW_COMMAND] - v[YAW];
    double x = v[INERTIA_XY] * (w * w * (roll - v[ROLL]) - 1.6 * w * v[RATE_P]) / (2 * v[ARM]);
    double y = v[INERTIA_XY] * (w * w * (pitch - v[PITCH]) - 1.6 * w * v[RATE_Q]) / (2 * v[ARM]);
    double z = v[INERTIA_Z] *
               (w_yaw * w_yaw * atan2(sin(turn), cos(turn)) - 1.6 * w_yaw * v[RATE_R]) /
               (4 * v[TORQUE_PER_THRUST]);

    /* Front, left, rear, right; front and rear rotor turn the body counter-clockwise by their
       reaction torques. */
    double thrusts[4] = {thrust / 4 - y + z, thrust / 4 + x - z, thrust / 4 + y + z,
                         thrust / 4 - x - z};
    for (int i = 0; i < 4; ++i)
        v[ROTOR_SPEED + i] =
            fmin(v[ROTOR_SPEED_LIMIT], sqrt(fmax(0.0, thrusts[i]) / v[THRUST_COEFFICIENT]));
}

#include "fmi2_block.h"
