"""Continuous models whose equations are CasADi expressions.

A `ContinuousModel` describes x' = f(x, u, p) and y = g(x, u, p) with state x, inputs u, parameters
p and outputs y. It may have no state (`static_model`). The generated `model_step` integrates it
with the classical Runge-Kutta method of order 4, in sub-steps of at most `max_sub_step`.

Further CasADi functions can be exported from the FMU's binary for programs that use the equations
without FMI. Each becomes

    void NAME(const double *const in[], double *const out[]);

where `in[i]` and `out[i]` point to the elements of argument i and result i in column-major order.
Arguments and results must not overlap in memory.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import casadi as ca
from casadi import SX

from ...core.component import Variable
from .c_code import Callee, call_in_c


@dataclass(frozen=True)
class ContinuousModel:
    """A continuous model with inputs that are constant during a step.

    The callables take and return column vectors. A vector of inputs, parameters or outputs contains
    the elements of all variables of this causality in the order of `variables`.
    """

    #: C identifier
    identifier: str
    description: str
    #: parameters, inputs and outputs
    variables: Sequence[Variable]
    #: names of the elements of the state, for error messages
    states: Sequence[str]
    #: parameters -> initial state
    initial_state: Callable[[SX], SX]
    #: state, inputs, parameters -> time derivative of the state
    derivatives: Callable[[SX, SX, SX], SX]
    #: state, inputs, parameters -> outputs; Boolean outputs as 0 or 1
    outputs: Callable[[SX, SX, SX], SX]
    #: state -> state, applied after each sub-step, for example to normalize a quaternion
    project: Callable[[SX], SX] = lambda state: state
    #: preferred communication step size (s)
    step_size: float = 0.01
    #: longest integration step (s)
    max_sub_step: float = 0.005
    #: name in the FMU's `resources/` folder -> file
    resources: Mapping[str, Path] = field(default_factory=dict)
    #: parameters -> derived parameters, computed once at initialization; the other callables get
    #: these instead of `parameters`
    derived_parameters: Callable[[SX], SX] | None = None
    #: functions with a hand-written C body that the expressions call
    callees: Sequence[Callee] = ()

    def with_called_derivatives(self) -> Self:
        """Return the model with its derivatives as one function in C.

        All stages of the integration call it, so that the code is small.
        """
        symbols = [
            SX.sym("state", len(self.states)),
            SX.sym("inputs", len(self.elements("input"))),
            self.derived_parameter_symbols(),
        ]
        rate = ca.Function("rate_of_change", symbols, [self.derivatives(*symbols)])
        return replace(self, derivatives=lambda *arguments: call_in_c(rate, *arguments)[0])

    def derived_parameter_symbols(self) -> SX:
        """Return symbols of the derived parameters.

        Without derived ones they are those of the parameters themselves.
        """
        parameters = SX.sym("parameters", len(self.elements("parameter")))
        return (
            SX.sym("constants", self.derived_parameters(parameters).numel())
            if self.derived_parameters
            else parameters
        )

    def integrate(self, state: SX, inputs: SX, parameters: SX, step: SX, sub_steps: int = 1) -> SX:
        """Return the state after a step with constant inputs.

        Args:
            state: The state at the start of the step.
            inputs: The inputs.
            parameters: The derived parameters if the model has them, else the parameters.
            step: The step size (s).
            sub_steps: The number of equal Runge-Kutta steps.
        """
        for _ in range(sub_steps):
            state = self.project(
                runge_kutta_4(
                    lambda x: self.derivatives(x, inputs, parameters), state, step / sub_steps
                )
            )
        return state

    def elements(self, causality: str) -> list[Variable]:
        """Return the variables of a causality, each repeated for every element of its array."""
        elements: list[Variable] = []
        for variable in self.variables:
            if variable.causality == causality:
                elements += [variable] * len(variable.scalar_names)
        return elements

    def boolean_outputs(self) -> list[bool]:
        """Return for each element of the output vector whether it is Boolean."""
        return [variable.type == "Boolean" for variable in self.elements("output")]


def static_model(
    identifier: str,
    description: str,
    variables: Sequence[Variable],
    outputs: Callable[[SX, SX], SX],
) -> ContinuousModel:
    """Create a model without states, y = g(u, p).

    Args:
        identifier: The model identifier, a C identifier.
        description: The description of the model.
        variables: Its parameters, inputs and outputs.
        outputs: inputs, parameters -> outputs, as column vectors.
    """
    no_state = SX(0, 1)
    return ContinuousModel(
        identifier,
        description,
        variables,
        (),
        lambda _parameters: no_state,
        lambda _state, _inputs, _parameters: no_state,
        lambda _state, inputs, parameters: outputs(inputs, parameters),
    )


def runge_kutta_4(rate: Callable[[SX], SX], state: SX, step: SX) -> SX:
    """Return the state after a step of the Runge-Kutta method of order 4 for x' = rate(x)."""
    k1 = rate(state)
    k2 = rate(state + step / 2 * k1)
    k3 = rate(state + step / 2 * k2)
    k4 = rate(state + step * k3)
    return state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
