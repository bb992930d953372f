/* Messages with values that are inserted at run time. */
#ifndef MESSAGES_H
#define MESSAGES_H

#include "runtime.h"

#include <stdarg.h>
#include <stdio.h>

/* Records a failure with a composed reason, unless there was a failure before. */
static inline void fail_with(Model *m, const char *format, ...)
{
    if (m->failure != 0) return;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(m->reason, sizeof m->reason, format, arguments);
    va_end(arguments);
    m->failure = COMPOSED_REASON;
}

/* Stores a warning if its condition was not violated before; several warnings are separated
   by "; ". */
static inline void warn(Model *m, bool violated, bool *before, const char *format, ...)
{
    const size_t length = strlen(m->warning);
    if (violated && !*before) {
        va_list arguments;
        va_start(arguments, format);
        snprintf(m->warning + length, sizeof m->warning - length, "%s", length > 0 ? "; " : "");
        vsnprintf(m->warning + strlen(m->warning), sizeof m->warning - strlen(m->warning), format,
                  arguments);
        va_end(arguments);
    }
    *before = violated;
}

#ifdef MODEL_TERMINATES
/* Requests the end of the simulation; the message is that of a warning. */
static inline void request_termination(Model *m, const char *format, ...)
{
    const size_t length = strlen(m->warning);
    va_list arguments;
    if (m->terminated) return;
    va_start(arguments, format);
    snprintf(m->warning + length, sizeof m->warning - length, "%s", length > 0 ? "; " : "");
    vsnprintf(m->warning + strlen(m->warning), sizeof m->warning - strlen(m->warning), format,
              arguments);
    va_end(arguments);
    m->terminated = true;
}
#endif

static inline const char *truth(bool value) { return value ? "true" : "false"; }

#endif
