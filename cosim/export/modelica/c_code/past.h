/* Past values of the arguments of delay(), with linear interpolation. */
#ifndef PAST_H
#define PAST_H

#include "runtime.h"

/* Appends a value. A value replaces the last one if the one before it is younger than `spacing`.
   Two values at one time are a jump. */
static inline void record_value(Past *p, double time, double value, double spacing)
{
    const int last = (p->first + p->count - 1) % PAST_VALUES,
              before = (p->first + p->count - 2) % PAST_VALUES;
    if (p->count > 0 && p->time[last] == time && p->value[last] == value) return;
    int place = (p->first + p->count) % PAST_VALUES;
    if (p->count > 1 && p->time[last] < time && time - p->time[before] < spacing &&
        p->time[before] < p->time[last])
        place = last;
    else if (p->count < PAST_VALUES) p->count++;
    else p->first = (p->first + 1) % PAST_VALUES;
    p->time[place] = time;
    p->value[place] = value;
}

static inline double past_value(const Past *p, double time)
{
    int low = 0, high = p->count;
    const double at = time + 1e-12 * (1 + fabs(time));
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (p->time[(p->first + middle) % PAST_VALUES] <= at) low = middle;
        else high = middle;
    }
    const int k = (p->first + low) % PAST_VALUES, next = (p->first + low + 1) % PAST_VALUES;
    if (low + 1 >= p->count || time <= p->time[k]) return p->value[k];
    return p->value[k] +
           (p->value[next] - p->value[k]) * ((time - p->time[k]) / (p->time[next] - p->time[k]));
}

#endif
