/* The state of the process that foreign code may change, as bytes that are compared in a
   microsecond.

   They hold the attributes of cosim/process/process_state.py, which restores those that differ.
   Linux only. */

#define _GNU_SOURCE
#define PY_SSIZE_T_CLEAN
#define Py_LIMITED_API 0x030B0000
#include <Python.h>

#include <errno.h>
#include <fenv.h>
#include <locale.h>
#include <signal.h>
#include <stdint.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/time.h>
#include <unistd.h>

#if defined(__x86_64__)
#include <xmmintrin.h>
/* rounding, flush to zero, denormals are zero, traps; not the sticky flags */
#define MXCSR_CONTROL 0xFFC0u
static unsigned float_control(void) { return _mm_getcsr() & MXCSR_CONTROL; }
#else
static unsigned float_control(void) { return 0; }
#endif

/* bytes; MASK_SIZE: signals 1 to 64, the kernel's size of a mask */
enum { MAX_PATH_SIZE = 4096, MASK_SIZE = 8 };
static const int signals[] = {SIGINT, SIGTERM, SIGSEGV, SIGFPE, SIGABRT, SIGPIPE, SIGCHLD};
static const int timers[] = {ITIMER_REAL, ITIMER_VIRTUAL, ITIMER_PROF};
static const int limits[] = {RLIMIT_AS, RLIMIT_CPU, RLIMIT_DATA, RLIMIT_FSIZE, RLIMIT_NOFILE};
#define LENGTH(array) (sizeof(array) / sizeof *(array))

typedef struct { /* set to 0 first, so that its padding can be compared */
    void *handlers[LENGTH(signals)];
    struct rlimit limits[LENGTH(limits)];
    char mask[MASK_SIZE];
    unsigned float_control, traps, rounding, file_mode_mask;
    char running[LENGTH(timers)], has_free_descriptor;
} Fixed;

static int has_free_descriptor(void) {
    int descriptor = dup(2);
    if (descriptor < 0) return errno != EMFILE;
    close(descriptor);
    return 1;
}

/* The C library reads limits by prlimit64, which takes three times as long as the older system
   call. */
static void read_limit(int resource, struct rlimit *limit) {
#if defined(SYS_getrlimit) && defined(__LP64__)
    syscall(SYS_getrlimit, resource, limit);
#else
    getrlimit(resource, limit);
#endif
}

static void read_fixed(Fixed *state) {
    memset(state, 0, sizeof *state);
    for (size_t i = 0; i < LENGTH(signals); i++) {
        struct sigaction action;
        if (sigaction(signals[i], NULL, &action) == 0)
            memcpy(&state->handlers[i], &action.sa_handler, sizeof(void *));
    }
    for (size_t i = 0; i < LENGTH(limits); i++) read_limit(limits[i], &state->limits[i]);
    for (size_t i = 0; i < LENGTH(timers); i++) {
        struct itimerval value = {0};
        getitimer(timers[i], &value);
        state->running[i] = value.it_value.tv_sec || value.it_value.tv_usec ||
                            value.it_interval.tv_sec || value.it_interval.tv_usec;
    }
    sigset_t mask;
    pthread_sigmask(SIG_BLOCK, NULL, &mask);
    memcpy(state->mask, &mask, MASK_SIZE);
    state->float_control = float_control();
    state->traps = (unsigned)fegetexcept();
    state->rounding = (unsigned)fegetround();
    /* safe for a file that another thread creates now */
    state->file_mode_mask = (unsigned)umask(077);
    umask((mode_t)state->file_mode_mask);
    state->has_free_descriptor = (char)has_free_descriptor();
}

static char *append(char *end, const char *text, size_t size) {
    memcpy(end, text, size);
    return end + size;
}

static PyObject *encode(PyObject *self, PyObject *unused) {
    (void)self, (void)unused;
    Fixed fixed;
    read_fixed(&fixed);
    char path[MAX_PATH_SIZE];
    if (!getcwd(path, sizeof path)) path[0] = '\0'; /* the folder was removed */
    const char *locale = setlocale(LC_ALL, NULL);
    if (!locale) locale = "";
    size_t size = sizeof fixed + strlen(path) + 1 + strlen(locale) + 1;
    for (char **entry = environ; entry && *entry; entry++) size += strlen(*entry) + 1;
    PyObject *result = PyBytes_FromStringAndSize(NULL, (Py_ssize_t)size);
    if (!result) return NULL;
    char *end = append(PyBytes_AsString(result), (const char *)&fixed, sizeof fixed);
    end = append(end, path, strlen(path) + 1);
    end = append(end, locale, strlen(locale) + 1);
    for (char **entry = environ; entry && *entry; entry++)
        end = append(end, *entry, strlen(*entry) + 1);
    return result;
}

static PyMethodDef methods[] = {
    {"encode", encode, METH_NOARGS,
     "Return the present state of the process; equal bytes mean an equal state."},
    {NULL, NULL, 0, NULL},
};

static struct PyModuleDef module = {
    .m_base = PyModuleDef_HEAD_INIT,
    .m_name = "_process_state",
    .m_doc = "The state of the process as bytes.",
    .m_methods = methods,
};

PyMODINIT_FUNC PyInit__process_state(void) { return PyModule_Create(&module); }
