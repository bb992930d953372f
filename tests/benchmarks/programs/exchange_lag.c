/* A near-empty FMI 2.0 Model Exchange FMU without events, x' = u - x, and with -DLOOP a plain C
   loop over its functions. Value references: 0 u, 1 x, 2 der(x). */
#include <stdio.h>
#include <stdlib.h>
#include "fmi2Functions.h"

#ifndef LOOP
typedef struct { double r[3]; } Lag;

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    Lag *m = calloc(1, sizeof(Lag));
    m->r[1] = 1;
    return m;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start,
                               fmi2Boolean sd, fmi2Real stop) {
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2EnterEventMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
    *info = (fmi2EventInfo){0};
    return fmi2OK;
}
fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) { return fmi2OK; }
fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
    *x = ((Lag *)c)->r[1];
    return fmi2OK;
}
fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
    ((Lag *)c)->r[1] = *x;
    return fmi2OK;
}
fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real d[], size_t n) {
    *d = ((Lag *)c)->r[0] - ((Lag *)c)->r[1];
    return fmi2OK;
}
fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real z[], size_t n) { return fmi2OK; }
fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set, fmi2Boolean *enter,
                                       fmi2Boolean *terminate) {
    *enter = *terminate = fmi2False;
    return fmi2OK;
}
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[]) {
    for (size_t k = 0; k < n; k++) v[k] = ((Lag *)c)->r[vr[k]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                       const fmi2Real v[]) {
    for (size_t k = 0; k < n; k++) ((Lag *)c)->r[vr[k]] = v[k];
    return fmi2OK;
}

/* arguments: library, number of steps; prints the CPU time (us) per step and the last value */
#else
#include <dlfcn.h>
#include <time.h>

#define FUNCTION(NAME) NAME##TYPE *NAME##_ = (NAME##TYPE *)dlsym(library, #NAME)

int main(int argc, char **argv) {
    void *library = dlopen(argv[1], RTLD_NOW);
    long steps = atol(argv[2]);
    if (!library) return 1;
    FUNCTION(fmi2Instantiate);
    FUNCTION(fmi2SetTime);
    FUNCTION(fmi2SetContinuousStates);
    FUNCTION(fmi2GetDerivatives);
    FUNCTION(fmi2CompletedIntegratorStep); FUNCTION(fmi2GetReal);
    static const fmi2CallbackFunctions callbacks = {NULL, calloc, free, NULL, NULL};
    fmi2Component c =
        fmi2Instantiate_("lag", fmi2ModelExchange, "lag", "", &callbacks, fmi2False, fmi2False);
    double *rows = malloc((size_t)(steps + 1) * 2 * sizeof(double)), x = 1, dx, h = 0.01;
    const fmi2ValueReference output = 1;
    clock_t begin = clock();
    for (long n = 0; n < steps; n++) {
        fmi2Boolean enter, terminate;
        int status = fmi2GetDerivatives_(c, &dx, 1);
        status |= fmi2SetTime_(c, (double)(n + 1) * h);
        x += h * dx;
        status |= fmi2SetContinuousStates_(c, &x, 1);
        status |= fmi2CompletedIntegratorStep_(c, fmi2True, &enter, &terminate);
        if (status || enter || terminate) return 2;
        rows[2 * n] = (double)(n + 1) * h;
        if (fmi2GetReal_(c, &output, 1, rows + 2 * n + 1)) return 2;
    }
    printf("%.17g %.17g\n", 1e6 * (double)(clock() - begin) / CLOCKS_PER_SEC / (double)steps,
           rows[2 * steps - 1]);
    return 0;
}
#endif
