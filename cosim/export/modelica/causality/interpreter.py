"""A flat model that runs in plain Python: the second opinion on the emitted C, and the value of constant expressions."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from typing import Any

import numpy as np

from ....core.errors import ComponentError
from ..model.arithmetic import Failure, divide
from ..model.evaluate import Evaluator, typed
from ..model.flat_model import Model, derivative
from .matching import is_input
from .parameter_roles import roles
from .schedule import finite, memory, plan, start_value

_TOLERANCE = 1e-6
_LONGEST_STEP = 0.005


class Interpreter:
    """One instance of a model with the life of a Block: values are set, `initialize`, `step`, values are read.

    Scalars are float, int or bool, arrays are numpy arrays. A failing model raises ComponentError.
    """

    def __init__(self, model: Model):
        self.model = model
        self.plan = plan(model)
        self.roles = roles(model, self.plan)
        self._remembered = {"step": memory(model, self.plan.event), "initialize": memory(model, self.plan.initialization)}
        self._finite = finite(model, self.plan)
        self.values: dict[str, Any] = {}
        self.evaluate = Evaluator(model.functions, self.values)
        for variable in model.variables.values():
            self.values[variable.name] = typed(1 if variable.type == "Enumeration" else 0, variable.type, variable.shape)
        for name in (*self.roles.settable, *self.roles.fixed):
            self._give(name, self._declared(name))
        self._dependent()
        self._start(inputs=True)

    def set(self, name: str, value: Any) -> None:
        """Set a parameter or an input, arrays whole; parameters that depend on it follow."""
        self._give(name, value)
        if self.model.variables[name].variability == "parameter":
            self._dependent()

    def get(self, name: str) -> Any:
        return deepcopy(self.values[name])

    def initialize(self, time: float = 0.0) -> None:
        """Start values, the first ticks of the clocks, and the equations at the start time."""
        self._start(inputs=False)
        self.clocks = []
        for clock in self.plan.clocks:
            start, period = self.evaluate(clock.start), self.evaluate(clock.period)
            if not period > 0:
                raise ComponentError(self.model.name, "initialize", "the period of sample() must be positive", time)
            self.clocks.append([start, period, max(0, math.ceil(divide(time - start, period) - _TOLERANCE))])
        self._compute("initialize", time)
        self.evaluate.flags.clear()

    def step(self, time: float, step_size: float) -> None:
        """All ticks t with time <= t < time + step_size; with states or without any clock, the equations at time + step_size."""
        end, reached = time + step_size, self._ticks(time, time + step_size)
        if self.model.states or not self.clocks:
            self._integrate(reached, end)
            self.evaluate.flags.update({("due", k): False for k in range(len(self.clocks))})
            self._compute("step", end)

    def _ticks(self, time: float, end: float) -> float:
        """All ticks in time <= t < end; returns the time that the states have reached."""
        reached = time
        while self.clocks:
            ticks = [start + count * period for start, period, count in self.clocks]
            now = min(ticks)
            if not now < end - _TOLERANCE * min(period for _, period, _ in self.clocks):
                break
            reached = self._integrate(reached, now)
            for k, (clock, tick) in enumerate(zip(self.clocks, ticks, strict=True)):
                self.evaluate.flags["due", k] = tick <= now + _TOLERANCE * clock[1]
            self._compute("step", now)
            for k, clock in enumerate(self.clocks):
                clock[2] += self.evaluate.flags["due", k]
        return reached

    def _integrate(self, start: float, end: float) -> float:
        """The states from one time to another in equal steps of at most 5 ms; returns the time reached."""
        count = math.ceil((end - start) / _LONGEST_STEP - 1e-9) if self.model.states else 0
        if count <= 0:
            return start
        h = (end - start) / count
        for k in range(count):
            self._runge_kutta(start + k * h, h)
        return end

    def _runge_kutta(self, time: float, h: float) -> None:
        """One step of the classical method of order 4."""
        start = self._states()
        k1 = self._slopes(time)
        k2 = self._slopes(time + h / 2, [x + h / 2 * k for x, k in zip(start, k1, strict=True)])
        k3 = self._slopes(time + h / 2, [x + h / 2 * k for x, k in zip(start, k2, strict=True)])
        k4 = self._slopes(time + h, [x + h * k for x, k in zip(start, k3, strict=True)])
        for name, x, a, b, c, d in zip(self.model.states, start, k1, k2, k3, k4, strict=True):
            self._give(name, x + h / 6 * (a + 2 * b + 2 * c + d))

    def _states(self) -> list[Any]:
        return [self.get(name) for name in self.model.states]

    def _slopes(self, time: float, states: Sequence[Any] | None = None) -> list[Any]:
        """The derivatives at a time, for the given states or the present ones."""
        for name, value in zip(self.model.states, states or (), strict=False):
            self._give(name, value)
        self.values["time"] = time
        with self._reported("step", time), np.errstate(all="ignore"):
            self.evaluate.run(self.plan.derivatives)
        return [self.get(derivative(name)) for name in self.model.states]

    def _declared(self, name: str) -> Any:
        binding = self.model.variables[name].binding
        return self.evaluate(binding if binding is not None else start_value(self.model, name))

    def _give(self, name: str, value: Any) -> None:
        variable = self.model.variables[name]
        self.values[name] = typed(value, variable.type, variable.shape)

    def _dependent(self) -> None:
        for name in self.roles.dependent:
            self._give(name, self._declared(name))

    def _start(self, inputs: bool) -> None:
        for variable in self.model.variables.values():
            if variable.variability not in ("parameter", "constant") and (inputs or not is_input(variable)):
                self._give(variable.name, self.evaluate(start_value(self.model, variable.name)))

    def _compute(self, function: str, time: float) -> None:
        """One event, or the initialization."""
        body = self.plan.event if function == "step" else self.plan.initialization
        self.values["time"] = time
        self.evaluate.memory = {name: deepcopy(self.values[name]) for name in self._remembered[function]}
        with self._reported(function, time):
            self.evaluate.run(body)
            if function == "step":
                self._check_finite()

    @contextmanager
    def _reported(self, function: str, time: float) -> Iterator[None]:
        try:
            yield
        except Failure as failure:
            raise ComponentError(self.model.name, function, str(failure), time) from None

    def _check_finite(self) -> None:
        for name in self._finite:
            if not np.all(np.isfinite(self.values[name])):
                raise Failure(f"{name} is not a finite number")
