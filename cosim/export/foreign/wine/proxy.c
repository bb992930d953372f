/* Library with the functions of FMI 1.0, 2.0 or 3.0 (macro FMI), which forwards them to the worker
   under Wine (protocol.h).

   Macros: FMI, PREFIX (of the function names), WINE (program), WINE_FOLDER (its WINEPREFIX), WORKER
   and DLL (files, relative to the folder of this library). One process of the worker serves all
   instances of the library; it ends when the library is unloaded or the importer ends. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <pthread.h>
#include <signal.h>
#include <spawn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <unistd.h>
#include "protocol.h"

typedef void *Handle;
typedef int Status;
typedef uint32_t Reference;
typedef const char *String;
#if FMI == 3
typedef bool Boolean;
#elif FMI == 2
typedef int Boolean;
#else
typedef char Boolean;
#endif
enum { FMI_OK = 0, FMI_ERROR = 3, FMI_FATAL = 4 };

#define EXPORT __attribute__((visibility("default")))
#define JOIN_(A, B) A##B
#define JOIN(A, B) JOIN_(A, B)
#define TEXT_(A) #A
#define TEXT(A) TEXT_(A)
#define F(NAME) JOIN(PREFIX, NAME)

/* -- log --------------------------------------------------------------------------------------- */

/* Each instance has a key, which is its componentEnvironment in the worker. */
typedef struct Instance {
    struct Instance *next;
    uint64_t key;
    Handle handle;
    char *name;
    void *environment;
    void (*logger)(void *, String, int, String, String, ...);
    void (*log)(void *, int, String, String);
} Instance;

static Instance *instances;
static uint64_t last_key;
static Instance *current; /* instance of the present call */

static void emit(Instance *instance, int status, const char *text) {
    if (!instance) return;
    const char *category = status >= FMI_ERROR ? "logStatusError" : "logAll";
    if (instance->log) instance->log(instance->environment, status, category, text);
    else if (instance->logger)
        instance->logger(FMI == 1 ? instance->handle : instance->environment, instance->name,
                         status, category, "%s", text);
}

static void emit_record(const LogRecord *record, const char *text) {
    Instance *instance = instances;
    while (instance && (instance->key != record->environment || FMI == 1))
        instance = instance->next;
    emit(instance ? instance : current, (int)record->status, text);
}

/* -- worker ------------------------------------------------------------------------------------ */

static pid_t process;
static int to_worker = -1, from_worker = -1;
static bool is_lost;
static pthread_mutex_t mutex = PTHREAD_MUTEX_INITIALIZER;
extern char **environ;

static char *memory; /* request, then reply with the texts that the importer reads */
static size_t memory_size;

static void reserve(size_t size) {
    if (size <= memory_size) return;
    memory_size = 2 * size;
    memory = realloc(memory, memory_size);
    if (!memory) abort();
}

static bool transfer(bool writes, void *data, size_t size) {
    for (char *p = data; size;) {
        ssize_t done = writes ? write(to_worker, p, size) : read(from_worker, p, size);
        if (done < 0 && errno == EINTR) continue;
        if (done <= 0) return false;
        p += done;
        size -= (size_t)done;
    }
    return true;
}

static void stop(void) {
    if (to_worker >= 0) close(to_worker);
    if (from_worker >= 0) close(from_worker);
    to_worker = from_worker = -1;
    if (process) {
        for (int i = 0; i < 200 && !waitpid(process, NULL, WNOHANG); i++) usleep(10000);
        kill(process, SIGKILL);
        waitpid(process, NULL, 0);
    }
    process = 0;
}
__attribute__((destructor)) static void unload(void) { stop(); }

static bool lose(const char *format, ...) {
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    is_lost = true;
    emit(current, FMI_FATAL, text);
    stop();
    return false;
}

/* Receive a reply after the data of `memory`; true if the function was called. */
static bool receive(Reply *reply, const char *function) {
    if (!transfer(false, reply, sizeof *reply))
        return lose("the Windows process ended in %s", function);
    reserve(reply->size + 1);
    if (!transfer(false, memory, reply->size))
        return lose("the Windows process ended in %s", function);
    if (!reply->failed) return true;
    LogRecord *record = (LogRecord *)memory;
    char text[600];
    snprintf(text, sizeof text, "%s: %.*s", function, (int)record->size, (char *)(record + 1));
    return lose("%s", text);
}

