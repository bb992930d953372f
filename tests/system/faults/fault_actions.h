/* A lag T y' = u - y that misbehaves when it is told to, and keeps a record of its calls. Both FMI
   versions share it. */
#ifndef misbehave_h
#define misbehave_h

#include <stddef.h>

enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING };
enum { U, Y, Y_START, T, REALS };

/* "FUNCTION WHEN WHAT": FUNCTION without fmi2 or fmi3, * for any, load or unload for the library
   itself; WHEN the number of that call from 1 on, * for each, @t for the first one at or after t s;
   WHAT a name in fault_actions.c */
typedef struct {
    char where[40], when[24], what[24];
    long count;
    int done;
} Fault;

typedef struct {
    double x[REALS], time, reached, part; /* an early step ends after this part of it */
    /* texts are null pointers, binaries larger than all memory */
    int event, terminate, early, spoiled, speechless, vast;
    Fault fault;
    char name[64], text[96];
} Lag;

Lag *new_lag(const char *name);
void tell(Lag *m, const char *text);
void lag_start(Lag *m);
void lag_step(Lag *m, double t, double h);
/* Record a call and misbehave if it is the one: returns the status that the function has to
   return. */
int enter(Lag *m, const char *function, const char *format, ...)
    __attribute__((format(printf, 3, 4)));
void record_values(char *line, size_t room, const unsigned *references, size_t count,
                   const double *values);

/* Execute an attack of attacks.c and print its outcome. */
void attack(const char *name, const char *target);

/* of each FMI version: the prefix of its functions, and its log callback (any thread may call
   it) */
extern const char PREFIX[];
void say(int status, const char *category, const char *text);

#endif
