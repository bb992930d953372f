"""Harness that binds a sensor like the engine and drives it by the names of its variables."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from cosim.core.component import Ports
from plant_src.sensors.signal_component import SignalComponent

STEP = 0.01  # s


class SensorHarness:
    """Bound component in step mode, with access to variables by name."""

    def __init__(
        self, component: SignalComponent, start: float = 0.0, step: float = STEP, **inputs: Any
    ):
        self.component, self.start, self.step_size, self.steps = component, start, step, 0
        self._inputs, self._outputs = _ports(component, "input"), _ports(component, "output")
        component.bind(self._inputs, self._outputs)
        component.enter_initialization_mode(start, 1e6)
        for variable in self._inputs.variables:
            self[variable.name] = component.get(variable.name)
        self.set_inputs(**inputs)
        component.exit_initialization_mode()

    def set_inputs(self, **values: Any) -> SensorHarness:
        """Set inputs ("vehicle__position=(x, y, z)" for vehicle.position.x|y|z); outputs follow in
        initialization mode.
        """
        for name, value in values.items():
            prefix = name.replace("__", ".")
            names = [
                v.name
                for v in self._inputs.variables
                if v.name == prefix or v.name.startswith(prefix + ".")
            ]
            assert names, prefix
            for each, number in zip(names, np.ravel(value).tolist(), strict=True):
                self[each] = number
        self.component.set_inputs()
        self.component.get_outputs()
        return self

    def step(self, count: int = 1) -> SensorHarness:
        for _ in range(count):
            self.component.set_inputs()
            self.component.do_step(self.start + self.steps * self.step_size, self.step_size)
            self.component.get_outputs()
            self.steps += 1
        return self

    def record(self, count: int, names: Sequence[str]) -> np.ndarray:
        """Outputs after each of `count` steps, shape (count, names)."""
        places = [_place(self._outputs, name) for name in names]
        rows = []
        for _ in range(count):
            self.step()
            rows.append([array.item(where.start) for array, where in places])
        return np.array(rows)

    def vector(self, prefix: str, axes: str = "xyz") -> np.ndarray:
        return np.array([self[f"{prefix}.{axis}"] for axis in axes])

    def __getitem__(self, name: str) -> Any:
        array, where = _place(self._outputs, name)
        found = array[where].tolist()
        return found if len(found) > 1 else found[0]

    def __setitem__(self, name: str, value: Any) -> None:
        array, where = _place(self._inputs, name)
        array[where] = value

    @property
    def bytes(self) -> bytes:
        return b"".join(array.tobytes() for array in self._outputs.arrays.values())


def _ports(component: SignalComponent, causality: str) -> Ports:
    variables = [v for v in component.variables if v.causality == causality]
    sizes = Counter[Any]()
    for variable in variables:
        sizes[variable.dtype] += len(variable.scalar_names)
    return Ports(variables, {dtype: np.zeros(size, dtype) for dtype, size in sizes.items()})


def _place(ports: Ports, name: str) -> tuple[np.ndarray, slice]:
    filled = dict.fromkeys(ports.arrays, 0)
    for variable in ports.variables:
        first = filled[variable.dtype]
        filled[variable.dtype] = first + len(variable.scalar_names)
        if variable.name == name:
            return ports.arrays[variable.dtype], slice(first, filled[variable.dtype])
    raise KeyError(name)


def with_parameters(component: SignalComponent, **parameters: Any) -> SignalComponent:
    """The component with parameters set ("gyroscope__bias" for gyroscope.bias)."""
    for name, value in parameters.items():
        component.set(name.replace("__", "."), value)
    return component


def quaternion(axis: Sequence[float], angle: float) -> np.ndarray:
    """Quaternion (w, x, y, z) of a rotation about an axis."""
    direction = np.asarray(axis) / np.linalg.norm(axis)
    return np.array([np.cos(angle / 2), *(np.sin(angle / 2) * direction)])
