/* Messages between the proxy library, which the importer loads, and the worker, which runs the
   FMU's DLL under Wine.

   The proxy writes a request to the worker's standard input, the worker writes a reply to its
   standard output. A request is a `Request`, its `Argument`s, and the data of the arguments that
   have some. A reply is a `Reply`, the data of arguments that return some, and records of log
   messages: a `LogRecord` and its text. All data begin at multiples of 8 bytes. */
#ifndef PROTOCOL_H
#define PROTOCOL_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MAX_ARGUMENTS = 16, MAX_NAME = 192 };

/* kinds of arguments; a null pointer is a VALUE */
enum {
    END,
    VALUE,         /* a number or an opaque pointer */
    DATA_IN,       /* memory that the function reads */
    DATA_OUT,      /* memory that the function writes */
    DATA_INOUT,    /* both */
    STRINGS_IN,    /* array of texts, sent one after the other with their null bytes */
    /* array of `count` texts: in the reply, sizes (8 bytes each) and contents with a null byte
       each */
    STRINGS_OUT,
    BINARIES_IN,   /* array of pointers: the data are sizes and contents */
    /* array of pointers, whose sizes are in the argument before: contents in the reply */
    BINARIES_OUT,
    CALLBACKS,     /* callback functions of FMI 1.0 or 2.0; value: the componentEnvironment */
    LOG_FUNCTION,  /* fmi3LogMessageCallback */
};

typedef struct {
    uint64_t kind, value, size, count; /* size of the data in bytes */
} Argument;

typedef struct {
    uint64_t size, argument_count; /* size: of all that follows `Request` */
    char function[MAX_NAME];
} Request;

/* `failed`: the function does not exist or raised an exception; the only log record gives the
   reason. */
typedef struct {
    uint64_t size, result, failed, log_count;
} Reply;

typedef struct {
    uint64_t environment, status, size;
} LogRecord;

static inline uint64_t aligned(uint64_t size) { return (size + 7) & ~(uint64_t)7; }
#endif
