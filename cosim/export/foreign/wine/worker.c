/* Program for Windows that loads the DLL of an FMU and calls its functions for the proxy library
   (see protocol.h).

   All FMI functions are called through one function type. In the calling convention of x64 Windows,
   a variadic call passes floating-point arguments in both kinds of registers, so that the callee
   finds numbers and pointers where it expects them. Structures are passed by their addresses. */
#include <fcntl.h>
#include <io.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <windows.h>
#include "protocol.h"

typedef struct {
    char *data;
    size_t size, capacity;
} Buffer;

static HANDLE input, output;
static HMODULE library;
static Buffer reply, logs;
static uint64_t log_count;
static char function_name[MAX_NAME];

static void reserve(Buffer *b, size_t size) {
    if (b->size + size <= b->capacity) return;
    b->capacity = 2 * (b->size + size);
    b->data = realloc(b->data, b->capacity);
    if (!b->data) ExitProcess(3);
}
static void append(Buffer *b, const void *data, size_t size) {
    reserve(b, aligned(size));
    if (data) memcpy(b->data + b->size, data, size);
    else memset(b->data + b->size, 0, size);
    b->size += aligned(size);
}

static bool transfer(bool writes, char *data, uint64_t size) {
    while (size) {
        DWORD part = size > 1 << 20 ? 1 << 20 : (DWORD)size, done = 0;
        BOOL ok = writes ? WriteFile(output, data, part, &done, NULL)
                         : ReadFile(input, data, part, &done, NULL);
        if (!ok || !done) return false;
        data += done;
        size -= done;
    }
    return true;
}

static void add_log(void *environment, int status, const char *text) {
    LogRecord record = {(uint64_t)(uintptr_t)environment, (uint64_t)status, strlen(text)};
    append(&logs, &record, sizeof record);
    append(&logs, text, record.size);
    log_count++;
}

static void send_reply(uint64_t result, bool failed) {
    Reply head = {reply.size + logs.size, result, failed, log_count};
    if (!transfer(true, (char *)&head, sizeof head) || !transfer(true, reply.data, reply.size) ||
        !transfer(true, logs.data, logs.size))
        ExitProcess(0);
    reply.size = logs.size = log_count = 0;
}

static void fail(const char *format, ...) {
    char text[512];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    reply.size = logs.size = log_count = 0;
    add_log(NULL, 4, text);
    send_reply(0, true);
}

static LONG WINAPI report_exception(EXCEPTION_POINTERS *pointers) {
    DWORD code = pointers->ExceptionRecord->ExceptionCode;
    fail("exception 0x%08lX%s in the Windows library", code,
         code == EXCEPTION_ACCESS_VIOLATION ? " (access violation)" : "");
    TerminateProcess(GetCurrentProcess(), 1);
    return EXCEPTION_EXECUTE_HANDLER;
}

/* -- callback functions of the FMU ------------------------------------------------------------- */

static void *allocate(size_t count, size_t size) { return calloc(count, size); }
static void release(void *memory) { free(memory); }
static void step_finished(void *instance, int status) {}

static void log_formatted(void *environment, const char *instance, int status, const char *category,
                          const char *format, ...) {
    char text[8192];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format ? format : "", arguments);
    va_end(arguments);
    add_log(environment, status, text);
}
static void log_plain(void *environment, int status, const char *category, const char *text) {
    add_log(environment, status, text ? text : "");
}

/* The members of fmi2CallbackFunctions; those of FMI 1.0 are the first four. */
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *environment;
} Callbacks;

static Callbacks *make_callbacks(uint64_t environment) {
    /* FMI 2.0 may keep the pointer: never freed */
    Callbacks *callbacks = malloc(sizeof *callbacks);
    *callbacks = (Callbacks){log_formatted, allocate, release, step_finished,
                             (void *)(uintptr_t)environment};
    return callbacks;
}

/* -- calls ------------------------------------------------------------------------------------- */

/* Return the argument that the function receives, and advance `data` behind the data of the
   request. */
static uint64_t unpack(const Argument *a, char **data) {
    char *own = *data;
    if (a->kind == DATA_IN || a->kind == DATA_INOUT || a->kind == STRINGS_IN ||
        a->kind == BINARIES_IN)
        *data += aligned(a->size);
    switch (a->kind) {
    case VALUE: return a->value;
    case CALLBACKS: return (uint64_t)(uintptr_t)make_callbacks(a->value);
    case LOG_FUNCTION: return (uint64_t)(uintptr_t)log_plain;
    case DATA_IN:
    case DATA_INOUT: return (uint64_t)(uintptr_t)own;
    case DATA_OUT: return (uint64_t)(uintptr_t)calloc(1, a->size + 8);
    }
    char **pointers = calloc(a->count + 1, sizeof *pointers);
    char *text = own + (a->kind == BINARIES_IN ? 8 * a->count : 0);
    for (uint64_t i = 0; i < a->count && (a->kind == STRINGS_IN || a->kind == BINARIES_IN); i++) {
        pointers[i] = text;
        text += a->kind == STRINGS_IN ? strlen(text) + 1 : ((uint64_t *)own)[i];
    }
    return (uint64_t)(uintptr_t)pointers;
}

