/* An FMI 3.0 FMU with arrays whose size is a structural parameter, and with binaries, written by
   hand. Value references: 1 n (structural, 1 to 4), 2 m[n,2] (parameter), 3 u[n] (input), 4 y[n]
   (output) = u + row sums of m; 5 b_in, 6 b_out (Binary). */
#include <stdlib.h>
#include <string.h>
#include "fmi3FunctionTypes.h"

enum { N_MAX = 4 };

typedef struct {
    fmi3UInt64 n;
    bool configuring;
    fmi3Float64 m[2 * N_MAX], u[N_MAX], y[N_MAX];
    fmi3Byte bytes[64];
    size_t size;
} Shapes;

fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                         fmi3Boolean visible, fmi3Boolean logging,
                                         fmi3Boolean events, fmi3Boolean early,
                                         const fmi3ValueReference required[], size_t n,
                                         fmi3InstanceEnvironment environment,
                                         fmi3LogMessageCallback log,
                                         fmi3IntermediateUpdateCallback update) {
    Shapes *s = calloc(1, sizeof(Shapes));
    s->n = 3;
    return s;
}
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3EnterConfigurationMode(fmi3Instance c) {
    return ((Shapes *)c)->configuring = true, fmi3OK;
}
fmi3Status fmi3ExitConfigurationMode(fmi3Instance c) {
    return ((Shapes *)c)->configuring = false, fmi3OK;
}
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, bool td, double t, double start, bool sd,
                                       double stop) {
    return fmi3OK;
}
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }

static fmi3Float64 *find(Shapes *s, fmi3ValueReference vr, size_t *count) {
    *count = vr == 2 ? 2 * s->n : s->n;
    return vr == 2 ? s->m : vr == 3 ? s->u : s->y;
}
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                          const fmi3Float64 v[], size_t nv) {
    size_t count;
    fmi3Float64 *to = find(c, vr[0], &count);
    if (nvr != 1 || nv != count) return fmi3Error;
    memcpy(to, v, nv * sizeof *v);
    return fmi3OK;
}
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                          fmi3Float64 v[], size_t nv) {
    Shapes *s = c;
    size_t count;
    for (size_t i = 0; i < s->n; i++) s->y[i] = s->u[i] + s->m[2 * i] + s->m[2 * i + 1];
    fmi3Float64 *from = find(c, vr[0], &count);
    if (nvr != 1 || nv != count) return fmi3Error;
    memcpy(v, from, nv * sizeof *v);
    return fmi3OK;
}
fmi3Status fmi3SetUInt64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                         const fmi3UInt64 v[], size_t nv) {
    Shapes *s = c;
    if (!s->configuring || v[0] > N_MAX) return fmi3Error;
    s->n = v[0];
    return fmi3OK;
}
fmi3Status fmi3GetUInt64(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, fmi3UInt64 v[],
                         size_t nv) {
    return v[0] = ((Shapes *)c)->n, fmi3OK;
}
fmi3Status fmi3SetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr,
                         const size_t sizes[], const fmi3Binary v[], size_t nv) {
    Shapes *s = c;
    if (sizes[0] > sizeof s->bytes) return fmi3Error;
    memcpy(s->bytes, v[0], s->size = sizes[0]);
    return fmi3OK;
}
fmi3Status fmi3GetBinary(fmi3Instance c, const fmi3ValueReference vr[], size_t nvr, size_t sizes[],
                         fmi3Binary v[], size_t nv) {
    return sizes[0] = ((Shapes *)c)->size, v[0] = ((Shapes *)c)->bytes, fmi3OK;
}
fmi3Status fmi3DoStep(fmi3Instance c, double t, double h, bool no_set_state, bool *event,
                      bool *terminate, bool *early, double *reached) {
    *event = *terminate = *early = false;
    *reached = t + h;
    return fmi3OK;
}
