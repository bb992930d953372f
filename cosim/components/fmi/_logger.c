/* The logger of FMI 1.0 and 2.0: formats the message with its arguments and passes it to a function
   with fixed arguments.

   A message may contain directives for which the FMU passed no argument. Therefore the directives
   are formatted one by one: %n is copied like any other text, and a pointer of %s is used only if
   its memory can be read. */
#define _DEFAULT_SOURCE
#define Py_LIMITED_API 0x030b0000
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>
#ifdef __linux__
#include <errno.h>
#include <sys/syscall.h>
#include <unistd.h>
#endif

/* length of a formatted message, and number of its directives that have an argument */
enum { MAX_LENGTH = 8192, MAX_ARGUMENTS = 32, PAGE = 4096, MAX_DIRECTIVE = 32 };

/* receives componentEnvironment, instance name, status and text */
static void (*receiver)(void *, const char *, int, const char *);

static bool is_page_readable(const char *address) {
#ifdef __linux__
    /* the invalid first argument is found only after the kernel has read 8 bytes at the address */
    uintptr_t word = (uintptr_t)address & ~(uintptr_t)7;
    return word && (syscall(SYS_rt_sigprocmask, ~0, word, NULL, 8) == 0 || errno != EFAULT);
#else
    return (uintptr_t)address >= PAGE;
#endif
}

/* Return the length of a text up to `limit`, or -1 if its memory cannot be read. */
static long readable_length(const char *text, size_t limit) {
    for (size_t n = 0; n < limit; n++) {
        if ((n == 0 || ((uintptr_t)(text + n) % PAGE) == 0) && !is_page_readable(text + n))
            return -1;
        if (!text[n]) return (long)n;
    }
    return (long)limit;
}

typedef struct {
    char text[MAX_LENGTH];
    size_t length;
} Buffer;

static void append(Buffer *b, const char *text, size_t length) {
    size_t room = MAX_LENGTH - 1 - b->length;
    if (length > room) length = room;
    memcpy(b->text + b->length, text, length);
    b->length += length;
}

/* Directive: its text up to the conversion character, the length modifier, and the values of
   "*". */
typedef struct {
    char format[MAX_DIRECTIVE];
    char modifier; /* h, H (hh), l, L (ll), j, z, t, D (long double) or 0 */
    char conversion;
} Directive;

/* Read the directive after a "%", with the values of "*"; return the first character after it, or
   NULL if it is none. */
static const char *read_directive(const char *p, Directive *d, va_list *arguments) {
    size_t n = 0;
    d->format[n++] = '%';
    for (; *p && strchr("-+ #0123456789.*", *p); p++) {
        int written = *p == '*' ? snprintf(d->format + n, MAX_DIRECTIVE - n, "%d",
                                           va_arg(*arguments, int) % 1000)
                                : 1;
        if (*p != '*') d->format[n] = *p;
        n += (size_t)written;
        if (n > MAX_DIRECTIVE - 8) return NULL;
    }
    d->modifier = 0;
    for (; *p && strchr("hljztL", *p); p++) {
        d->modifier = *p == 'L' ? 'D' : d->modifier == *p ? (char)(*p - 'a' + 'A') : *p;
        d->format[n++] = *p;
        if (n > MAX_DIRECTIVE - 3) return NULL;
    }
    d->conversion = *p;
    d->format[n++] = *p;
    d->format[n] = 0;
    return *p ? p + 1 : NULL;
}

#define PRINT(TYPE) (length = snprintf(piece, sizeof piece, d->format, va_arg(*arguments, TYPE)))

/* Append the argument of a directive; false if the directive is unknown or its argument cannot be
   used. */