static char **worker_environment(void) {
    size_t count = 0, n = 0;
    while (environ[count]) count++;
    char **result = calloc(count + 4, sizeof *result);
    for (size_t i = 0; i < count; i++)
        if (strncmp(environ[i], "WINE", 4)) result[n++] = environ[i];
    result[n++] = "WINEPREFIX=" WINE_FOLDER;
    result[n++] = "WINEDEBUG=-all";
    result[n++] = "WINEDLLOVERRIDES=mscoree,mshtml,winemenubuilder.exe=";
    return result;
}

static bool start(void) {
    Dl_info info;
    char folder[PATH_MAX], worker[PATH_MAX + 64], library[PATH_MAX + 256];
    if (!dladdr((void *)start, &info) || !realpath(info.dli_fname, folder))
        return lose("the library has no path");
    *strrchr(folder, '/') = 0;
    snprintf(worker, sizeof worker, "Z:%s/" WORKER, folder);
    snprintf(library, sizeof library, "Z:%s/" DLL, folder);
    for (char *p = library; *p; p++)
        if (*p == '/') *p = '\\';
    int in[2], out[2];
    if (pipe2(in, O_CLOEXEC)) return lose("no pipe: %s", strerror(errno));
    if (pipe2(out, O_CLOEXEC)) return lose("no pipe: %s", strerror(errno));
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, in[0], 0);
    posix_spawn_file_actions_adddup2(&actions, out[1], 1);
    char *arguments[] = {WINE, worker, library, NULL}, **variables = worker_environment();
    int error = posix_spawn(&process, WINE, &actions, NULL, arguments, variables);
    posix_spawn_file_actions_destroy(&actions);
    free(variables);
    close(in[0]);
    close(out[1]);
    to_worker = in[1];
    from_worker = out[0];
    Reply reply;
    if (error) return process = 0, lose("%s cannot be started: %s", WINE, strerror(error));
    return receive(&reply, "start");
}

/* -- calls ------------------------------------------------------------------------------------- */

typedef struct {
    Argument a;
    void *memory;
} Parameter;

static Parameter number(uint64_t value) { return (Parameter){{VALUE, value, 0, 0}, NULL}; }
static Parameter real(double value) {
    Parameter p = number(0);
    memcpy(&p.a.value, &value, sizeof value);
    return p;
}
static Parameter block(int kind, const void *data, size_t size, size_t count) {
    return data ? (Parameter){{(uint64_t)kind, 0, size, count}, (void *)data} : number(0);
}
static Parameter text(String value) {
    return block(DATA_IN, value, value ? strlen(value) + 1 : 0, 1);
}
static Parameter strings(const String values[], size_t count) {
    size_t size = 0;
    for (size_t i = 0; i < count; i++) size += strlen(values[i] ? values[i] : "") + 1;
    return block(STRINGS_IN, values, size, count);
}
static Parameter binaries(const size_t sizes[], const unsigned char *const values[], size_t count) {
    size_t size = 8 * count;
    for (size_t i = 0; i < count; i++) size += sizes[i];
    return block(BINARIES_IN, values, size, count);
}
#define V(X) number((uint64_t)(uintptr_t)(X))
#define D(X) real(X)
#define I(P, N) block(DATA_IN, P, (N) * sizeof *(P), N)
#define O(P, N) block(DATA_OUT, P, (N) * sizeof *(P), N)

static char *write_data(char *to, const Parameter *p) {
    const char *const *values = p->memory;
    char *begin = to;
    switch (p->a.kind) {
    case DATA_IN:
    case DATA_INOUT: memcpy(to, p->memory, p->a.size); break;
    case STRINGS_IN:
        for (uint64_t i = 0; i < p->a.count; i++) to = stpcpy(to, values[i] ? values[i] : "") + 1;
        break;
    case BINARIES_IN:
        memcpy(to, p[-1].memory, 8 * p->a.count);
        to += 8 * p->a.count;
        for (uint64_t i = 0; i < p->a.count; i++) {
            size_t size = ((size_t *)p[-1].memory)[i];
            memcpy(to, values[i], size);
            to += size;
        }
        break;
    default: return begin;
    }
    return begin + aligned(p->a.size);
}

