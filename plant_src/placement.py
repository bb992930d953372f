"""Vehicles and platforms with their places in a world."""

from __future__ import annotations

from dataclasses import dataclass

from .json_reader import Numbers
from .vehicles.common.shapes import Body
from .vehicles.model import Model


@dataclass(frozen=True)
class VehiclePlacement:
    """A vehicle to place: `parameters` holds the values of its model's parameters, in order; `body` is its body in Bullet."""

    name: str
    model: Model
    parameters: Numbers
    body: Body

    def parameter(self, name: str) -> float:
        """The value of a scalar parameter."""
        return self.parameters[self.model.slots("parameter").index(name)]


@dataclass(frozen=True)
class Platform:
    """A fixed box: edges and centre (m, world frame)."""

    name: str
    size: Numbers
    position: Numbers
