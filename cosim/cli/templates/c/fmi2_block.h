/* Functions of FMI 2.0 for a controller of Real variables, which is included at the end of its C
   file.

   The C file defines before: GUID; VARIABLES, the number of variables; FIRST_OUTPUT, the value
   reference of the first variable that cannot be set; START[VARIABLES], the start values;
   control(values, step_size), which computes the outputs of a step. */

#include <stdlib.h>
#include <string.h>

#include "fmi2Functions.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"

typedef struct {
    fmi2Real value[VARIABLES];
    int initializing;
} Block;

/* -- life cycle -------------------------------------------------------------------------------- */

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return fmi2Version; }

fmi2Status fmi2Reset(fmi2Component c)
{
    Block *block = c;
    memcpy(block->value, START, sizeof START);
    block->initializing = 0;
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging)
{
    if (type != fmi2CoSimulation || strcmp(guid, GUID) != 0) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error, "error",
                          "expected type Co-Simulation and GUID \"" GUID "\"");
        return NULL;
    }
    Block *block = malloc(sizeof *block);
    if (block) fmi2Reset(block);
    return block;
}

void fmi2FreeInstance(fmi2Component c) { free(c); }

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean with_tolerance, fmi2Real tolerance,
                               fmi2Real start_time, fmi2Boolean with_stop_time,
                               fmi2Real stop_time)
{
    return fmi2OK;
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    Block *block = c;
    block->initializing = 1;
    control(block->value, 0.0);
    return fmi2OK;
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    ((Block *)c)->initializing = 0;
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step_size, fmi2Boolean no_return)
{
    control(((Block *)c)->value, step_size);
    return fmi2OK;
}

fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

/* -- variables --------------------------------------------------------------------------------- */

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference references[], size_t count,
                       fmi2Real values[])
{
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= VARIABLES) return fmi2Error;
        values[i] = ((Block *)c)->value[references[i]];
    }
    return fmi2OK;
}

fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference references[], size_t count,
                       const fmi2Real values[])
{
    Block *block = c;
    for (size_t i = 0; i < count; ++i) {
        if (references[i] >= FIRST_OUTPUT) return fmi2Error;
        block->value[references[i]] = values[i];
    }
    if (block->initializing) control(block->value, 0.0);
    return fmi2OK;
}

/* -- saving and restoring ---------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (!*state) *state = malloc(sizeof(Block));
    if (!*state) return fmi2Error;
    memcpy(*state, c, sizeof(Block));
    return fmi2OK;
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Block));
    return fmi2OK;
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    free(*state);
    *state = NULL;
    return fmi2OK;
}

/* -- FMI functions without support ------------------------------------------------------------ */

/* other types, serialized states, derivatives, asynchronous steps */

#define ONLY_WITHOUT_VARIABLES(TYPE) \
    fmi2Status fmi2Get##TYPE(fmi2Component c, const fmi2ValueReference references[], size_t count, \
                             fmi2##TYPE values[]) { \
        return count ? fmi2Error : fmi2OK; \
    } \
    fmi2Status fmi2Set##TYPE(fmi2Component c, const fmi2ValueReference references[], size_t count, \
                             const fmi2##TYPE values[]) { \
        return count ? fmi2Error : fmi2OK; \
    }
ONLY_WITHOUT_VARIABLES(Integer)
ONLY_WITHOUT_VARIABLES(Boolean)
ONLY_WITHOUT_VARIABLES(String)

#define NO_STATUS(NAME, TYPE) \
    fmi2Status fmi2Get##NAME(fmi2Component c, const fmi2StatusKind kind, TYPE *value) { \
        return fmi2Discard; \
    }
NO_STATUS(Status, fmi2Status)
NO_STATUS(RealStatus, fmi2Real)
NO_STATUS(IntegerStatus, fmi2Integer)
NO_STATUS(BooleanStatus, fmi2Boolean)
NO_STATUS(StringStatus, fmi2String)

#define REFUSED(NAME, ...) fmi2Status fmi2##NAME(fmi2Component c, __VA_ARGS__) { return fmi2Error; }
REFUSED(SerializedFMUstateSize, fmi2FMUstate state, size_t *size)
REFUSED(SerializeFMUstate, fmi2FMUstate state, fmi2Byte bytes[], size_t size)
REFUSED(DeSerializeFMUstate, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state)
REFUSED(GetDirectionalDerivative, const fmi2ValueReference unknowns[], size_t unknown_count,
        const fmi2ValueReference knowns[], size_t known_count, const fmi2Real seed[],
        fmi2Real sensitivity[])
REFUSED(SetRealInputDerivatives, const fmi2ValueReference references[], size_t count,
        const fmi2Integer orders[], const fmi2Real values[])
REFUSED(GetRealOutputDerivatives, const fmi2ValueReference references[], size_t count,
        const fmi2Integer orders[], fmi2Real values[])

fmi2Status fmi2CancelStep(fmi2Component c) { return fmi2Error; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                               const fmi2String categories[])
{
    return fmi2OK;
}
