"""Equations written with CasADi -> C -> a `Block`.

A `ContinuousModel` describes x' = f(x, u, p) with y = g(x, u, p); x may be empty (`static_model`). The generated `model_step`
integrates it with the classical Runge-Kutta method of fourth order in sub-steps of at most `max_sub_step`. Further CasADi
functions can be exported from the same binary, for programs that use the equations without FMI: each becomes

    void NAME(const double *const in[], double *const out[]);

where `in[i]` and `out[i]` point to the elements of the i-th argument and result (column-major; no aliasing between them).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import casadi as ca

from ..component import Variable
from .block import Block, BlockVariable
from .equations_c import Callee, callees, definition
from .equations_glue import INCLUDES, glue


@dataclass(frozen=True)
class ContinuousModel:
    """A continuous model with held inputs.

    `variables` are its parameters, inputs and outputs. Vectors passed to the callables hold the slots of all variables of
    that causality in this order; `outputs` returns them likewise, Boolean outputs as 0 or 1. `states` names the elements of
    the state for messages. `project` is applied after each sub-step (to normalise a quaternion).
    """

    identifier: str
    description: str
    variables: Sequence[Variable]
    states: Sequence[str]
    #: parameters -> state at the start
    initial_state: Callable[[ca.SX], ca.SX]
    #: state, inputs, parameters -> time derivative of the state
    rate: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
    #: state, inputs, parameters -> outputs
    outputs: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
    project: Callable[[ca.SX], ca.SX] = lambda state: state
    step_size: float = 0.01
    max_sub_step: float = 0.005
    resources: Mapping[str, Path] = field(default_factory=dict)
    #: parameters -> what the other callables are given in their place, computed once when the model is initialized
    constants: Callable[[ca.SX], ca.SX] | None = None
    #: how functions that the expressions call are written in C, where it is not their own text
    callees: Sequence[Callee] = ()

    def constant_symbols(self) -> ca.SX:
        """Symbols for what the callables are given as parameters."""
        parameters = ca.SX.sym("parameters", len(self.slots("parameter")))
        return ca.SX.sym("constants", self.constants(parameters).numel()) if self.constants else parameters

    def advance(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX, sub_steps: int = 1) -> ca.SX:
        """The state after `step` (s) with held inputs, in `sub_steps` equal Runge-Kutta steps."""
        for _ in range(sub_steps):
            state = self.project(runge_kutta_4(lambda x: self.rate(x, inputs, parameters), state, step / sub_steps))
        return state

    def slots(self, causality: str) -> list[Variable]:
        """Variables of a causality, repeated for each of their elements."""
        return [variable for variable in self.variables if variable.causality == causality for _ in variable.slots]

    def flags(self) -> list[bool]:
        """For each output slot whether it is Boolean."""
        return [variable.type == "Boolean" for variable in self.slots("output")]


def static_model(
    identifier: str, description: str, variables: Sequence[Variable], outputs: Callable[[ca.SX, ca.SX], ca.SX]
) -> ContinuousModel:
    """A model without states, y = g(u, p): `outputs` maps inputs and parameters to outputs."""
    nothing = ca.SX(0, 1)
    return ContinuousModel(
        identifier,
        description,
        variables,
        (),
        lambda parameters: nothing,
        lambda state, inputs, parameters: nothing,
        lambda state, inputs, parameters: outputs(inputs, parameters),
    )


def runge_kutta_4(rate: Callable[[ca.SX], ca.SX], state: ca.SX, step: ca.SX) -> ca.SX:
    """One step of the classical Runge-Kutta method of fourth order for x' = rate(x)."""
    k1 = rate(state)
    k2 = rate(state + step / 2 * k1)
    k3 = rate(state + step / 2 * k2)
    k4 = rate(state + step * k3)
    return state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def block(model: ContinuousModel, exported: Sequence[ca.Function] = ()) -> Block:
    """The model as a block of C code, with further functions exported from its binary; equal models give equal text."""
    return Block(
        model.identifier,
        model.description,
        [_block_variable(variable, member) for variable, member in _members(model)],
        model.step_size,
        {"model.h": _header(model), "model.c": _source(model, exported)},
        model.resources,
    )


def _members(model: ContinuousModel) -> Iterator[tuple[Variable, str]]:
    """Every variable with the member of `Model` where its first element lies."""
    filled: dict[str, int] = {}
    for variable in model.variables:
        array = "flag" if variable.type == "Boolean" else variable.causality
        first = filled.get(array, 0)
        filled[array] = first + len(variable.slots)
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


def _header(model: ContinuousModel) -> str:
    flags = model.flags()
    sizes = {
        "parameter": len(model.slots("parameter")),
        "constant": model.constant_symbols().numel() if model.constants else 0,
        "input": len(model.slots("input")),
        "state": len(model.states),
        "output": len(flags) - sum(flags),
    }
    members = [f"double {name}[{size}]" for name, size in sizes.items() if size]
    if any(flags):
        members.append(f"bool flag[{sum(flags)}]")
    lines = "\n".join(f"    {member};" for member in members)
    return f"/* {model.description} */\n#include <stdbool.h>\n\ntypedef struct {{\n{lines}\n}} Model;\n"


def _source(model: ContinuousModel, exported: Sequence[ca.Function]) -> str:
    """The text of model.c."""
    own = _functions(model)
    functions = [*callees([*own, *exported], model.callees).values()]
    functions += [definition("static", function) for function in own]
    functions += [definition("MODEL_EXPORT", function) for function in exported]
    return "\n".join([INCLUDES, *functions, glue(model)])


def _functions(model: ContinuousModel) -> list[ca.Function]:
    parameters, constants = ca.SX.sym("parameters", len(model.slots("parameter"))), model.constant_symbols()
    inputs = ca.SX.sym("inputs", len(model.slots("input")))
    state = ca.SX.sym("state", len(model.states))
    step = ca.SX.sym("step")
    outputs = ca.vertsplit(model.outputs(state, inputs, constants))
    flags = model.flags()
    numbers = ca.vertcat(*(y for y, flag in zip(outputs, flags, strict=True) if not flag))
    truths = ca.vertcat(*(y for y, flag in zip(outputs, flags, strict=True) if flag))
    observe = ca.Function("observe", [state, inputs, constants], [numbers, truths])
    if not model.states:
        return [observe]
    prepare = [ca.Function("prepare", [parameters], [model.constants(parameters)])] if model.constants else []
    return [
        *prepare,
        ca.Function("initial_state", [constants], [model.initial_state(constants)]),
        ca.Function("sub_step", [state, inputs, constants, step], [model.advance(state, inputs, constants, step)]),
        observe,
    ]
