"""Conversion of a continuous model to a `Block`.

Generated functions and the functions of the block interface.
"""

import math
from collections.abc import Iterator, Sequence

import casadi as ca
from casadi import SX

from ...core.component import Variable
from ..fmu.block import Block, BlockVariable
from .c_code import callee_definitions, function_definition
from .exported_interface import interface_code
from .model import ContinuousModel


def as_block(model: ContinuousModel, exported: Sequence[ca.Function] = ()) -> Block:
    """Convert a continuous model to a block of C code; equal models give equal text.

    Args:
        model: The model.
        exported: Further CasADi functions that other programs can call in the FMU's binary (see
            `equations/model.py`).

    Raises:
        ValueError: An operation has no counterpart in C.
    """
    return Block(
        model.identifier,
        model.description,
        [_block_variable(variable, member) for variable, member in _struct_members(model)],
        model.step_size,
        {"model.h": _header_text(model), "model.c": _source_text(model, exported)},
        model.resources,
    )


def _struct_members(model: ContinuousModel) -> Iterator[tuple[Variable, str]]:
    """Yield every variable with the member of `Model` that holds its first element."""
    sizes: dict[str, int] = {}
    for variable in model.variables:
        array = "flag" if variable.type == "Boolean" else variable.causality
        first = sizes.get(array, 0)
        sizes[array] = first + len(variable.scalar_names)
        yield variable, f"{array}[{first}]"


def _block_variable(variable: Variable, member: str) -> BlockVariable:
    return BlockVariable(
        variable.name,
        member,
        variable.type,
        variable.causality,
        variable.variability,
        variable.start,
        variable.unit.name if variable.unit else "",
        variable.shape,
        variable.description,
        variable.minimum,
        variable.maximum,
    )


def _header_text(model: ContinuousModel) -> str:
    flags = model.boolean_outputs()
    sizes = {
        "parameter": len(model.elements("parameter")),
        "constant": model.derived_parameter_symbols().numel() if model.derived_parameters else 0,
        "input": len(model.elements("input")),
        "state": len(model.states),
        "output": len(flags) - sum(flags),
    }
    members = [f"double {name}[{size}]" for name, size in sizes.items() if size]
    if any(flags):
        members.append(f"bool flag[{sum(flags)}]")
    lines = "\n".join(f"    {member};" for member in members)
    return (
        f"/* {model.description} */\n#include <stdbool.h>\n\ntypedef struct {{\n{lines}\n}} "
        "Model;\n"
    )


def _source_text(model: ContinuousModel, exported: Sequence[ca.Function]) -> str:
    """Return the text of model.c."""
    internal = _casadi_functions(model)
    functions = [*callee_definitions([*internal, *exported], model.callees).values()]
    functions += [function_definition("static", function) for function in internal]
    functions += [function_definition("MODEL_EXPORT", function) for function in exported]
    interface = interface_code(model.variables, model.states, exported) if exported else ""
    return "\n".join([_INCLUDES, *functions, _block_interface(model)]) + interface


def _casadi_functions(model: ContinuousModel) -> list[ca.Function]:
    """Return the functions that the block interface calls.

    `observe` and, with states, `initial_state` and `sub_step`.
    """
    parameters, constants = (
        SX.sym("parameters", len(model.elements("parameter"))),
        model.derived_parameter_symbols(),
    )
    inputs = SX.sym("inputs", len(model.elements("input")))
    state = SX.sym("state", len(model.states))
    step = SX.sym("step")
    outputs = ca.vertsplit(model.outputs(state, inputs, constants))
    flags = model.boolean_outputs()
    real_outputs = ca.vertcat(*(y for y, flag in zip(outputs, flags, strict=True) if not flag))
    boolean_outputs = ca.vertcat(*(y for y, flag in zip(outputs, flags, strict=True) if flag))
    observe = ca.Function("observe", [state, inputs, constants], [real_outputs, boolean_outputs])
    if not model.states:
        return [observe]
    prepare = (
        [ca.Function("prepare", [parameters], [model.derived_parameters(parameters)])]
        if model.derived_parameters
        else []
    )
    return [
        *prepare,
        ca.Function("initial_state", [constants], [model.initial_state(constants)]),
        ca.Function(
            "sub_step",
            [state, inputs, constants, step],
            [model.integrate(state, inputs, constants, step)],
        ),
        observe,
    ]


def _block_interface(model: ContinuousModel) -> str:
    """Return the C functions of the block interface."""
    messages = ",\n".join(f'    "the state {name} is not finite"' for name in model.states)
    member = {
        kind: f"m->{kind}" if model.elements(kind) else "NULL" for kind in ("parameter", "input")
    }
    flags = sum(model.boolean_outputs())
    real_outputs = "m->output" if flags < len(model.boolean_outputs()) else "NULL"
    return (_WITH_STATES if model.states else _WITHOUT_STATES) % {
        "messages": messages,
        "states": len(model.states),
        "state": "m->state" if model.states else "NULL",
        "constant": "m->constant" if model.derived_parameters else member["parameter"],
        "prepare": _PREPARE if model.derived_parameters else "",
        "input": member["input"],
        "output": real_outputs,
        "flag_slots": max(flags, 1),
        "take_flags": f"    for (int i = 0; i < {flags}; ++i) m->flag[i] = flags[i] != 0;\n"
        if flags
        else "",
        "starts": _start_assignments(model),
        "max_sub_step": repr(model.max_sub_step),
    }


def _start_assignments(model: ContinuousModel) -> str:
    """Return C assignments of the start values other than zero.

    `model_start` sets all other members to zero.
    """
    lines = []
    for kind in ("parameter", "input"):
        values: list[float] = []
        for variable in model.variables:
            if variable.causality == kind:
                values += _start_values(variable)
        lines += [
            f"    m->{kind}[{k}] = {value!r};\n" for k, value in enumerate(values) if value != 0
        ]
    return "".join(lines)


def _start_values(variable: Variable) -> Sequence[float]:
    count = math.prod(variable.shape)
    if variable.start is None:
        return [0.0] * count
    return [float(value) for value in variable.start] if variable.shape else [float(variable.start)]


_INCLUDES = """#include <math.h>
#include <stddef.h>

#include "export.h"
#include "model.h"
"""

_PUBLISH_TEMPLATE = """static void publish(Model *m)
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

_WITH_STATES = _FAILURES + _PUBLISH_TEMPLATE + _FAILURE + _START + _ADVANCE
_WITHOUT_STATES = _PUBLISH_TEMPLATE + _START + _EVALUATE
