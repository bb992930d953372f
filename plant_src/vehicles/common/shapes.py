"""Rigid bodies for Bullet: mass, inertia, principal axes and collision shapes."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from itertools import permutations, product
from typing import NamedTuple

import numpy as np

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

BODY_UP: Vector = (0.0, 0.0, 1.0)

#: largest number of points of a convex piece
MAX_POINTS = 64

#: relative rounding error of the elements of a matrix
_TOLERANCE = 1e-9

#: parameter -> row and column in the symmetric inertia tensor
INERTIA_INDICES = {
    "inertia.xx": (0, 0),
    "inertia.yy": (1, 1),
    "inertia.zz": (2, 2),
    "inertia.xy": (0, 1),
    "inertia.xz": (0, 2),
    "inertia.yz": (1, 2),
}


class Box(NamedTuple):
    """A box in the frame of its body.

    Attributes:
        half_extents: Half of the edges along x, y and z (m).
        position: Centre (m).
        orientation: Unit quaternion (x, y, z, w) box to body.
    """

    half_extents: Vector
    position: Vector
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def corners(self) -> np.ndarray:
        """Return the corners (m) in the frame of the body, shape (8, 3)."""
        local = np.array(list(product((-1, 1), repeat=3))) * self.half_extents
        axis, w = np.array(self.orientation[:3]), self.orientation[3]
        cross = np.cross(axis, local)
        return self.position + local + 2 * (w * cross + np.cross(axis, cross))

    def moved(self, offset: Vector) -> Box:
        """Return the box moved by `offset` (m)."""
        return self._replace(position=_sum(self.position, offset))


class ConvexPiece(NamedTuple):
    """A convex piece of a collision shape, in the frame of its body.

    Attributes:
        points: Points whose convex hull the piece is (m).
    """

    points: tuple[Vector, ...]

    @property
    def size(self) -> Vector:
        """Edges of the box around the piece (m)."""
        x, y, z = np.ptp(self.points, axis=0).tolist()
        return x, y, z

    @property
    def half_extents(self) -> Vector:
        """Half of the edges of the box around the piece (m)."""
        x, y, z = self.size
        return x / 2, y / 2, z / 2

    @property
    def position(self) -> Vector:
        """Centre of the box around the piece (m)."""
        x, y, z = ((np.min(self.points, axis=0) + np.max(self.points, axis=0)) / 2).tolist()
        return x, y, z

    @property
    def orientation(self) -> Quaternion:
        """Orientation of the box around the piece: that of the body."""
        return 0.0, 0.0, 0.0, 1.0

    def corners(self) -> np.ndarray:
        """Return the points (m) in the frame of the body."""
        return np.array(self.points)

    def moved(self, offset: Vector) -> ConvexPiece:
        """Return the piece moved by `offset` (m)."""
        return ConvexPiece(tuple(_sum(point, offset) for point in self.points))

    def shape_in(self, to_body: np.ndarray) -> ConvexPiece:
        """Return the piece in another frame.

        `to_body` (3, 3) rotates from this frame into that of the body.
        """
        return ConvexPiece(tuple((x, y, z) for x, y, z in (self.corners() @ to_body).tolist()))


def _sum(a: Vector, b: Vector) -> Vector:
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


#: part of a collision shape
Shape = Box | ConvexPiece

#: function from the rotation matrix (3, 3) principal axes to body frame to the collision shape in
#: principal axes
Boxes = Callable[[np.ndarray], tuple[Shape, ...]]


class Body(NamedTuple):
    """A rigid body in a frame at its centre of mass.

    Attributes:
        mass: Mass (kg).
        inertia: Moments of inertia about the axes of the frame (kg m2).
        boxes: Collision shape.
        height: Height of the centre of mass of a planar vessel (m, world frame).
        axes: Unit quaternion (x, y, z, w) from the frame to the vehicle's body frame.
    """

    mass: float
    inertia: Vector
    boxes: tuple[Shape, ...]
    height: float = 0.0
    axes: Quaternion = (0.0, 0.0, 0.0, 1.0)


def level_box(to_body: np.ndarray, size: Vector, position: Vector, yaw: float = 0.0) -> Box:
    """Return a box that is level in the body frame, in another frame.

    Args:
        to_body: Rotation matrix from the frame of the result to the body frame, shape (3, 3); its
            angle is less than 120 degrees.
        size: Edges (m).
        position: Centre (m, body frame).
        yaw: Angle of the box about the z axis of the body frame (rad).
    """
    quarter = math.remainder(yaw, math.pi)
    length, width, height = size
    if abs(quarter) > math.pi / 4:  # the same box with its edges exchanged
        quarter, length, width = math.remainder(quarter - math.pi / 2, math.pi), width, length
    cos, sin = math.cos(quarter), math.sin(quarter)
    turned = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    x, y, z = (to_body.T @ position).tolist()
    return Box(
        (length / 2, width / 2, height / 2), (x, y, z), quaternion_from_matrix(to_body.T @ turned)
    )


def quaternion_from_matrix(rotation: np.ndarray) -> Quaternion:
    """Return the unit quaternion (x, y, z, w) of a rotation matrix (3, 3).

    Its angle must be well below 180 degrees, because w is the divisor.
    """
    w = math.sqrt(1 + np.trace(rotation)) / 2
    x, y, z = (rotation[k - 1, k - 2] - rotation[k - 2, k - 1] for k in range(3))
    return float(x / (4 * w)), float(y / (4 * w)), float(z / (4 * w)), w


def outermost_points(points: np.ndarray) -> np.ndarray:
    """Return at most MAX_POINTS of the points (n, 3).

    Those farthest in directions that lie evenly on a sphere.
    """
    if len(points) <= MAX_POINTS:
        return points
    height = 1 - 2 * (np.arange(MAX_POINTS) + 0.5) / MAX_POINTS
    angle, radius = np.pi * (1 + 5**0.5) * np.arange(MAX_POINTS), np.sqrt(1 - height**2)
    directions = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), height])
    chosen: np.ndarray = points[np.unique(np.argmax(points @ directions.T, axis=0))]
    return chosen


def inertia_of(parameters: Mapping[str, float]) -> np.ndarray:
    """Return the inertia tensor (kg m2) of the parameters `inertia.*`, shape (3, 3)."""
    inertia = np.zeros((3, 3))
    for name, (i, j) in INERTIA_INDICES.items():
        inertia[i, j] = inertia[j, i] = parameters[name]
    return inertia


def inertia_problems(inertia: np.ndarray) -> Iterator[str]:
    """Yield a message if no rigid body has this inertia tensor (kg m2)."""
    tensor = np.asarray(inertia, float)
    if tensor.shape != (3, 3) or not np.isfinite(tensor).all():
        yield f"found {tensor.tolist()}, expected 3 rows of 3 finite numbers"
    elif not np.allclose(tensor, tensor.T, rtol=1e-12, atol=0):
        yield f"found {tensor.tolist()}, expected a symmetric tensor"
    else:
        moments, axes = np.linalg.eigh(tensor)  # in ascending order
        small, middle, large = moments.tolist()
        if small <= 0:
            yield (
                f"found the principal moments {_moments_text(moments, axes)}, expected all greater "
                "than 0"
            )
        elif large > (small + middle) * (1 + 1e-9):
            text = _moments_text(moments, axes)
            yield (
                f"found the principal moments {text}, expected none greater than the sum of the "
                "other two"
            )


def symmetry_problems(matrix: np.ndarray) -> Iterator[str]:
    """Yield a message if a matrix is not symmetric."""
    if not np.allclose(matrix, matrix.T, rtol=_TOLERANCE, atol=0):
        yield "expected a symmetric matrix"


def eigenvalue_problems(matrix: np.ndarray) -> Iterator[str]:
    """Yield a message if the symmetric part of a matrix is not positive semi-definite.

    The kinetic energy of added mass and the power that damping takes away would be negative for
    some motion.
    """
    lowest = float(np.linalg.eigvalsh((matrix + matrix.T) / 2)[0])
    if lowest < -_TOLERANCE * np.abs(matrix).max():
        yield f"found the eigenvalue {lowest:g}, expected none below 0"


def _moments_text(moments: np.ndarray, axes: np.ndarray) -> str:
    """Return principal moments with their axes in words, in the order of the nearest body axes."""
    nearest = np.argmax(np.abs(axes), axis=0)
    texts = []
    for k in np.argsort(nearest, kind="stable"):
        axis, largest = axes[:, k], axes[nearest[k], k]
        components = ", ".join(f"{round(x / np.sign(largest), 2) + 0.0:g}" for x in axis)
        name = "xyz"[nearest[k]] if abs(largest) > 1 - 1e-9 else f"[{components}]"
        texts.append(f"{moments[k]:.4g} about {name}")
    return ", ".join(texts)


def principal_axes(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the principal moments of inertia and their axes.

    Args:
        inertia: Inertia tensor (kg m2, body frame), shape (3, 3).

    Returns:
        Moments of inertia (kg m2), shape (3,), and the rotation matrix from the principal axes to
        the body frame, shape (3, 3). Its angle is less than 120 degrees; subject to that, the
        moments ascend.
    """
    moments, axes = np.linalg.eigh(inertia)
    for order in permutations(range(3)):
        ordered = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
        for signs in product((1.0, -1.0), repeat=3):
            to_body = ordered * signs[::-1]
            if np.linalg.det(to_body) > 0 and np.trace(to_body) > 0:
                return moments[list(order)], to_body
    raise AssertionError(
        "one of the 24 frames of the principal axes is rotated by less than 63 degrees"
    )
