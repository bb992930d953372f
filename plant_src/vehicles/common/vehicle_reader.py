"""Reader of what the files of all families of vehicles have in common."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any, TypeVar

import numpy as np

from cosim.core.errors import InputError

from ...json_reader import JsonPath
from .quantities import QuantityReader
from .shapes import BODY_UP, ConvexPiece, Shape, Vector, level_box

_Vehicle = TypeVar("_Vehicle")


@dataclass(frozen=True)
class CollisionBox:
    """A box of the collision shape in the body frame.

    Edges and centre (m), and its angle about the z axis (rad).
    """

    size: Vector
    position: Vector
    yaw: float

    def corners(self) -> np.ndarray:
        """Return the corners (m, body frame), shape (8, 3)."""
        x, y, z = (np.array(list(product((-0.5, 0.5), repeat=3))) * self.size).T
        cosine, sine = math.cos(self.yaw), math.sin(self.yaw)
        return np.column_stack([cosine * x - sine * y, sine * x + cosine * y, z]) + self.position

    def shape_in(self, to_body: np.ndarray) -> Shape:
        """Return the box in the frame from which `to_body` (3, 3) rotates into the body frame."""
        return level_box(to_body, self.size, self.position, self.yaw)


@dataclass(frozen=True)
class CollisionPiece:
    """A convex piece of the collision shape: the convex hull of points (m, body frame)."""

    points: tuple[Vector, ...]

    @property
    def size(self) -> Vector:
        """Edges of the box around the piece (m)."""
        x, y, z = np.ptp(self.points, axis=0).tolist()
        return x, y, z

    @property
    def position(self) -> Vector:
        """Centre of the box around the piece (m)."""
        return ConvexPiece(self.points).position

    def corners(self) -> np.ndarray:
        """Return the points (m, body frame)."""
        return np.array(self.points)

    def shape_in(self, to_body: np.ndarray) -> Shape:
        """Return the piece in the frame from which `to_body` (3, 3) rotates into the body frame."""
        return ConvexPiece(tuple((x, y, z) for x, y, z in (self.corners() @ to_body).tolist()))


#: element of "boxes"
Collision = CollisionBox | CollisionPiece


def boxes_in(boxes: Sequence[Collision], to_body: np.ndarray) -> tuple[Shape, ...]:
    """Return the collision shape in the frame from which `to_body` (3, 3) rotates into the body frame."""
    return tuple(box.shape_in(to_body) for box in boxes)


def edges_around(boxes: Sequence[Collision]) -> Vector:
    """Return the edges (m) of the box around all boxes; 1 m if there are none."""
    corners = np.concatenate(
        [box.corners() for box in boxes or (CollisionBox((1.0,) * 3, (0.0,) * 3, 0.0),)]
    )
    length, width, height = np.ptp(corners, axis=0).tolist()
    return length, width, height


class VehicleReader(QuantityReader):
    """Reader of vehicle data."""

    def construct(self, create: Callable[[], _Vehicle]) -> _Vehicle | None:
        """Return a new vehicle; if it is impossible, record its problems and return None."""
        try:
            return create()
        except InputError as error:
            for problem in error.problems:
                self.add_problem(problem.subject, problem.message)
            return None

    def elements(self, data: Mapping[str, Any], key: str) -> list[tuple[int, Any]]:
        """Read a list with at least one element; return its elements with their indices."""
        value = data.get(key, [{}])
        if not isinstance(value, list) or not value:
            self.add_problem((key,), f"found {value!r}, expected a list with at least one element")
            return []
        return list(enumerate(value)) if key in data else []

    def read_inertia(self, value: Any) -> np.ndarray:
        """Read three moments of inertia, or three rows of a tensor."""
        numbers = self.si_value(value, ("inertia",), "kg.m2")
        rows = (
            isinstance(numbers, list)
            and len(numbers) == 3
            and all(isinstance(row, list) for row in numbers)
        )
        if rows:
            return np.array(
                [self.vector(row, ("inertia", str(i)), "xyz") for i, row in enumerate(numbers)]
            )
        return np.diag(self.vector(numbers, ("inertia",), ("xx", "yy", "zz")))

    def read_axis(self, value: Any, path: JsonPath) -> Vector:
        """Read the direction of a thrust and return it as a unit vector."""
        x, y, z = self.vector_quantity(value, path, "1", "xyz")
        length = math.hypot(x, y, z)
        if not length:
            self.add_problem(path, "found the zero vector, expected a direction")
            return BODY_UP
        return x / length, y / length, z / length

    def read_boxes(self, data: Mapping[str, Any]) -> tuple[Collision, ...]:
        """Read the collision shape."""
        return tuple(
            self.read_box(box, ("boxes", str(i))) for i, box in self.elements(data, "boxes")
        )

    def read_box(self, value: Any, path: JsonPath) -> Collision:
        """Read one box or convex piece of the collision shape."""
        if isinstance(value, Mapping) and "points" in value:
            return self.read_piece(
                self.read_data(value, path, ("points",), ()).get("points"), (*path, "points")
            )
        data = self.read_data(value, path, ("size",), ("position", "yaw"))
        length, width, height = self.vector_quantity(
            data.get("size", [1.0] * 3), (*path, "size"), "m", "xyz"
        )
        if not min(length, width, height) > 0:
            self.add_problem(
                (*path, "size"), f"found {[length, width, height]}, expected edges greater than 0"
            )
        x, y, z = self.vector_quantity(
            data.get("position", [0.0] * 3), (*path, "position"), "m", "xyz"
        )
        yaw = self.quantity(data.get("yaw", 0.0), (*path, "yaw"), "rad", -2 * math.pi, 2 * math.pi)
        return CollisionBox((length, width, height), (x, y, z), yaw)

    def read_piece(self, value: Any, path: JsonPath) -> CollisionPiece:
        """Read the points of a convex piece."""
        numbers = self.si_value(value, path, "m")
        rows = (
            [self.vector(row, (*path, str(i)), "xyz") for i, row in enumerate(numbers)]
            if isinstance(numbers, list)
            else []
        )
        if len(rows) < 4 or np.linalg.matrix_rank(np.array(rows) - rows[0], tol=1e-9) < 3:
            self.add_problem(
                path, f"found {len(rows)} points, expected at least 4 that do not lie in a plane"
            )
            rows = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
        return CollisionPiece(tuple((x, y, z) for x, y, z in rows))
