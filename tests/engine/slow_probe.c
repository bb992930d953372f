/* The foreign FMI 2.0 probe with a doStep of BUSY_NS processor time, or waiting time with WAIT;
   aborts after FATAL_TIME (s). i_out: largest number of instances that were in doStep at once;
   e_out: 1 if the step ran on another than the main thread. */
#define _GNU_SOURCE
#include <stdatomic.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define fmi2DoStep probe_step
#include "probe2.c"
#undef fmi2DoStep

static atomic_int inside, largest;

static void be_busy(void) {
#ifdef WAIT
    nanosleep(&(struct timespec){0, BUSY_NS}, NULL);
#else
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    const long long end = t.tv_sec * 1000000000LL + t.tv_nsec + BUSY_NS;
    do clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    while (t.tv_sec * 1000000000LL + t.tv_nsec < end);
#endif
}

fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean no_set_state) {
#ifdef FATAL_TIME
    if (t > FATAL_TIME) abort();
#endif
    int now = atomic_fetch_add(&inside, 1) + 1;
    if (now > atomic_load(&largest)) atomic_store(&largest, now);
    be_busy();
    atomic_fetch_sub(&inside, 1);
    fmi2Status status = probe_step(c, t, h, no_set_state);
    ((Probe *)c)->i[1] = atomic_load(&largest);
    ((Probe *)c)->i[3] = syscall(SYS_gettid) != getpid();
    return status;
}
