/* External functions: the functions of ModelicaUtilities.h, and the table of external objects. */
#include "external.h"

#include "ModelicaUtilities.h"

#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- errors and messages --------------------------------------------------------------------- */

static _Thread_local jmp_buf *current_frame;
static _Thread_local char error_text[512];
static _Thread_local char messages[512]; /* and warnings, since the last step */

jmp_buf *external_frame(jmp_buf *frame)
{
    jmp_buf *previous = current_frame;
    current_frame = frame;
    return previous;
}


/* Appends a text of one line to a buffer; several texts are separated by "; ". */
static void append(char *buffer, size_t size, const char *format, va_list arguments)
{
    size_t length = strlen(buffer);
    if (length > 0 && length + 2 < size)
        length += (size_t)snprintf(buffer + length, size - length, "; ");
    vsnprintf(buffer + length, size - length, format, arguments);
    for (size_t end = strlen(buffer); end > 0 && buffer[end - 1] == '\n'; end--)
        buffer[end - 1] = '\0';
    for (char *c = buffer; *c != '\0'; c++)
        if (*c == '\n') *c = ' ';
}

void ModelicaVFormatError(const char *format, va_list arguments)
{
    error_text[0] = '\0';
    append(error_text, sizeof error_text, format, arguments);
    if (current_frame == NULL) abort();
    longjmp(*current_frame, 1);
}

void ModelicaFormatError(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    ModelicaVFormatError(format, arguments);
}

void ModelicaError(const char *text) { ModelicaFormatError("%s", text); }

void ModelicaVFormatMessage(const char *format, va_list arguments)
{
    append(messages, sizeof messages, format, arguments);
}

void ModelicaFormatMessage(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    ModelicaVFormatMessage(format, arguments);
    va_end(arguments);
}

void ModelicaMessage(const char *text) { ModelicaFormatMessage("%s", text); }
void ModelicaVFormatWarning(const char *format, va_list arguments)
{
    ModelicaVFormatMessage(format, arguments);
}

void ModelicaFormatWarning(const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    ModelicaVFormatMessage(format, arguments);
    va_end(arguments);
}

void ModelicaWarning(const char *text) { ModelicaFormatMessage("%s", text); }

/* ---- Strings --------------------------------------------------------------------------------- */

typedef struct String {
    struct String *next;
    char text[];
} String;

static _Thread_local String *strings;

char *ModelicaAllocateStringWithErrorReturn(size_t length)
{
    String *string = calloc(1, sizeof *string + length + 1);
    if (string == NULL) return NULL;
    string->next = strings;
    strings = string;
    return string->text;
}

char *ModelicaAllocateString(size_t length)
{
    char *text = ModelicaAllocateStringWithErrorReturn(length);
    if (text == NULL) ModelicaError("out of memory");
    return text;
}

char *ModelicaDuplicateStringWithErrorReturn(const char *text)
{
    char *copy = ModelicaAllocateStringWithErrorReturn(strlen(text));
    return copy == NULL ? NULL : strcpy(copy, text);
}

char *ModelicaDuplicateString(const char *text)
{
    return strcpy(ModelicaAllocateString(strlen(text)), text);
}

static void free_strings(void)
{
    while (strings != NULL) {
        String *next = strings->next;
        free(strings);
        strings = next;
    }
}

const char *external_reason(const char *reason, char *log, size_t size)
{
    static _Thread_local char text[2 * sizeof error_text];
    const size_t length = log == NULL ? 0 : strlen(log);
    if (log != NULL && messages[0] != '\0')
        snprintf(log + length, size - length, "%s%s", length > 0 ? "; " : "", messages);
    messages[0] = '\0';
    if (reason != NULL && error_text[0] != '\0') {
        snprintf(text, sizeof text, "%s: %s", reason, error_text);
        reason = text;
    }
    error_text[0] = '\0';
    free_strings();
    return reason;
}

/* ---- external objects ------------------------------------------------------------------------ */

typedef struct {
    const void *owner;
    uint64_t identifier; /* the last 16 bits are the number of the object */
    void *object;
    void (*destructor)(void *);
} Object;

enum { NUMBER_MASK = 0xFFFF };

static Object *objects;
static size_t object_count;
static atomic_flag lock = ATOMIC_FLAG_INIT; /* instances may be in different threads */
static _Thread_local uint16_t next_number;

static void acquire(void)
{
    while (atomic_flag_test_and_set_explicit(&lock, memory_order_acquire)) {}
}

static void release(void) { atomic_flag_clear_explicit(&lock, memory_order_release); }

void external_begin(void) { next_number = 0; }

uint64_t external_hash(uint64_t hash, const void *bytes, size_t size)
{
    const unsigned char *byte = bytes;
    for (size_t k = 0; k < size; k++) hash = (hash ^ byte[k]) * 0x100000001B3;
    return hash;
}

uint64_t external_hash_text(uint64_t hash, const char *text)
{
    return external_hash(hash, text, strlen(text) + 1);
}

/* Removes the objects of an owner with a number, or all if the number is negative, except the one
   with the identifier `kept`. */
static void delete(const void *owner, int32_t number, uint64_t kept)
{
    for (size_t k = 0;; k++) {
        acquire();
        while (k < object_count &&
               (objects[k].owner != owner || objects[k].identifier == kept ||
                (number >= 0 && (objects[k].identifier & NUMBER_MASK) != (uint64_t)number)))
            k++;
        if (k >= object_count) break;
        const Object found = objects[k];
        objects[k--] = objects[--object_count];
        release();
        jmp_buf frame, *const outer = external_frame(&frame);
        if (found.destructor != NULL && setjmp(frame) == 0) found.destructor(found.object);
        external_frame(outer);
    }
    release();
}

uint64_t external_next(const void *owner, uint64_t hash)
{
    const uint16_t number = next_number++;
    const uint64_t identifier = (hash & ~(uint64_t)NUMBER_MASK) | number;
    delete(owner, number, identifier);
    return identifier;
}

void *external_object(const void *owner, uint64_t identifier)
{
    void *object = NULL;
    acquire();
    for (size_t k = 0; k < object_count && object == NULL; k++)
        if (objects[k].owner == owner && objects[k].identifier == identifier)
            object = objects[k].object;
    release();
    return object;
}

void external_add(const void *owner, uint64_t identifier, void *object, void (*destructor)(void *))
{
    acquire();
    Object *longer = realloc(objects, (object_count + 1) * sizeof *objects);
    if (longer != NULL) {
        objects = longer;
        objects[object_count++] = (Object){owner, identifier, object, destructor};
    }
    release();
    if (longer == NULL) ModelicaError("out of memory");
}

void external_delete(const void *owner) { delete(owner, -1, 0); }
