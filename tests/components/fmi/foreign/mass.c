/* An FMI 2.0 FMU, written by hand: a mass of 1 kg with spring and damper to the ground, and both to
   another mass, whose position and velocity are inputs. It is solved exactly for inputs that are
   linear within a step, by the exponential of a matrix. It gives the time derivatives of its
   outputs. Value references: 0 u, 1 w (position and velocity of the other mass), 2 x, 3 v, 4 c, 5
   d, 6 ck, 7 dk, 8 x_start. */
#include <stdlib.h>
#include <string.h>
#include "fmi2FunctionTypes.h"

enum { U, W, X, V, C, D, CK, DK, X_START, COUNT, ORDER = 6, TERMS = 24 };

typedef struct {
    double r[COUNT], slope[2];
    double time; /* since the begin of the last step */
    /* rows of exp(A step) for x and v; columns x, v, u, w, slopes of u and w */
    double step, transition[2][ORDER];
} Mass;

/* First two rows of exp(A h) by its Taylor series; the norm of A h is below 1 for steps up to 20
   ms. */
static void compute_transition(Mass *m, double h) {
    double a[ORDER][ORDER] = {{0, 1},
                              {-m->r[C] - m->r[CK], -m->r[D] - m->r[DK], m->r[CK], m->r[DK]}};
    a[2][4] = a[3][5] = 1;
    double term[2][ORDER] = {{1}, {0, 1}};
    memcpy(m->transition, term, sizeof term);
    for (int n = 1; n <= TERMS; n++) {
        double next[2][ORDER] = {{0}};
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < ORDER; j++)
                for (int k = 0; k < ORDER; k++) next[i][j] += term[i][k] * a[k][j] * h / n;
        memcpy(term, next, sizeof term);
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < ORDER; j++) m->transition[i][j] += term[i][j];
    }
    m->step = h;
}

const char *fmi2GetTypesPlatform(void) { return fmi2TypesPlatform; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                               const fmi2String names[]) {
    return fmi2OK;
}

fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                              const fmi2CallbackFunctions *callbacks, fmi2Boolean visible,
                              fmi2Boolean logging) {
    Mass *m = calloc(1, sizeof(Mass));
    const double start[COUNT] = {0, 0, 0, 0, 10, 0.1, 30, 0.2, 0};
    memcpy(m->r, start, sizeof start);
    return m;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean td, fmi2Real t, fmi2Real start,
                               fmi2Boolean sd, fmi2Real stop) {
    return fmi2OK;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
    Mass *m = c;
    m->r[X] = m->r[X_START];
    return fmi2OK;
}
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }

fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real v[]) {
    for (size_t k = 0; k < n; k++) v[k] = ((Mass *)c)->r[vr[k]];
    return fmi2OK;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                       const fmi2Real v[]) {
    Mass *m = c;
    for (size_t k = 0; k < n; k++) {
        m->r[vr[k]] = v[k];
        /* an input is constant until its derivative is set */
        if (vr[k] <= W) m->slope[vr[k]] = m->time = 0;
    }
    return fmi2OK;
}
fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                       const fmi2Integer order[], const fmi2Real v[]) {
    for (size_t k = 0; k < n; k++) {
        if (vr[k] > W || order[k] != 1) return fmi2Error;
        ((Mass *)c)->slope[vr[k]] = v[k];
    }
    return fmi2OK;
}
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
    Mass *m = c;
    if (m->step != h) compute_transition(m, h);
    double state[ORDER] = {m->r[X], m->r[V], m->r[U], m->r[W], m->slope[0], m->slope[1]},
           next[2] = {0};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < ORDER; j++) next[i] += m->transition[i][j] * state[j];
    m->r[X] = next[0];
    m->r[V] = next[1];
    m->time = h;
    return fmi2OK;
}
fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                        const fmi2Integer order[], fmi2Real v[]) {
    Mass *m = c;
    double u = m->r[U] + m->slope[0] * m->time, w = m->r[W] + m->slope[1] * m->time;
    double force =
        m->r[CK] * (u - m->r[X]) + m->r[DK] * (w - m->r[V]) - m->r[C] * m->r[X] - m->r[D] * m->r[V];
    for (size_t k = 0; k < n; k++) {
        if (vr[k] < X || vr[k] > V || order[k] != 1) return fmi2Error;
        v[k] = vr[k] == X ? m->r[V] : force; /* of 1 kg */
    }
    return fmi2OK;
}

fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
    if (!*state) *state = malloc(sizeof(Mass));
    memcpy(*state, c, sizeof(Mass));
    return fmi2OK;
}
fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
    memcpy(c, state, sizeof(Mass));
    return fmi2OK;
}
fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
    free(*state);
    *state = NULL;
    return fmi2OK;
}
