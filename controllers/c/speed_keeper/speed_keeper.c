/* Vessel autopilot for speed and course in C with the headers of FMI 2.0.

   Thrust: PI control of the speed error; the integral is held while the thrust is at its limit. Rudder angle: PD control of the
   course error with the yaw rate as derivative. A positive rudder angle turns the bow to starboard and reduces the yaw angle.
   SI units, angles in rad, yaw counter-clockwise from east. */

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"

#define GUID "speed_keeper, version 1"

/* Value references, in the order of modelDescription.xml. */
enum {
    YAW, SURGE_SPEED, YAW_RATE,
    SPEED_COMMAND, SPEED_P, SPEED_I, THRUST_LIMIT,
    COURSE_COMMAND, COURSE_P, COURSE_D, RUDDER_LIMIT,
    THRUST, RUDDER_ANGLE, SPEED_INTEGRAL,
    VARIABLES
};

static const fmi2Real START[VARIABLES] = {
    [SPEED_COMMAND] = 1.0, [SPEED_P] = 82.65, [SPEED_I] = 10.0, [THRUST_LIMIT] = 3.0,
    [COURSE_COMMAND] = 0.0, [COURSE_P] = 1.5, [COURSE_D] = 0.8, [RUDDER_LIMIT] = 0.610865238198015,
};

typedef struct {
    fmi2Real value[VARIABLES];
    int initializing;
} SpeedKeeper;

/* -- the controller -------------------------------------------------------------------------------------------------------- */

static double clamp(double value, double limit) { return fmax(-limit, fmin(limit, value)); }

/* Computes the outputs from the measurements at the start of a step; they are constant until its end. */
static void control(fmi2Real *v, double step_size)
{
    double speed_error = v[SPEED_COMMAND] - v[SURGE_SPEED];
    double thrust = v[SPEED_P] * speed_error + v[SPEED_INTEGRAL];
    v[THRUST] = clamp(thrust, v[THRUST_LIMIT]);
    if (fabs(thrust) < v[THRUST_LIMIT]) v[SPEED_INTEGRAL] += v[SPEED_I] * step_size * speed_error;

    double course_error = v[YAW] - v[COURSE_COMMAND];
    course_error = atan2(sin(course_error), cos(course_error));
    v[RUDDER_ANGLE] = clamp(v[COURSE_P] * course_error + v[COURSE_D] * v[YAW_RATE], v[RUDDER_LIMIT]);
}

/* -- life cycle ------------------------------------------------------------------------------------------------------------ */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2Reset(fmi2Component c)
{
    SpeedKeeper *keeper = c;
    memcpy(keeper->value, START, sizeof START);
    keeper->initializing = 0;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging)
{
    if (type != fmi2CoSimulation || strcmp(guid, GUID) != 0) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "error", "expected type Co-Simulation and GUID \"" GUID "\"");
        return NULL;
    }
    SpeedKeeper *keeper = malloc(sizeof *keeper);
    if (keeper) fmi2Reset(keeper);
    return keeper;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean with_tolerance, fmi2Real tolerance, fmi2Real start_time,
                               fmi2Boolean with_stop_time, fmi2Real stop_time) { return fmi2OK; }

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    SpeedKeeper *keeper = c;
    keeper->initializing = 1;
    control(keeper->value, 0.0);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    ((SpeedKeeper *)c)->initializing = 0;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step_size, fmi2Boolean no_return)
{
    control(((SpeedKeeper *)c)->value, step_size);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

/* -- variables ------------------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2Real values[])
{
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= VARIABLES) return fmi2Error;
        values[i] = ((SpeedKeeper *)c)->value[references[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2Real values[])
{
    SpeedKeeper *keeper = c;
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= THRUST) return fmi2Error;
        keeper->value[references[i]] = values[i];
    }
    if (keeper->initializing) control(keeper->value, 0.0);
    return fmi2OK;
}

/* -- saving and restoring -------------------------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(SpeedKeeper));
    if (!*state) return fmi2Error;
    memcpy(*state, c, sizeof(SpeedKeeper));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(SpeedKeeper));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    free(*state);
    *state = NULL;
    return fmi2OK;
}

/* -- FMI functions without support: other types, serialized states, derivatives, asynchronous steps ------------------------ */

#define ONLY_WITHOUT_VARIABLES(TYPE)                                                                                          \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference references[], size_t count, fmi2##TYPE values[])       \
    { return count ? fmi2Error : fmi2OK; }                                                                                    \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference references[], size_t count, const fmi2##TYPE values[]) \
    { return count ? fmi2Error : fmi2OK; }
ONLY_WITHOUT_VARIABLES(Integer)
ONLY_WITHOUT_VARIABLES(Boolean)
ONLY_WITHOUT_VARIABLES(String)

#define NO_STATUS(NAME, TYPE) \
    fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2StatusKind kind, TYPE *value) { return fmi2Discard; }
NO_STATUS(Status, fmi2Status)
NO_STATUS(RealStatus, fmi2Real)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(BooleanStatus, fmi2Boolean)
NO_STATUS(StringStatus, fmi2String)

#define REFUSED(NAME, ...) fmi2Status fmi2##NAME(fmi2Component c, __VA_ARGS__) { return fmi2Error; }
REFUSED(SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
REFUSED(SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
REFUSED(DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
REFUSED(GetDirectionalDerivative, const fmi2ValueReference unknowns[], size_t unknown_count, const fmi2ValueReference knowns[],
        size_t known_count, const fmi2Real seed[], fmi2Real sensitivity[])
REFUSED(SetRealInputDerivatives, const fmi2ValueReference references[], size_t count, const fmi2Integer orders[],
        const fmi2Real values[])
REFUSED(GetRealOutputDerivatives, const fmi2ValueReference references[], size_t count, const fmi2Integer orders[],
        fmi2Real values[])

fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count, const fmi2String categories[]) { return fmi2OK; }
