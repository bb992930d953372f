"""Small components for tests: real implementations of the contract, made from a function."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from cosim.core.component import Component, Ports, StepResult, Variable


def inputs(*names: str, **attributes: Any) -> list[Variable]:
    return [Variable(name, causality="input", start=0.0, **attributes) for name in names]


def outputs(*names: str, **attributes: Any) -> list[Variable]:
    return [Variable(name, causality="output", **attributes) for name in names]


class FakeComponent(Component):
    """Steps by `step(values, time, step_size)`, which changes `values` (by variable name) in place.

    `feed(values)`, if given, makes outputs follow inputs already in initialization mode.
    """

    binds_everything = False
    has_state = True

    def __init__(
        self,
        variables: Sequence[Variable],
        step: Callable[[dict[str, Any], float, float], StepResult | None],
        feed_through: Callable[[dict[str, Any]], None] = lambda values: None,
        start: Mapping[str, Any] | None = None,
    ):
        self.variables = list(variables)
        self.values: dict[str, Any] = {v.name: self._start(v) for v in variables} | dict(start or {})
        self._step, self._feed_through = step, feed_through
        self.calls: list[str] = []

    @staticmethod
    def _start(variable: Variable) -> Any:
        if variable.shape:
            return list(variable.start or [0.0] * len(variable.scalar_names))
        return ("" if variable.type == "String" else 0) if variable.start is None else variable.start

    def set(self, name: str, value: Any) -> None:
        self.calls.append(f"set {name}")
        self.values[name] = value

    def get(self, name: str) -> Any:
        return self.values[name]

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
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
    filled = dict.fromkeys(ports.arrays, 0)
    pieces = []
    for variable in ports.variables:
        begin, size = filled[variable.dtype], len(variable.scalar_names)
        pieces.append((variable.name, ports.arrays[variable.dtype][begin : begin + size]))
        filled[variable.dtype] += size
    return pieces


def gain(factor: float = 1.0, start: float = 0.0) -> FakeComponent:
    """y = factor * u, direct feed-through, also in initialization mode."""

    def feed(values: dict[str, Any]) -> None:
        values["y"] = factor * values["u"]

    return FakeComponent([*inputs("u"), *outputs("y")], lambda values, t, h: feed(values), feed, {"y": start})


def integrator(start: float = 0.0) -> FakeComponent:
    """y' = u by explicit Euler."""

    def step(values: dict[str, Any], t: float, h: float) -> None:
        values["y"] += h * values["u"]

    return FakeComponent([*inputs("u"), *outputs("y")], step, start={"y": start})


def clock() -> FakeComponent:
    """y = the time at the end of the step."""

    def step(values: dict[str, Any], t: float, h: float) -> None:
        values["y"] = t + h

    return FakeComponent(outputs("y"), step)


def counter() -> FakeComponent:
    """y counts steps, n is the same as an Integer."""

    def step(values: dict[str, Any], t: float, h: float) -> None:
        values["y"] += 1.0
        values["n"] += 1

    return FakeComponent([*outputs("y"), *outputs("n", type="Int32")], step)
