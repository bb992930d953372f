/* A near-empty model: WIDTH independent first-order lags y' = (u - y) / 0.5 s with y(0) = 1.
   Each doStep makes one explicit Euler step. */
#include <stdlib.h>
#include <string.h>

/* Indices of the values. They are the FMI 3.0 value references; FMI 2.0 value references begin with
   0 at the inputs. */
enum { TIME, U, Y = U + WIDTH, VALUES = Y + WIDTH };

typedef struct {
    double values[VALUES];
} Lag;

static inline void start(Lag *lag)
{
    memset(lag, 0, sizeof *lag);
    for (int i = 0; i < WIDTH; i++) lag->values[Y + i] = 1;
}

static inline void *create(void)
{
    Lag *lag = malloc(sizeof *lag);
    if (lag) start(lag);
    return lag;
}

static inline void step(Lag *lag, double time, double step_size)
{
    double *u = lag->values + U, *y = lag->values + Y;
    for (int i = 0; i < WIDTH; i++) y[i] += step_size * (u[i] - y[i]) / 0.5;
    lag->values[TIME] = time + step_size;
}

static inline void *copy(void *into, const void *state)
{
    if (into == NULL) into = malloc(sizeof(Lag));
    return into ? memcpy(into, state, sizeof(Lag)) : NULL;
}
