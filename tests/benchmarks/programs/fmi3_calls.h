/* The FMI 3.0 functions that climit.c calls. */
#include "fmi3Functions.h"

typedef fmi3Instance Instance;
typedef fmi3ValueReference Reference;

enum { WORST = fmi3Warning };

typedef struct {
    fmi3GetFloat64TYPE *get;
    fmi3SetFloat64TYPE *set;
    fmi3DoStepTYPE *step;
} Calls;

static Calls look_up(void *library)
{
    return (Calls){dlsym(library, "fmi3GetFloat64"), dlsym(library, "fmi3SetFloat64"),
                   dlsym(library, "fmi3DoStep")};
}

static Instance start(void *library, const char *token, const char *resources)
{
    fmi3InstantiateCoSimulationTYPE *instantiate = dlsym(library, "fmi3InstantiateCoSimulation");
    Instance instance = instantiate("lag", token, resources, fmi3False, fmi3False, fmi3False,
                                    fmi3False, NULL, 0, NULL, NULL, NULL);
    if (instance == NULL) return NULL;
    ((fmi3EnterInitializationModeTYPE *)dlsym(library, "fmi3EnterInitializationMode"))(
        instance, fmi3False, 0, 0, fmi3False, 0);
    ((fmi3ExitInitializationModeTYPE *)dlsym(library, "fmi3ExitInitializationMode"))(instance);
    return instance;
}

static inline int get(const Calls *calls, Instance instance, const Reference *references, size_t n,
                      double *values)
{
    return calls->get(instance, references, n, values, n);
}

static inline int set(const Calls *calls, Instance instance, const Reference *references, size_t n,
                      const double *values)
{
    return calls->set(instance, references, n, values, n);
}

static inline int step(const Calls *calls, Instance instance, double time, double step_size)
{
    fmi3Boolean event, terminate, early;
    double reached;
    return calls->step(instance, time, step_size, fmi3True, &event, &terminate, &early, &reached);
}
