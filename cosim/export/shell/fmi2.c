/* FMI 2.0 interface of a model: Co-Simulation, and Model Exchange if the model offers it. */
#include "fmi2Functions.h"

typedef fmi2CallbackLogger Logger;
#define ARRAYS 0
#include "common.h"

/* FMI 2.0 messages are format strings with "%" directives and "#" references; both characters are
   escaped by doubling. */
static void report(const Instance *instance, bool error, const char *message)
{
    char escaped[1024];
    char *end = escaped;
    for (const char *c = message; *c && end < escaped + sizeof escaped - 2; ++c) {
        if (*c == '%' || *c == '#') *end++ = *c;
        *end++ = *c;
    }
    *end = '\0';
    instance->logger(instance->environment, instance->name, error ? fmi2Error : fmi2Warning,
                     error ? "logStatusError" : "logStatusWarning", escaped);
}

static fmi2Status status(bool ok)
{
    return ok ? fmi2OK : fmi2Error;
}

/* ---- inquiry and life cycle ------------------------------------------------------------------ */

const char *fmi2GetTypesPlatform(void)
{
    return fmi2TypesPlatform;
}

const char *fmi2GetVersion(void)
{
    return "2.0";
}

/* Errors are always logged; there are no other messages. */
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t count,
                               const fmi2String categories[])
{
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *functions, fmi2Boolean visible,
                              fmi2Boolean logging_on)
{
    if (functions == NULL || functions->logger == NULL) return NULL;
#ifndef MODEL_EXCHANGE
    if (type != fmi2CoSimulation) {
        Instance nobody = {.logger = functions->logger,
                           .environment = functions->componentEnvironment,
                           .name = ""};
        return refuse(&nobody, "fmi2Instantiate", "only Co-Simulation is offered"), NULL;
    }
#endif
    Instance *instance =
        create("fmi2Instantiate", name, guid, functions->logger, functions->componentEnvironment);
    if (instance != NULL) instance->exchange = type == fmi2ModelExchange;
    return instance;
}

void fmi2FreeInstance(fmi2Component c)
{
    destroy(c);
}

fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean has_tolerance, fmi2Real tolerance,
                               fmi2Real start, fmi2Boolean has_stop, fmi2Real stop)
{
    return status(set_times(c, "fmi2SetupExperiment", start, has_stop, stop));
}

fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return status(enter_initialization(c, "fmi2EnterInitializationMode"));
}

fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    return status(exit_initialization(c, "fmi2ExitInitializationMode"));
}

fmi2Status fmi2Terminate(fmi2Component c)
{
    return status(terminate(c, "fmi2Terminate"));
}

fmi2Status fmi2Reset(fmi2Component c)
{
    reset(c);
    return fmi2OK;
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real step_size, fmi2Boolean no_rollback)
{
    const bool ok = step(c, "fmi2DoStep", time, step_size);
    return ok && requests_termination(c) ? fmi2Discard : status(ok);
}

/* ---- access to variables --------------------------------------------------------------------- */

#define ACCESSORS(Type, TYPE, Inside) \
    DEFINE_ACCESS(Type, TYPE, fmi2##Type, Inside) \
    fmi2Status fmi2Get##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             fmi2##Type values[]) { \
        return status(read_##Type(c, "fmi2Get" #Type, vr, n, values, n)); \
    } \
    fmi2Status fmi2Set##Type(fmi2Component c, const fmi2ValueReference vr[], size_t n, \
                             const fmi2##Type values[]) { \
        return status(write_##Type(c, "fmi2Set" #Type, vr, n, values, n)); \
    }

ACCESSORS(Real, FLOAT64, double)
ACCESSORS(Integer, INT32, int32_t) /* enumerations too */
ACCESSORS(Boolean, BOOLEAN, bool)

fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         fmi2String values[])
{
    return status(n == 0 || refuse(c, "fmi2GetString", "there are no strings"));
}

fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                         const fmi2String values[])
{
    return status(n == 0 || refuse(c, "fmi2SetString", "there are no strings"));
}

/* ---- the FMU state --------------------------------------------------------------------------- */

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *saved)
{
    return status(get_state(c, "fmi2GetFMUstate", saved));
}

fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate saved)
{
    return status(set_state(c, "fmi2SetFMUstate", saved));
}

fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *saved)
{
    free_state(saved);
    return fmi2OK;
}

fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate saved, size_t *size)
{
    *size = SERIALIZED_SIZE;
    return fmi2OK;
}

fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate saved, fmi2Byte bytes[], size_t size)
{
    return status(serialize(c, "fmi2SerializeFMUstate", saved, bytes, size));
}

fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size,
                                   fmi2FMUstate *saved)
{
    return status(deserialize(c, "fmi2DeSerializeFMUstate", bytes, size, saved));
}

/* ---- the status of a step: steps are never pending ------------------------------------------- */

fmi2Status fmi2CancelStep(fmi2Component c)
{
    return status(refuse(c, "fmi2CancelStep", "steps are not asynchronous"));
}

fmi2Status fmi2GetStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Status *value)
{
    return fmi2Discard;
}

fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Real *value)
{
    if (kind != fmi2LastSuccessfulTime) return fmi2Discard;
    *value = ((Instance *)c)->state.time;
    return fmi2OK;
}

fmi2Status fmi2GetIntegerStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Integer *value)
{
    return fmi2Discard;
}

fmi2Status fmi2GetBooleanStatus(fmi2Component c, const fmi2StatusKind kind, fmi2Boolean *value)
{
    if (kind != fmi2Terminated) return fmi2Discard;
    *value = requests_termination(c);
    return fmi2OK;
}

fmi2Status fmi2GetStringStatus(fmi2Component c, const fmi2StatusKind kind, fmi2String *value)
{
    return fmi2Discard;
}

/* ---- not offered ----------------------------------------------------------------------------- */

fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknowns[],
                                        size_t unknown_count, const fmi2ValueReference knowns[],
                                        size_t known_count, const fmi2Real seed[],
                                        fmi2Real sensitivity[])
{
    return status(refuse(c, "fmi2GetDirectionalDerivative", "not offered"));
}

fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real values[])
{
    return status(refuse(c, "fmi2SetRealInputDerivatives", "not offered"));
}

fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real values[])
{
    return status(refuse(c, "fmi2GetRealOutputDerivatives", "not offered"));
}

#ifdef MODEL_EXCHANGE
#include "exchange2.h"
#endif
