"""Small components for tests, made from functions: complete implementations of `Component`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from cosim.core.component import Component, Ports, StepResult, Variable


def inputs(*names: str, **attributes: Any) -> list[Variable]:
    """Return input variables with start value 0."""
    return [Variable(name, causality="input", start=0.0, **attributes) for name in names]


def outputs(*names: str, **attributes: Any) -> list[Variable]:
    """Return output variables."""
    return [Variable(name, causality="output", **attributes) for name in names]


class FakeComponent(Component):
    """Component whose step is a function.

    `step(values, time, step_size)` changes the values (by variable name) in place.
    `feed_through(values)` computes outputs directly from inputs, in initialization mode too.
    `calls` lists the calls of the life cycle.
    """

    binds_everything = False
    has_state = True

    def __init__(
        self,
        variables: Sequence[Variable],
        step: Callable[[dict[str, Any], float, float], StepResult | None],
        feed_through: Callable[[dict[str, Any]], None] = lambda _: None,
        start: Mapping[str, Any] | None = None,
    ):
        self.variables = list(variables)
        self.values: dict[str, Any] = {v.name: self._start(v) for v in variables} | dict(
            start or {}
        )
        self._step, self._feed_through = step, feed_through
        self.calls: list[str] = []

    @staticmethod
    def _start(variable: Variable) -> Any:
        if variable.shape:
            return list(variable.start or [0.0] * len(variable.scalar_names))
        if variable.start is not None:
            return variable.start
        return "" if variable.type == "String" else 0

    def set(self, name: str, value: Any) -> None:
        self.calls.append(f"set {name}")
        self.values[name] = value

    def get(self, name: str) -> Any:
        return self.values[name]

    def enter_initialization_mode(self, _start_time: float, _stop_time: float) -> None:
        self.calls.append("enter")

    def exit_initialization_mode(self) -> None:
        self.calls.append("exit")

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._inputs, self._outputs = inputs, outputs

    def set_inputs(self) -> None:
        for name, values in _variables_with_values(self._inputs):
            self.values[name] = values.item() if values.shape == (1,) else values.tolist()
        self._feed_through(self.values)

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        self.calls.append(f"step {time:g}")
        return self._step(self.values, time, step_size)

    def get_outputs(self) -> None:
        for name, values in _variables_with_values(self._outputs):
            values[:] = self.values[name]

    def get_state(self) -> Any:
        return dict(self.values)

    def set_state(self, state: Any) -> None:
        self.values = dict(state)

    def free_state(self, state: Any) -> None: ...

    def terminate(self) -> None:
        self.calls.append("terminate")

    def free(self) -> None:
        self.calls.append("free")


def _variables_with_values(ports: Ports) -> list[tuple[str, np.ndarray]]:
    """Pair each variable's name with its part of the bound array."""
    next_index = dict.fromkeys(ports.arrays, 0)
    parts = []
    for variable in ports.variables:
        begin, size = next_index[variable.dtype], len(variable.scalar_names)
        parts.append((variable.name, ports.arrays[variable.dtype][begin : begin + size]))
        next_index[variable.dtype] += size
    return parts


def gain(factor: float = 1.0, start: float = 0.0) -> FakeComponent:
    """Return a component with y = factor * u (direct feed-through, in initialization mode too)."""

    def feed(values: dict[str, Any]) -> None:
        values["y"] = factor * values["u"]

    return FakeComponent(
        [*inputs("u"), *outputs("y")], lambda values, _, __: feed(values), feed, {"y": start}
    )


def integrator(start: float = 0.0) -> FakeComponent:
    """Return a component with y' = u, integrated by explicit Euler."""

    def step(values: dict[str, Any], _: float, h: float) -> None:
        values["y"] += h * values["u"]

    return FakeComponent([*inputs("u"), *outputs("y")], step, start={"y": start})


def clock() -> FakeComponent:
    """Return a component with y = time (s) at the end of the step."""

    def step(values: dict[str, Any], t: float, h: float) -> None:
        values["y"] = t + h

    return FakeComponent(outputs("y"), step)


def counter() -> FakeComponent:
    """Return a component that counts its steps: y as a float, n as an integer."""

    def step(values: dict[str, Any], _: float, __: float) -> None:
        values["y"] += 1.0
        values["n"] += 1

    return FakeComponent([*outputs("y"), *outputs("n", type="Int32")], step)
