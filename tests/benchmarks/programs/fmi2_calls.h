/* The FMI 2.0 functions that climit.c calls. */
#include "fmi2Functions.h"

typedef fmi2Component Instance;
typedef fmi2ValueReference Reference;

enum { WORST = fmi2Warning };

typedef struct {
    fmi2GetRealTYPE *get;
    fmi2SetRealTYPE *set;
    fmi2DoStepTYPE *step;
} Calls;

static Calls look_up(void *library)
{
    return (Calls){dlsym(library, "fmi2GetReal"), dlsym(library, "fmi2SetReal"),
                   dlsym(library, "fmi2DoStep")};
}

static void ignore(fmi2ComponentEnvironment e, fmi2String name, fmi2Status status,
                   fmi2String category, fmi2String text, ...) {}

static Instance start(void *library, const char *token, const char *resources)
{
    static const fmi2CallbackFunctions callbacks = {ignore, calloc, free, NULL, NULL};
    fmi2InstantiateTYPE *instantiate = dlsym(library, "fmi2Instantiate");
    Instance instance =
        instantiate("lag", fmi2CoSimulation, token, resources, &callbacks, fmi2False, fmi2False);
    if (instance == NULL) return NULL;
    ((fmi2SetupExperimentTYPE *)dlsym(library, "fmi2SetupExperiment"))(instance, fmi2False, 0, 0,
                                                                       fmi2False, 0);
    ((fmi2EnterInitializationModeTYPE *)dlsym(library, "fmi2EnterInitializationMode"))(instance);
    ((fmi2ExitInitializationModeTYPE *)dlsym(library, "fmi2ExitInitializationMode"))(instance);
    return instance;
}

static inline int get(const Calls *calls, Instance instance, const Reference *references, size_t n,
                      double *values)
{
    return calls->get(instance, references, n, values);
}

static inline int set(const Calls *calls, Instance instance, const Reference *references, size_t n,
                      const double *values)
{
    return calls->set(instance, references, n, values);
}

static inline int step(const Calls *calls, Instance instance, double time, double step_size)
{
    return calls->step(instance, time, step_size, fmi2True);
}
