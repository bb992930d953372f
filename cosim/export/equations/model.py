"""Equations written with CasADi -> C -> a `Block`.

A `ContinuousModel` describes x' = f(x, u, p) with y = g(x, u, p); x may be empty (`static_model`). The generated `model_step`
integrates it with the classical Runge-Kutta method of fourth order in sub-steps of at most `max_sub_step`. Further CasADi
functions can be exported from the same binary, for programs that use the equations without FMI: each becomes

    void NAME(const double *const in[], double *const out[]);

where `in[i]` and `out[i]` point to the elements of the i-th argument and result (column-major; no aliasing between them).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import casadi as ca

from ...core.component import Variable
from .c_code import Callee


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
    derivatives: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
    #: state, inputs, parameters -> outputs
    outputs: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]
    project: Callable[[ca.SX], ca.SX] = lambda state: state
    step_size: float = 0.01
    max_sub_step: float = 0.005
    resources: Mapping[str, Path] = field(default_factory=dict)
    #: parameters -> what the other callables are given in their place, computed once when the model is initialized
    derived_parameters: Callable[[ca.SX], ca.SX] | None = None
    #: how functions that the expressions call are written in C, where it is not their own text
    callees: Sequence[Callee] = ()

    def derived_parameter_symbols(self) -> ca.SX:
        """Symbols for what the callables are given as parameters."""
        parameters = ca.SX.sym("parameters", len(self.elements("parameter")))
        return ca.SX.sym("constants", self.derived_parameters(parameters).numel()) if self.derived_parameters else parameters

    def integrate(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX, sub_steps: int = 1) -> ca.SX:
        """The state after `step` (s) with held inputs, in `sub_steps` equal Runge-Kutta steps."""
        for _ in range(sub_steps):
            state = self.project(runge_kutta_4(lambda x: self.derivatives(x, inputs, parameters), state, step / sub_steps))
        return state

    def elements(self, causality: str) -> list[Variable]:
        """Variables of a causality, repeated for each of their elements."""
        return [variable for variable in self.variables if variable.causality == causality for _ in variable.scalar_names]

    def boolean_outputs(self) -> list[bool]:
        """For each output slot whether it is Boolean."""
        return [variable.type == "Boolean" for variable in self.elements("output")]


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
