/* Calls of external C functions: errors, memory of Strings, and external objects. */
#ifndef EXTERNAL_H
#define EXTERNAL_H

#include <setjmp.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Calls a C function and returns true, or false if it has called ModelicaError. */
#define EXTERNAL_CALL(call) \
    jmp_buf frame, *const outer = external_frame(&frame); \
    if (setjmp(frame) == 0) { \
        call; \
        external_frame(outer); \
        return true; \
    } \
    external_frame(outer); \
    return false

/* Sets the place to which ModelicaError jumps; returns the previous one. */
jmp_buf *external_frame(jmp_buf *frame);

/* Ends a step of a model: returns the reason for its failure (or NULL) with the text of
 * ModelicaError, appends messages and warnings of external functions to `log` (unless it is NULL)
 * and frees Strings. */
const char *external_reason(const char *reason, char *log, size_t size);

/* External objects
 *
 * An object belongs to an owner (a model) and is a function of the arguments of its constructor.
 * The owner holds its identifier only, which is a hash of the arguments and the number of the
 * object. A copy of the owner's data is therefore a complete state: an object that a restored state
 * needs and that does not exist (any more) is constructed again. */

/* Starts the construction of the objects of an owner: the next object has the number 0. */
void external_begin(void);

/* Returns a hash of `size` bytes, combined with the hash of the preceding arguments. */
uint64_t external_hash(uint64_t hash, const void *bytes, size_t size);
uint64_t external_hash_text(uint64_t hash, const char *text);

/* Returns the identifier of the next object of an owner. An object with this number and other
   arguments is deleted. */
uint64_t external_next(const void *owner, uint64_t hash);

/* Returns an object, or NULL if it does not exist. */
void *external_object(const void *owner, uint64_t identifier);

void external_add(const void *owner, uint64_t identifier, void *object, void (*destructor)(void *));

/* Deletes all objects of an owner. */
void external_delete(const void *owner);

#endif
