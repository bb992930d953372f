"""C code around the functions generated from equations: the interface of a `Block`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..component import Variable

if TYPE_CHECKING:
    from .equations import ContinuousModel


def glue(model: ContinuousModel) -> str:
    """The functions of the block's interface; they call `observe` and, with states, `initial_state` and `sub_step`."""
    messages = ",\n".join(f'    "the state {name} is not finite"' for name in model.states)
    member = {kind: f"m->{kind}" if model.slots(kind) else "NULL" for kind in ("parameter", "input")}
    flags = sum(model.flags())
    numbers = "m->output" if flags < len(model.flags()) else "NULL"
    return (_WITH_STATES if model.states else _WITHOUT_STATES) % {
        "messages": messages,
        "states": len(model.states),
        "state": "m->state" if model.states else "NULL",
        "constant": "m->constant" if model.constants else member["parameter"],
        "prepare": _PREPARE if model.constants else "",
        "input": member["input"],
        "output": numbers,
        "flag_slots": max(flags, 1),
        "take_flags": f"    for (int i = 0; i < {flags}; ++i) m->flag[i] = flags[i] != 0;\n" if flags else "",
        "starts": _starts(model),
        "max_sub_step": repr(model.max_sub_step),
    }


def _starts(model: ContinuousModel) -> str:
    """Assignments of the start values that differ from zero; the rest of the structure is cleared before."""
    lines = []
    for kind in ("parameter", "input"):
        values = [start for v in model.variables if v.causality == kind for start in _start(v)]
        lines += [f"    m->{kind}[{k}] = {value!r};\n" for k, value in enumerate(values) if value != 0]
    return "".join(lines)


def _start(variable: Variable) -> Sequence[float]:
    count = math.prod(variable.shape)
    if variable.start is None:
        return [0.0] * count
    return [float(value) for value in variable.start] if variable.shape else [float(variable.start)]


INCLUDES = """#include <math.h>
#include <stddef.h>

#include "export.h"
#include "model.h"
"""

_PUBLISH = """static void publish(Model *m)
{
    double flags[%(flag_slots)d];
    const double *in[] = {%(state)s, %(input)s, %(constant)s};
    double *out[] = {%(output)s, flags};
    observe(in, out);
%(take_flags)s}

"""

_START = """void model_start(Model *m)
{
    *m = (Model){0};
%(starts)s}

void model_parameters(Model *m)
{
    (void)m; /* nothing depends on parameters before initialization */
}

"""

_FAILURES = """static const char *const FAILURES[] = {
%(messages)s
};

"""

_FAILURE = """static const char *failure(const Model *m)
{
    for (int i = 0; i < %(states)d; ++i)
        if (!isfinite(m->state[i])) return FAILURES[i];
    return NULL;
}

"""

_PREPARE = """    {
        const double *parameters[] = {m->parameter};
        double *constants[] = {m->constant};
        prepare(parameters, constants);
    }
"""

_ADVANCE = """const char *model_initialize(Model *m, double time)
{
    const double *in[] = {%(constant)s};
    double *out[] = {m->state};
    (void)time;
%(prepare)s    initial_state(in, out);
    publish(m);
    return failure(m);
}

const char *model_step(Model *m, double time, double step_size)
{
    const long count = (long)fmax(1.0, ceil(step_size / %(max_sub_step)s - 1e-9));
    const double sub_step_size = step_size / (double)count;
    double next[%(states)d];
    const double *in[] = {m->state, %(input)s, %(constant)s, &sub_step_size};
    double *out[] = {next};
    (void)time;
    for (long k = 0; k < count; ++k) {
        sub_step(in, out);
        for (int i = 0; i < %(states)d; ++i) m->state[i] = next[i];
    }
    publish(m);
    return failure(m);
}
"""

_EVALUATE = """const char *model_initialize(Model *m, double time)
{
    (void)time;
    publish(m);
    return NULL;
}

const char *model_step(Model *m, double time, double step_size)
{
    (void)time;
    (void)step_size;
    publish(m);
    return NULL;
}
"""

_WITH_STATES = _FAILURES + _PUBLISH + _FAILURE + _START + _ADVANCE
_WITHOUT_STATES = _PUBLISH + _START + _EVALUATE
