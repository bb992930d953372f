/* The foreign FMI 2.0 probe, whose doStep takes BUSY_NS of processor time, or of waiting; FATAL_TIME: when it aborts.
   i_out: the most instances of this file that ever were in doStep at once; e_out: 1 on another thread than the first one. */
#define _GNU_SOURCE
#include <stdatomic.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#define fmi2DoStep probe_step
#include "probe2.c"
#undef fmi2DoStep

static atomic_int inside, most;

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
    if (now > atomic_load(&most)) atomic_store(&most, now);
    be_busy();
    atomic_fetch_sub(&inside, 1);
    fmi2Status status = probe_step(c, t, h, no_set_state);
    ((Probe *)c)->i[1] = atomic_load(&most);
    ((Probe *)c)->i[3] = syscall(SYS_gettid) != getpid();
    return status;
}