/* Append what the function wrote to the reply, and free the memory of the argument. */
static void pack(const Argument *a, uint64_t value, const size_t *sizes_before) {
    char **pointers = (char **)(uintptr_t)value;
    if (a->kind == DATA_OUT || a->kind == DATA_INOUT) append(&reply, pointers, a->size);
    if (a->kind == STRINGS_OUT || a->kind == BINARIES_OUT)
        for (uint64_t i = 0; i < a->count; i++) {
            uint64_t size = !pointers[i]             ? 0
                            : a->kind == STRINGS_OUT ? strlen(pointers[i]) + 1
                                                     : sizes_before[i];
            uint64_t known = pointers[i] || a->kind == BINARIES_OUT ? size : UINT64_MAX;
            append(&reply, &known, sizeof known);
            append(&reply, size ? pointers[i] : "", size);
        }
    if (a->kind >= STRINGS_IN && a->kind <= BINARIES_OUT) free(pointers);
}

static void execute(const Argument arguments[], size_t count, char *data) {
    FARPROC function = GetProcAddress(library, function_name);
    if (!function) {
        fail("the Windows library does not export %s", function_name);
        return;
    }
    uint64_t v[MAX_ARGUMENTS] = {0};
    double d[MAX_ARGUMENTS];
    for (size_t i = 0; i < count; i++) v[i] = unpack(&arguments[i], &data);
    memcpy(d, v, sizeof d);
    uint64_t (*call)(void *, ...) = (uint64_t(*)(void *, ...))function;
    uint64_t result = call((void *)(uintptr_t)v[0], d[1], d[2], d[3], v[4], v[5], v[6], v[7], v[8],
                           v[9], v[10], v[11], v[12], v[13], v[14], v[15]);
    for (size_t i = 0; i < count; i++)
        pack(&arguments[i], v[i], i ? (const size_t *)(uintptr_t)v[i - 1] : NULL);
    for (size_t i = 0; i < count; i++)
        if (arguments[i].kind == DATA_OUT) free((void *)(uintptr_t)v[i]);
    send_reply(result, false);
}

int main(int argc, char **argv) {
    if (argc < 2) return 2;
    SetErrorMode(SEM_FAILCRITICALERRORS | SEM_NOGPFAULTERRORBOX | SEM_NOOPENFILEERRORBOX);
    SetUnhandledExceptionFilter(report_exception);
    HANDLE self = GetCurrentProcess();
    DuplicateHandle(self, GetStdHandle(STD_INPUT_HANDLE), self, &input, 0, FALSE,
                    DUPLICATE_SAME_ACCESS);
    DuplicateHandle(self, GetStdHandle(STD_OUTPUT_HANDLE), self, &output, 0, FALSE,
                    DUPLICATE_SAME_ACCESS);
    _dup2(2, 1); /* what the FMU prints must not get between the replies */
    SetStdHandle(STD_OUTPUT_HANDLE, GetStdHandle(STD_ERROR_HANDLE));
    library = LoadLibraryExA(argv[1], NULL, LOAD_WITH_ALTERED_SEARCH_PATH);
    if (!library) {
        DWORD error = GetLastError();
        fail("the Windows library cannot be loaded: error %lu%s", error,
             error == ERROR_MOD_NOT_FOUND    ? " (a library that it needs does not exist)"
             : error == ERROR_NOACCESS       ? " (it crashed while it was loaded)"
             : error == ERROR_DLL_INIT_FAILED ? " (its initialization failed)"
                                             : "");
        return 1;
    }
    send_reply(0, false);
    Buffer request = {0};
    Request head;
    while (transfer(false, (char *)&head, sizeof head)) {
        request.size = 0;
        reserve(&request, head.size);
        if (!transfer(false, request.data, head.size) || head.argument_count > MAX_ARGUMENTS)
            return 1;
        memcpy(function_name, head.function, sizeof function_name);
        execute((Argument *)request.data, head.argument_count,
                request.data + head.argument_count * sizeof(Argument));
    }
    return 0;
}
