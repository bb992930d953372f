"""Interpreter of flat Modelica models, the reference for the generated C code.

It performs the same operations in the same order, so that all results are equal bit for bit.
"""

from __future__ import annotations

import math
from collections import ChainMap
from collections.abc import Callable, Iterator, MutableMapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from cosim.core.errors import ComponentError
from cosim.export.modelica import ModelicaOptions, assemble
from cosim.export.modelica.causality.analysed_model import AnalysedModel
from cosim.export.modelica.causality.computation_order import finite_variables, pre_variables
from cosim.export.modelica.frontend.rumoca_frontend import DEFAULT_OPTIONS
from cosim.export.modelica.model.arithmetic import EvaluationError, divide
from cosim.export.modelica.model.evaluate import Evaluator
from cosim.export.modelica.model.flat_model import derivative_name
from cosim.export.modelica.model.syntax_tree import Builtin, EdgeDetector, Solve

#: constants of newton.h
NEWTON_ITERATIONS, SMALLEST_FRACTION, RESIDUAL_ROUNDING = 100, 1e-6, 1e-13
TICK_TOLERANCE = 1e-6
_MAX_STEP_SIZE = 0.005


@dataclass
class EventEvaluator(Evaluator):
    """Evaluator of a schedule, with event flags, pre() and systems of equations."""

    #: variable -> value before the current event
    pre_values: MutableMapping[str, Any] = field(default_factory=dict)
    #: ("due", k): clock k ticks in the current event; ("risen", k): edge detector k has detected a
    #: rising edge
    event_flags: dict[tuple[str, int], bool] = field(default_factory=dict)
    #: edge detector -> its condition at the previous event
    previous_conditions: dict[int, bool] = field(default_factory=dict)
    #: value of the argument of delay() number k at a past time
    past: Callable[[int, float], float] = lambda _index, _time: 0.0

    def _solve(self, node: Solve) -> None:
        """Solve a system of equations as in newton.h."""
        fraction, merit, scale, changes = 1.0, math.inf, [math.inf] * len(node.unknowns), None
        for _ in range(NEWTON_ITERATIONS):
            residual = [float(self(item)) for item in node.residuals]
            if changes and not (
                largest_ratio(residual, scale) <= merit
                or largest_ratio(residual, scale) <= RESIDUAL_ROUNDING
            ):
                fraction /= 2
                for unknown, change in zip(node.unknowns, changes, strict=True):
                    self._store(unknown, float(self(unknown)) + fraction * change)
                if not fraction > SMALLEST_FRACTION:
                    break
                continue
            jacobian = [list(map(float, map(self, row))) for row in node.jacobian]
            values = [float(self(unknown)) for unknown in node.unknowns]
            scale = [_scale_of(row, values) for row in jacobian]
            merit, fraction = largest_ratio(residual, scale), 1.0
            changes = solve_linear(jacobian, residual)
            if changes is None:
                break
            largest = 0.0
            for unknown, before, change in zip(node.unknowns, values, changes, strict=True):
                value = before - change
                self._store(unknown, value)
                ratio = divide(abs(change), 1 + abs(value))
                if not ratio <= largest:
                    largest = ratio
            if largest <= 1e-11:
                return
            if not math.isfinite(largest):
                break
        raise EvaluationError("a system of equations has no solution", node.where)

    def _edgedetector(self, node: EdgeDetector) -> None:
        condition = bool(self(node.condition))
        self.event_flags["risen", node.index] = condition and not self.previous_conditions.get(
            node.index, True
        )
        self.previous_conditions[node.index] = condition

    def _builtin(self, node: Builtin) -> Any:
        if node.name in ("due", "risen"):
            return self.event_flags[node.name, self(node.arguments[0])]
        if node.name in ("pre", "edge", "change"):
            return self._evaluate_pre(node)
        if node.name == "past":
            return self.past(
                int(self(node.arguments[0])), self.values["time"] - self(node.arguments[1])
            )
        return super()._builtin(node)

    def _evaluate_pre(self, node: Builtin) -> Any:
        previous = Evaluator(self.functions, ChainMap(self.pre_values, self.values))(
            node.arguments[0]
        )
        if node.name == "pre":
            return previous
        current = self(node.arguments[0])
        return (current and not previous) if node.name == "edge" else current != previous


