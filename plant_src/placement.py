"""Vehicles and platforms of a world, with their initial positions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from .json_reader import JsonPath, JsonReader, Numbers
from .vehicles.common.shapes import Body
from .vehicles.model import Model


class ContactSurface(NamedTuple):
    """Surface of a body in contact; Bullet multiplies the values of the two bodies.

    Attributes:
        friction: Friction coefficient (1).
        restitution: Coefficient of restitution (1).
    """

    friction: float = 1.0
    restitution: float = 0.0


DRY = ContactSurface()


def read_surface(reader: JsonReader, spec: Mapping[str, Any], path: JsonPath) -> ContactSurface:
    """Read the keys "friction" and "restitution" of an object."""
    friction = reader.number(spec.get("friction", 1.0), (*path, "friction"), 0.0)
    return ContactSurface(
        friction, reader.number(spec.get("restitution", 0.0), (*path, "restitution"), 0.0, 1.0)
    )


@dataclass(frozen=True)
class VehiclePlacement:
    """A vehicle to create in a world.

    Attributes:
        name: Name of the vehicle, the prefix of its variables.
        model: Model of the vehicle.
        parameters: Values of the model's scalar parameters in order; the initial state is among
            them.
        body: Rigid body in Bullet, with the mass and inertia of these parameters.
        crash_speed: Change of velocity by a collision above which the vehicle has crashed (m/s).
        surface: Friction and restitution in contact.
    """

    name: str
    model: Model
    parameters: Numbers
    body: Body
    crash_speed: float
    surface: ContactSurface

    def parameter(self, name: str) -> float:
        """Return the value of a scalar parameter."""
        return self.parameters[self.model.slots("parameter").index(name)]


@dataclass(frozen=True)
class Platform:
    """A fixed box with axes parallel to those of the world.

    Attributes:
        name: Name of the platform.
        size: Lengths of the edges along x, y and z (m).
        position: Centre (m, world frame).
        surface: Friction and restitution in contact.
    """

    name: str
    size: Numbers
    position: Numbers
    surface: ContactSurface = DRY
