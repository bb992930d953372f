/* The lower bound of an importer's cost: a plain loop that only calls the FMUs.

   climit LIBRARY TOKEN RESOURCES RING INSTANCES WIDTH INPUT OUTPUT RECORDED STEPS

   RING 1: instances of a lag of WIDTH in a ring, Jacobi: get all outputs, set all inputs, step all
   instances. RING 0: one instance without inputs: step, then get its outputs. INPUT and OUTPUT are
   the value references of the first input and output; the others are consecutive. The first
   RECORDED outputs are recorded in every step. Prints the CPU time (us) per step and the last
   value. The macro CALLS names the header with the calls of an FMI version. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include CALLS

static double cpu_seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static Reference *references(const char *text, size_t n)
{
    const size_t first = (size_t)atol(text);
    Reference *consecutive = malloc(n * sizeof *consecutive);
    for (size_t i = 0; i < n; i++) consecutive[i] = (Reference)(first + i);
    return consecutive;
}

static int fail(const char *reason)
{
    fprintf(stderr, "climit: %s\n", reason);
    return 1;
}

int main(int argc, char **argv)
{
    if (argc != 11)
        return fail("usage: climit LIBRARY TOKEN RESOURCES RING INSTANCES WIDTH INPUT OUTPUT "
                    "RECORDED STEPS");
    const int ring = atoi(argv[4]), n = atoi(argv[5]);
    const size_t width = (size_t)atol(argv[6]), recorded = (size_t)atol(argv[9]);
    const long steps = atol(argv[10]);
    void *library = dlopen(argv[1], RTLD_NOW | RTLD_LOCAL);
    if (library == NULL) return fail(dlerror());
    const Calls calls = look_up(library);
    const Reference *inputs = references(argv[7], width), *outputs = references(argv[8], width);
    const double step_size = 0.01;
    Instance *instances = malloc((size_t)n * sizeof *instances);
    double *y = malloc((size_t)n * width * sizeof *y),
           *record = malloc((size_t)steps * recorded * sizeof *record), *row = record;
    for (int i = 0; i < n; i++)
        if ((instances[i] = start(library, argv[2], argv[3])) == NULL) return fail("no instance");

    const double begin = cpu_seconds();
    for (long k = 0; k < steps; k++) {
        if (ring) {
            for (int i = 0; i < n; i++)
                get(&calls, instances[i], outputs, width, y + (size_t)i * width);
            for (int i = 0; i < n; i++)
                set(&calls, instances[i], inputs, width, y + (size_t)((i + n - 1) % n) * width);
        }
        for (int i = 0; i < n; i++)
            if (step(&calls, instances[i], (double)k * step_size, step_size) > WORST)
                return fail("doStep failed");
        if (!ring) get(&calls, instances[0], outputs, width, y);
        for (size_t i = 0; i < recorded; i++) row[i] = y[i];
        row += recorded;
    }
    printf("%.6f %.17g\n", (cpu_seconds() - begin) / (double)steps * 1e6, row[-1]);
    return 0;
}
