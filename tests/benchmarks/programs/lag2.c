/* The lag as an FMI 2.0 Co-Simulation FMU. Importers look up every function of the standard, so all
   are defined. */
#include "fmi2Functions.h"
#include "lag.h"

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String names[])
{
    return fmi2OK;
}

/* ---- life cycle ------------------------------------------------------------------------------ */

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String token,
                              fmi2String resources, const fmi2CallbackFunctions *callbacks,
                              fmi2Boolean visible, fmi2Boolean logging)
{
    return create();
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start_time, fmi2Boolean has_stop, fmi2Real stop_time)
{
    ((Lag *)c)->values[TIME] = start_time;
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step_size, fmi2Boolean no_rollback)
{
    step(c, time, step_size);
    return fmi2OK;
}
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c)
{
    start(c);
    return fmi2OK;
}

/* ---- values ---------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t n,
                       fmi2Real values[])
{
    for (size_t i = 0; i < n; i++) values[i] = ((Lag *)c)->values[U + references[i]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t n,
                       const fmi2Real values[])
{
    for (size_t i = 0; i < n; i++) ((Lag *)c)->values[U + references[i]] = values[i];
    return fmi2OK;
}

#define NO_VARIABLES(TYPE) \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference r[], size_t n, \
                             fmi2##TYPE v[]) { \
        return n ? fmi2Error : fmi2OK; \
    } \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference r[], size_t n, \
                             const fmi2##TYPE v[]) { \
        return n ? fmi2Error : fmi2OK; \
    }
NO_VARIABLES(Integer)
NO_VARIABLES(Boolean)
NO_VARIABLES(String)

/* ---- states ---------------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    return (*state = copy(*state, c)) ? fmi2OK : fmi2Error;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    return copy(c, state) ? fmi2OK : fmi2Error;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    free(*state);
    *state = NULL;
    return fmi2OK;
}
fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size)
{
    *size = sizeof(Lag);
    return fmi2OK;
}
fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
{
    return size >= sizeof(Lag) && copy(bytes, state) ? fmi2OK : fmi2Error;
}
fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *state)
{
    return size >= sizeof(Lag) && (*state = copy(*state, bytes)) ? fmi2OK : fmi2Error;
}

/* ---- unsupported functions ------------------------------------------------------------------- */

#define UNSUPPORTED(NAME, ...) \
    fmi2Status fmi2##NAME(fmi2Component c, __VA_ARGS__) { return fmi2Error; }
UNSUPPORTED(GetDirectionalDerivative, const fmi2ValueReference z[], size_t nz,
            const fmi2ValueReference v[], size_t nv, const fmi2Real dv[], fmi2Real dz[])
UNSUPPORTED(SetRealInputDerivatives, const fmi2ValueReference r[], size_t n,
            const fmi2Integer order[], const fmi2Real v[])
UNSUPPORTED(GetRealOutputDerivatives, const fmi2ValueReference r[], size_t n,
            const fmi2Integer order[], fmi2Real v[])
UNSUPPORTED(GetStatus, const fmi2StatusKind kind, fmi2Status *status)
UNSUPPORTED(GetRealStatus, const fmi2StatusKind kind, fmi2Real *value)
UNSUPPORTED(GetIntegerStatus, const fmi2StatusKind kind, fmi2Integer *value)
UNSUPPORTED(GetBooleanStatus, const fmi2StatusKind kind, fmi2Boolean *value)
UNSUPPORTED(GetStringStatus, const fmi2StatusKind kind, fmi2String *value)
fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
