"""Vehicles, platforms and obstacles of a world, with their positions."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from cosim.core.errors import InputError

from .catalogue import Model
from .json_reader import JsonPath, JsonReader, Numbers
from .vehicles.common.shapes import Body, Vector
from .vehicles.common.vehicle_reader import read_triangles


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
        parameters: Values of the model's scalar parameters by name, in order; the initial state is
            among them.
        body: Rigid body in Bullet, with the mass and inertia of these parameters.
        crash_speed: Change of velocity by a collision above which the vehicle has crashed (m/s).
        surface: Friction and restitution in contact.
    """

    name: str
    model: Model
    parameters: Mapping[str, float]
    body: Body
    crash_speed: float
    surface: ContactSurface


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


#: colour of obstacles without "colour": concrete
CONCRETE: Vector = (0.62, 0.61, 0.58)

OPTIONAL_KEYS = ("position", "yaw", "scale", "collision", "colour", *ContactSurface._fields)


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A fixed mesh.

    Attributes:
        name: Name of the obstacle.
        triangles: Corners of the triangles (m, world frame), shape (n, 3, 3).
        is_convex: Whether each connected part collides as its convex hull; otherwise the triangles
            themselves do.
        colour: Red, green, blue in 0 ... 1.
        surface: Friction and restitution.
    """

    name: str
    triangles: np.ndarray
    is_convex: bool = True
    colour: Vector = CONCRETE
    surface: ContactSurface = DRY

    @cached_property
    def parts(self) -> list[np.ndarray]:
        """Triangles of each connected part; triangles are connected by common corners."""
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        _, corners = np.unique(self.triangles.reshape(-1, 3), axis=0, return_inverse=True)
        faces = corners.reshape(-1, 3)
        links = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]]])
        count = int(faces.max()) + 1
        graph = coo_array((np.ones(len(links)), links.T), shape=(count, count))
        _, labels = connected_components(graph, directed=False)
        part_of = labels[faces[:, 0]]
        return [self.triangles[part_of == part] for part in np.unique(part_of)]


def read_obstacles(value: Any, reader: JsonReader) -> list[Obstacle]:
    """Read the argument "obstacles" of a world: name to object.

    Args:
        value: JSON object.
        reader: Reader that collects the problems; their paths start with "obstacles".
    """
    specs = reader.read_named_objects(value, ("obstacles",))
    found = (_read_obstacle(reader, name, spec) for name, spec in specs.items())
    return [obstacle for obstacle in found if obstacle]


def obstacles_of(arguments: Mapping[str, Any]) -> list[Obstacle]:
    """Return the obstacles of a world with these arguments. Raises InputError with all problems."""
    reader = JsonReader()
    obstacles = read_obstacles(arguments.get("obstacles", {}), reader)
    if reader.problems:
        raise InputError(reader.problems)
    return obstacles


def _read_obstacle(reader: JsonReader, name: str, spec: Any) -> Obstacle | None:
    path: JsonPath = ("obstacles", name)
    spec = reader.read_object(spec, path, ("mesh",), OPTIONAL_KEYS)
    triangles = read_triangles(reader, spec["mesh"], (*path, "mesh")) if "mesh" in spec else None
    position = reader.vector(spec.get("position", [0.0] * 3), (*path, "position"), "xyz")
    yaw = reader.number(spec.get("yaw", 0.0), (*path, "yaw"))
    scale = reader.positive(spec.get("scale", 1.0), (*path, "scale"))
    kind = reader.choice(
        spec.get("collision", "convex"), (*path, "collision"), ("convex", "concave")
    )
    red, green, blue = reader.vector(
        spec.get("colour", CONCRETE), (*path, "colour"), ("red", "green", "blue")
    )
    surface = read_surface(reader, spec, path)
    if triangles is None:
        return None
    turn = np.array(
        [[math.cos(yaw), -math.sin(yaw), 0.0], [math.sin(yaw), math.cos(yaw), 0.0], [0.0, 0.0, 1.0]]
    )
    placed = scale * triangles @ turn.T + np.array(position)
    return Obstacle(name, placed, kind == "convex", (red, green, blue), surface)
