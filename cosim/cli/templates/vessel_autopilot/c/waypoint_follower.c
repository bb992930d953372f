/* Vessel autopilot in C with the headers of FMI 2.0: it passes waypoints at a speed.

   Thrust: PI control of the speed error; the integral is held while the thrust is at its limit.
   Rudder angle: PD control of the course to the next waypoint. After the last waypoint the thrust
   is zero. SI units, angles in rad, yaw counter-clockwise. */

#include <math.h>

#define GUID "waypoint_follower, version 1"

/* Value references, in the order of modelDescription.xml. */
enum {
    X, Y, YAW, SURGE_SPEED, YAW_RATE,
    SPEED_COMMAND, ACCEPTANCE_RADIUS, WAYPOINT_COUNT, WAYPOINT_X, WAYPOINT_Y = WAYPOINT_X + 32,
    SPEED_P = WAYPOINT_Y + 32, SPEED_I, THRUST_LIMIT, COURSE_P, COURSE_D, RUDDER_LIMIT,
    THRUST, RUDDER_ANGLE, REACHED, SPEED_INTEGRAL,
    VARIABLES, FIRST_OUTPUT = THRUST
};

static const double START[VARIABLES] = {
    [SPEED_COMMAND] = 1.0, [ACCEPTANCE_RADIUS] = 0.5, [WAYPOINT_COUNT] = 1.0,
    [SPEED_P] = 82.65, [SPEED_I] = 10.0, [THRUST_LIMIT] = 3.0,
    [COURSE_P] = 1.5, [COURSE_D] = 0.8, [RUDDER_LIMIT] = 0.610865238198015,
};

static double clamp(double value, double limit) { return fmax(-limit, fmin(limit, value)); }

/* Computes the outputs from the measurements at the start of a step; they are constant until its
   end. */
static void control(double *v, double step_size)
{
    int next = (int)v[REACHED], count = (int)fmin(v[WAYPOINT_COUNT], 32.0);
    v[THRUST] = v[RUDDER_ANGLE] = 0.0;
    if (next >= count) return;
    double east = v[WAYPOINT_X + next] - v[X], north = v[WAYPOINT_Y + next] - v[Y];
    if (step_size > 0 && hypot(east, north) < v[ACCEPTANCE_RADIUS]) v[REACHED] += 1.0;

    double speed_error = v[SPEED_COMMAND] - v[SURGE_SPEED];
    double thrust = v[SPEED_P] * speed_error + v[SPEED_INTEGRAL];
    v[THRUST] = clamp(thrust, v[THRUST_LIMIT]);
    if (fabs(thrust) < v[THRUST_LIMIT]) v[SPEED_INTEGRAL] += v[SPEED_I] * step_size * speed_error;

    /* A positive rudder angle turns the bow to starboard and reduces the yaw angle. */
    double course_error = v[YAW] - atan2(north, east);
    course_error = atan2(sin(course_error), cos(course_error));
    v[RUDDER_ANGLE] =
        clamp(v[COURSE_P] * course_error + v[COURSE_D] * v[YAW_RATE], v[RUDDER_LIMIT]);
}

#include "fmi2_block.h"