static bool append_argument(Buffer *b, const Directive *d, va_list *arguments) {
    char piece[1024];
    int length = -1;
    if (d->conversion == 's') {
        const char *text = va_arg(*arguments, const char *), *point = strchr(d->format, '.');
        int precision = MAX_LENGTH;
        if (point) sscanf(point + 1, "%d", &precision);
        long size = d->modifier == 'l'
                        ? -1
                        : readable_length(text, precision < 0 ? MAX_LENGTH : (size_t)precision);
        if (size < 0) return false;
        if (d->format[1] == 's' || size >= (long)sizeof piece) {
            append(b, text, (size_t)size);
            return true;
        }
        length = snprintf(piece, sizeof piece, d->format, text);
    } else if (strchr("eEfFgGaA", d->conversion)) {
        d->modifier == 'D' ? PRINT(long double) : PRINT(double);
    } else if (d->conversion == 'p') {
        PRINT(void *);
    } else if (strchr("diuoxXc", d->conversion)) {
        switch (d->modifier) {
        case 'l': PRINT(long); break;
        case 'L': PRINT(long long); break;
        case 'j': PRINT(intmax_t); break;
        case 'z': PRINT(size_t); break;
        case 't': PRINT(ptrdiff_t); break;
        default: PRINT(int);
        }
    }
    if (length < 0) return false;
    append(b, piece, (size_t)length < sizeof piece ? (size_t)length : sizeof piece - 1);
    return true;
}

static void format_message(Buffer *b, const char *message, va_list *arguments) {
    int count = 0;
    while (*message) {
        const char *begin = message, *percent = strchr(message, '%');
        if (!percent || percent[1] == '%') {
            append(b, begin, percent ? (size_t)(percent + 1 - begin) : strlen(begin));
            if (!percent) return;
            message = percent + 2;
            continue;
        }
        append(b, begin, (size_t)(percent - begin));
        Directive d;
        const char *end =
            count++ < MAX_ARGUMENTS ? read_directive(percent + 1, &d, arguments) : NULL;
        message = end ? end : percent + 1;
        if (!end || !append_argument(b, &d, arguments))
            append(b, percent, (size_t)(message - percent));
    }
}

/* Call the receiver, which is Python code, without an exception that the FMU has not handled yet:
   its own calls would fail. PythonFMU sends messages before it handles the exception of a slave. */
static void receive(void *environment, const char *name, int status, const char *text) {
    PyObject *type, *value, *traceback;
    PyGILState_STATE state = PyGILState_Ensure();
    PyErr_Fetch(&type, &value, &traceback);
    receiver(environment, name, status, text);
    PyErr_Restore(type, value, traceback);
    PyGILState_Release(state);
}

static void log_message(void *environment, const char *name, int status, const char *category,
                        const char *message, ...) {
    (void)category;
    if (!receiver) return;
    if (!message || !strchr(message, '%')) {
        receive(environment, name, status, message);
        return;
    }
    Buffer buffer = {.length = 0};
    va_list arguments;
    va_start(arguments, message);
    format_message(&buffer, message, &arguments);
    va_end(arguments);
    buffer.text[buffer.length] = 0;
    receive(environment, name, status, buffer.text);
}

static struct PyModuleDef definition = {
    .m_base = PyModuleDef_HEAD_INIT,
    .m_name = "_logger",
    .m_doc = "Logger of FMI 1.0 and 2.0, which has a variable number of arguments.",
    .m_size = -1,
};

static int add_address(PyObject *module, const char *name, uintptr_t address) {
    PyObject *number = PyLong_FromVoidPtr((void *)address);
    int status = number ? PyModule_AddObjectRef(module, name, number) : -1;
    Py_XDECREF(number);
    return status;
}

PyMODINIT_FUNC PyInit__logger(void) {
    PyObject *module = PyModule_Create(&definition);
    if (!module) return NULL;
    if (add_address(module, "LOGGER", (uintptr_t)log_message) < 0 ||
        add_address(module, "RECEIVER", (uintptr_t)&receiver) < 0) {
        Py_DECREF(module);
        return NULL;
    }
    return module;
}
