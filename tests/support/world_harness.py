"""Worlds for tests, bound as by the engine and accessed by variable names."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cosim.core.component import Ports, Variable
from cosim.engine.initialization import copy_start_values
from plant_src.world import World

DECK_TOP = 0.2689  # m above the water
REST_HEIGHT = (
    0.0566 - 0.000577
)  # m; centre of mass of the quadcopter above the surface on which it stands
PLATFORM = {"size": [4.0, 4.0, 0.05], "position": [0.0, 0.0, 0.475]}
PLATFORM_TOP = 0.5


class WorldHarness:
    """A world with bound arrays; variables are read and set by `harness[name]`."""

    def __init__(
        self,
        vehicles: Mapping[str, Any],
        platforms: Mapping[str, Any] | None = None,
        environment: Mapping[str, Any] | None = None,
        obstacles: Mapping[str, Any] | None = None,
    ):
        self.world = World("plant", vehicles, platforms, environment, obstacles)
        self.inputs, self.outputs = _ports(self.world, "input"), _ports(self.world, "output")
        self.world.bind(self.inputs, self.outputs)
        self.world.enter_initialization_mode(0.0, 1e3)
        copy_start_values(self.world, self.inputs)
        self.world.exit_initialization_mode()
        self.world.get_outputs()
        self.steps = 0

    def step(self, count: int = 1, step_size: float = 0.01) -> WorldHarness:
        for _ in range(count):
            self.world.set_inputs()
            self.world.do_step(self.steps * step_size, step_size)
            self.world.get_outputs()
            self.steps += 1
        return self

    def vector(self, prefix: str, axes: str = "xyz") -> np.ndarray:
        return np.array([self.world.get(f"{prefix}.{axis}") for axis in axes])

    def __getitem__(self, name: str) -> Any:
        return self.world.get(name)

    def __setitem__(self, name: str, value: Any) -> None:
        self.world.set(name, value)

    @property
    def bytes(self) -> bytes:
        """All outputs as bytes, for bitwise comparison."""
        return b"".join(array.tobytes() for array in self.outputs.arrays.values())


def _ports(world: World, causality: str) -> Ports:
    variables = [variable for variable in world.variables if variable.causality == causality]
    dtypes = dict.fromkeys(variable.dtype for variable in variables)
    return Ports(variables, {dtype: np.zeros(_size(variables, dtype), dtype) for dtype in dtypes})


def _size(variables: list[Variable], dtype: Any) -> int:
    return sum(len(variable.scalar_names) for variable in variables if variable.dtype == dtype)


def quadcopter_settings(position: list[float], **more: Any) -> dict[str, Any]:
    return {"model": "ar_drone", "position": position, **more}


def vessel_settings(position: list[float], **more: Any) -> dict[str, Any]:
    return {"model": "strider", "position": position, **more}