def _scale_of(derivatives: list[float], values: list[float]) -> float:
    """Return the scale of a residual, the sum of |derivative| (1 + |unknown|), as newton.h."""
    scale = 0.0
    for derivative, value in zip(derivatives, values, strict=True):
        scale += abs(derivative) * (1 + abs(value))
    return scale


def solve_linear(a: list[list[float]], b: list[float]) -> list[float] | None:
    """Return the solution of a linear system, with the operations of newton.h in the same order.

    None if it is singular.
    """
    n = len(b)
    for column in range(n):
        pivot = column
        for row in range(column + 1, n):
            if abs(a[row][column]) > abs(a[pivot][column]):
                pivot = row
        if not abs(a[pivot][column]) > 0:
            return None
        a[column], a[pivot], b[column], b[pivot] = a[pivot], a[column], b[pivot], b[column]
        for row in range(column + 1, n):
            factor = divide(a[row][column], a[column][column])
            for k in range(column, n):
                a[row][k] -= factor * a[column][k]
            b[row] -= factor * b[column]
    for row in range(n - 1, -1, -1):
        for k in range(row + 1, n):
            b[row] -= a[row][k] * b[k]
        b[row] = divide(b[row], a[row][row])
    return b


def largest_ratio(residual: list[float], scale: list[float]) -> float:
    """Return the largest residual over its scale, as newton.h."""
    largest = 0.0
    for value, unit in zip(residual, scale, strict=True):
        if not (ratio := divide(abs(value), unit)) <= largest:
            largest = ratio
    return largest


class Interpreter(AnalysedModel):
    """An instance of a model with the life cycle of a block: `set`, `initialize`, `step` and `get`.

    Scalars are float, int or bool, arrays are NumPy arrays.

    Args:
        analysed: The analysed model.
    """

    def __init__(self, analysed: AnalysedModel):
        self.model, self.schedule = analysed.model, analysed.schedule
        self.parameter_roles = analysed.parameter_roles
        self.values = deepcopy(analysed.values)
        self.evaluate = EventEvaluator(self.model.functions, self.values)
        self._pre_variables = {
            "step": pre_variables(self.model, self.schedule.event),
            "initialize": pre_variables(self.model, self.schedule.initialization),
        }
        self._finite_variables = finite_variables(self.model, self.schedule)
        self.clocks: list[list[Any]] = []

    def set(self, name: str, value: Any) -> None:
        """Set a parameter or an input as a whole, and the parameters that depend on it."""
        self.assign(name, value)
        if self.model.variables[name].variability == "parameter":
            self.update_dependent_parameters()

    def get(self, name: str) -> Any:
        """Return a copy of the value of a variable."""
        return deepcopy(self.values[name])

    def initialize(self, time: float = 0.0) -> None:
        """Apply the start values, start the clocks and evaluate the equations at a time (s).

        Raises:
            ComponentError: The model has failed.
        """
        self.apply_start_values(inputs=False)
        self._start_clocks(time)
        self._evaluate_event("initialize", time)
        self.evaluate.event_flags.clear()

    def _start_clocks(self, time: float) -> None:
        """Set start (s), period (s) and number of past ticks of each clock."""
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
            self.assign(name, x + h / 6 * (a + 2 * b + 2 * c + d))

    def _state_values(self) -> list[Any]:
        return [self.get(name) for name in self.model.states]

    def _evaluate_derivatives(self, time: float, states: Sequence[Any] | None = None) -> list[Any]:
        """Return the derivatives at a time, for the given states or the current ones."""
        for name, value in zip(self.model.states, states or (), strict=False):
            self.assign(name, value)
        self.values["time"] = time
        with self._as_component_error("step", time), np.errstate(all="ignore"):
            self.evaluate.execute(self.schedule.between.derivatives)
        return [self.get(derivative_name(name)) for name in self.model.states]

    def _evaluate_event(self, function: str, time: float) -> None:
        """Evaluate the equations at an event ("step") or at the initialization ("initialize")."""
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


def load_interpreter(
    path: Path, model: str | None = None, options: ModelicaOptions = DEFAULT_OPTIONS
) -> Interpreter:
    """Return the interpreter of a model in a file with its default parameters."""
    from modelica_hybrid_interpreter import HybridInterpreter

    analysed, _ = assemble.analyse_file(path, model, options)
    return HybridInterpreter(analysed) if analysed.model.hybrid else Interpreter(analysed)
