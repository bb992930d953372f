"""Interpreter of a flat model.

Reference for tests of the generated C code, and evaluation of default values.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from typing import Any

import numpy as np

from ....core.errors import ComponentError
from ..model.arithmetic import EvaluationError, divide
from ..model.evaluate import Evaluator, convert_to_type
from ..model.flat_model import Model, derivative_name, is_input
from .parameter_roles import classify_parameters
from .schedule import build_schedule, finite_variables, pre_variables, start_value

TICK_TOLERANCE = 1e-6
_MAX_STEP_SIZE = 0.005


class Interpreter:
    """An instance of a model with the life cycle of a block: `set`, `initialize`, `step` and `get`.

    Scalars are float, int or bool, arrays are NumPy arrays.

    Args:
        model: The flat model, with continuous states introduced.

    Raises:
        InputError: The model has structural errors, for example an algebraic loop.
    """

    def __init__(self, model: Model):
        self.model = model
        self.schedule = build_schedule(model)
        self.parameter_roles = classify_parameters(model, self.schedule)
        self._pre_variables = {
            "step": pre_variables(model, self.schedule.event),
            "initialize": pre_variables(model, self.schedule.initialization),
        }
        self._finite_variables = finite_variables(model, self.schedule)
        self.clocks: list[list[Any]] = []
        self.values: dict[str, Any] = {}
        self.evaluate = Evaluator(model.functions, self.values)
        for variable in model.variables.values():
            self.values[variable.name] = convert_to_type(
                1 if variable.type == "Enumeration" else 0, variable.type, variable.shape
            )
        for name in (*self.parameter_roles.settable, *self.parameter_roles.fixed):
            self._assign(name, self._declared_value(name))
        self._update_dependent_parameters()
        self._apply_start_values(inputs=True)

    def set(self, name: str, value: Any) -> None:
        """Set a parameter or an input (arrays as a whole) and update the parameters that depend on it."""
        self._assign(name, value)
        if self.model.variables[name].variability == "parameter":
            self._update_dependent_parameters()

    def get(self, name: str) -> Any:
        """Return a copy of the value of a variable."""
        return deepcopy(self.values[name])

    def initialize(self, time: float = 0.0) -> None:
        """Apply the start values, set the first ticks of the clocks and evaluate the equations at the start time (s).

        Raises:
            ComponentError: The model has failed.
        """
        self._apply_start_values(inputs=False)
        self._start_clocks(time)
        self._evaluate_event("initialize", time)
        self.evaluate.event_flags.clear()

    def _start_clocks(self, time: float) -> None:
        """Set `clocks`, the start (s), the period (s) and the number of past ticks of each clock."""
        self.clocks = []
        for clock in self.schedule.clocks:
            start, period = self.evaluate(clock.start), self.evaluate(clock.period)
            if not period > 0:
                raise ComponentError(
                    self.model.name, "initialize", "the period of sample() must be positive", time
                )
            self.clocks.append(
                [start, period, max(0, math.ceil(divide(time - start, period) - TICK_TOLERANCE))]
            )

    def step(self, time: float, step_size: float) -> None:
        """Execute all ticks t with time <= t < time + step_size.

        A model with continuous states or without clocks is also evaluated at time + step_size.

        Args:
            time: The current time (s).
            step_size: The communication step size (s).

        Raises:
            ComponentError: The model has failed.
        """
        end, reached = time + step_size, self._run_ticks(time, time + step_size)
        if self.model.states or not self.clocks:
            self._integrate(reached, end)
            self.evaluate.event_flags.update({("due", k): False for k in range(len(self.clocks))})
            self._evaluate_event("step", end)

    def _run_ticks(self, time: float, end: float) -> float:
        """Execute all ticks in time <= t < end.

        Return the time of the states after the last one.
        """
        reached = time
        while self.clocks:
            ticks = [start + count * period for start, period, count in self.clocks]
            next_tick = min(ticks)
            if not next_tick < end - TICK_TOLERANCE * min(period for _, period, _ in self.clocks):
                break
            reached = self._integrate(reached, next_tick)
            for k, (clock, tick) in enumerate(zip(self.clocks, ticks, strict=True)):
                self.evaluate.event_flags["due", k] = tick <= next_tick + TICK_TOLERANCE * clock[1]
            self._evaluate_event("step", next_tick)
            for k, clock in enumerate(self.clocks):
                clock[2] += self.evaluate.event_flags["due", k]
        return reached

    def _integrate(self, start: float, end: float) -> float:
        """Integrate the states from `start` to `end` in equal steps of at most 5 ms.

        Return the time of the states.
        """
        count = math.ceil((end - start) / _MAX_STEP_SIZE - 1e-9) if self.model.states else 0
        if count <= 0:
            return start
        h = (end - start) / count
        for k in range(count):
            self._runge_kutta(start + k * h, h)
        return end

    def _runge_kutta(self, time: float, h: float) -> None:
        """Integrate one step of the classical Runge-Kutta method of order 4."""
        start = self._state_values()
        k1 = self._evaluate_derivatives(time)
        k2 = self._evaluate_derivatives(
            time + h / 2, [x + h / 2 * k for x, k in zip(start, k1, strict=True)]
        )
        k3 = self._evaluate_derivatives(
            time + h / 2, [x + h / 2 * k for x, k in zip(start, k2, strict=True)]
        )
        k4 = self._evaluate_derivatives(
            time + h, [x + h * k for x, k in zip(start, k3, strict=True)]
        )
        for name, x, a, b, c, d in zip(self.model.states, start, k1, k2, k3, k4, strict=True):
            self._assign(name, x + h / 6 * (a + 2 * b + 2 * c + d))

    def _state_values(self) -> list[Any]:
        return [self.get(name) for name in self.model.states]

    def _evaluate_derivatives(self, time: float, states: Sequence[Any] | None = None) -> list[Any]:
        """Return the derivatives at a time, for the given states or the current ones."""
        for name, value in zip(self.model.states, states or (), strict=False):
            self._assign(name, value)
        self.values["time"] = time
        with self._as_component_error("step", time), np.errstate(all="ignore"):
            self.evaluate.execute(self.schedule.between.derivatives)
        return [self.get(derivative_name(name)) for name in self.model.states]

    def _declared_value(self, name: str) -> Any:
        binding = self.model.variables[name].binding
        return self.evaluate(binding if binding is not None else start_value(self.model, name))

    def _assign(self, name: str, value: Any) -> None:
        variable = self.model.variables[name]
        self.values[name] = convert_to_type(value, variable.type, variable.shape)

    def _update_dependent_parameters(self) -> None:
        for name in self.parameter_roles.dependent:
            self._assign(name, self._declared_value(name))

    def _apply_start_values(self, inputs: bool) -> None:
        for variable in self.model.variables.values():
            if variable.variability not in ("parameter", "constant") and (
                inputs or not is_input(variable)
            ):
                self._assign(variable.name, self.evaluate(start_value(self.model, variable.name)))

    def _evaluate_event(self, function: str, time: float) -> None:
        """Evaluate the equations at an event (`function` "step") or at the initialization ("initialize")."""
        body = self.schedule.event if function == "step" else self.schedule.initialization
        self.values["time"] = time
        self.evaluate.pre_values = {
            name: deepcopy(self.values[name]) for name in self._pre_variables[function]
        }
        with self._as_component_error(function, time):
            self.evaluate.execute(body)
            if function == "step":
                self._check_finite()

    @contextmanager
    def _as_component_error(self, function: str, time: float) -> Iterator[None]:
        try:
            yield
        except EvaluationError as error:
            raise ComponentError(self.model.name, function, str(error), time) from None

    def _check_finite(self) -> None:
        for name in self._finite_variables:
            if not np.all(np.isfinite(self.values[name])):
                raise EvaluationError(f"{name} is not a finite number")