static char *read_data(char *from, const Parameter *p) {
    if (p->a.kind == DATA_OUT || p->a.kind == DATA_INOUT) {
        memcpy(p->memory, from, p->a.size);
        return from + aligned(p->a.size);
    }
    for (uint64_t i = 0; i < p->a.count && (p->a.kind == STRINGS_OUT || p->a.kind == BINARIES_OUT);
         i++) {
        uint64_t size = *(uint64_t *)from;
        from += sizeof size;
        ((char **)p->memory)[i] = size == UINT64_MAX ? NULL : from;
        from += size == UINT64_MAX ? 0 : aligned(size);
    }
    return from;
}

static uint64_t forward(const char *name, const Parameter *p, size_t count) {
    Request request = {0, count, ""};
    snprintf(request.function, sizeof request.function, "%s", name);
    size_t size = count * sizeof(Argument);
    for (size_t i = 0; i < count; i++)
        if (p[i].a.kind == DATA_IN || p[i].a.kind == DATA_INOUT || p[i].a.kind == STRINGS_IN ||
            p[i].a.kind == BINARIES_IN)
            size += aligned(p[i].a.size);
    request.size = size;
    reserve(sizeof request + size);
    memcpy(memory, &request, sizeof request);
    char *at = memory + sizeof request;
    for (size_t i = 0; i < count; i++, at += sizeof(Argument))
        memcpy(at, &p[i].a, sizeof(Argument));
    for (size_t i = 0; i < count; i++) at = write_data(at, &p[i]);
    Reply reply;
    if (!transfer(true, memory, sizeof request + size))
        return lose("the Windows process ended in %s", name), FMI_FATAL;
    if (!receive(&reply, name)) return FMI_FATAL;
    at = memory;
    for (size_t i = 0; i < count; i++) at = read_data(at, &p[i]);
    for (uint64_t i = 0; i < reply.log_count; i++) {
        LogRecord *record = (LogRecord *)at;
        at += sizeof *record;
        char *copy = strndup(at, record->size);
        at += aligned(record->size);
        emit_record(record, copy);
        free(copy);
    }
    return reply.result;
}

/* Call a function of the worker; `p` ends with an argument of kind END. */
static uint64_t call(const char *name, const Parameter *p) {
    size_t count = 0;
    while (p[count].a.kind != END) count++;
    pthread_mutex_lock(&mutex);
    if (p[0].a.kind == VALUE && p[0].a.value)
        for (current = instances; current && (uint64_t)(uintptr_t)current->handle != p[0].a.value;)
            current = current->next;
    uint64_t result = is_lost ? FMI_FATAL : forward(name, p, count);
    pthread_mutex_unlock(&mutex);
    return result;
}

#define CALL(NAME, ...) call(TEXT(F(NAME)), (Parameter[]){__VA_ARGS__, {{END, 0, 0, 0}, NULL}})
#define FUNCTION(NAME, PARAMETERS, ...) \
    EXPORT Status F(NAME) PARAMETERS { return (Status)CALL(NAME, __VA_ARGS__); }

static Instance *add_instance(String name) {
    Instance *instance = calloc(1, sizeof *instance);
    instance->key = ++last_key;
    instance->name = strdup(name ? name : "");
    instance->next = instances;
    return current = instances = instance;
}
static bool is_started(void) { return process || (!is_lost && start()); }
static Handle complete(Instance *instance, uint64_t handle) {
    instance->handle = (Handle)(uintptr_t)(is_lost ? 0 : handle);
    return instance->handle;
}
static void forget(Handle handle) {
    for (Instance **p = &instances; *p; p = &(*p)->next)
        if ((*p)->handle == handle) {
            Instance *old = *p;
            *p = old->next;
            if (current == old) current = NULL;
            free(old->name);
            free(old);
            return;
        }
}

/* Return a path or a file URI as Windows programs expect it under Wine; the result is overwritten
   by the next call. */
static String windows_path(String path) {
    static char result[PATH_MAX + 64];
    if (!path) return NULL;
    const char *slash = strncmp(path, "file://", 7) ? path : path + 7;
    bool is_uri = slash != path;
    snprintf(result, sizeof result, "%.*s%sZ:%s", (int)(slash - path), path, is_uri ? "/" : "",
             slash);
    for (char *p = result; *p && !is_uri; p++)
        if (*p == '/') *p = '\\';
    return result;
}

#include "functions.h"
