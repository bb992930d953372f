/* An FMI 2.0 or 3.0 FMU, written by hand: y = 2 u + 1, directly, with directional derivatives.
   Value references: 1 u, 2 y, 3 number of calls of fmi*GetDirectionalDerivative (all of them
   real). */
#include <stdlib.h>
#if FMI == 2
#include "fmi2FunctionTypes.h"
#define F(NAME) fmi2##NAME
#define REAL(VERB) fmi2##VERB##Real
#define COUNTED
#define LENGTH(NAME)
#else
#include "fmi3FunctionTypes.h"
#define F(NAME) fmi3##NAME
#define REAL(VERB) fmi3##VERB##Float64
#define COUNTED , size_t value_count
#define LENGTH(NAME) , size_t NAME
#endif
typedef struct { double u, calls; } Affine;
typedef unsigned Reference;

const char *F(GetVersion)(void) { return FMI == 2 ? "2.0" : "3.0"; }
#if FMI == 2
const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                      const void *callbacks, int v, int l) {
    return calloc(1, sizeof(Affine));
}
int fmi2SetupExperiment(void *c, int td, double t, double start, int sd, double stop) { return 0; }
int fmi2EnterInitializationMode(void *c) { return 0; }
int fmi2DoStep(void *c, double t, double h, int no_set) { return 0; }
#else
void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources,
                                  bool visible, bool logging, bool event, bool early,
                                  const Reference vr[], size_t n, void *environment, void *log,
                                  void *update) {
    return calloc(1, sizeof(Affine));
}
int fmi3EnterInitializationMode(void *c, bool td, double t, double start, bool sd, double stop) {
    return 0;
}
int fmi3DoStep(void *c, double t, double h, bool no_set, bool *event, bool *terminate, bool *early,
               double *last) {
    *event = *terminate = *early = false;
    *last = t + h;
    return 0;
}
#endif
int F(ExitInitializationMode)(void *c) { return 0; }
int F(Terminate)(void *c) { return 0; }
void F(FreeInstance)(void *c) { free(c); }
int REAL(Get)(void *c, const Reference vr[], size_t n, double v[] COUNTED) {
    Affine *m = c;
    for (size_t k = 0; k < n; k++) v[k] = vr[k] == 1 ? m->u : vr[k] == 2 ? 2 * m->u + 1 : m->calls;
    return 0;
}
int REAL(Set)(void *c, const Reference vr[], size_t n, const double v[] COUNTED) {
    for (size_t k = 0; k < n; k++) ((Affine *)c)->u = v[k];
    return 0;
}
int F(GetDirectionalDerivative)(void *c, const Reference unknown[], size_t n,
                                const Reference known[], size_t m,
                                const double seed[] LENGTH(seeds),
                                double result[] LENGTH(results)) {
    ((Affine *)c)->calls++;
    for (size_t k = 0; k < n; k++) result[k] = unknown[k] == 2 && known[0] == 1 ? 2 * seed[0] : 0;
    return 0;
}
