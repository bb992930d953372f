"""A flat model that runs in plain Python: the second opinion on the emitted C, and the value of constant expressions."""

from __future__ import annotations

import math
from copy import deepcopy
from typing import Any

import numpy as np

from ...errors import ComponentError
from .arithmetic import Failure, divide
from .evaluate import Evaluator, typed
from .flat import Model
from .matching import is_input
from .roles import roles
from .sort import finite, memory, plan, start_value

_TOLERANCE = 1e-6


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
        """All ticks t with time <= t < time + step_size; without any clock, the equations at time + step_size."""
        end = time + step_size
        if not self.clocks:
            self._compute("step", end)
        while self.clocks:
            ticks = [start + count * period for start, period, count in self.clocks]
            now = min(ticks)
            if not now < end - _TOLERANCE * min(period for _, period, _ in self.clocks):
                return
            for k, (clock, tick) in enumerate(zip(self.clocks, ticks, strict=True)):
                self.evaluate.flags["due", k] = tick <= now + _TOLERANCE * clock[1]
            self._compute("step", now)
            for k, clock in enumerate(self.clocks):
                clock[2] += self.evaluate.flags["due", k]

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
        try:
            self.evaluate.run(body)
            if function == "step":
                self._check_finite()
        except Failure as failure:
            raise ComponentError(self.model.name, function, str(failure), time) from None

    def _check_finite(self) -> None:
        for name in self._finite:
            if not np.all(np.isfinite(self.values[name])):
                raise Failure(f"{name} is not a finite number")
