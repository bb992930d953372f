"""What Bullet knows of a vehicle: mass, inertia and collision shapes."""

from __future__ import annotations

import math
from itertools import product
from typing import NamedTuple

import numpy as np

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]


class Box(NamedTuple):
    """A box in the frame of its body: half of its edges (m), its centre (m) and its orientation (x, y, z, w)."""

    half_extents: Vector
    position: Vector
    orientation: Quaternion = (0.0, 0.0, 0.0, 1.0)

    def corners(self) -> np.ndarray:
        """Positions (8, 3) of the corners in the frame of the body."""
        local = np.array(list(product((-1, 1), repeat=3))) * self.half_extents
        axis, w = np.array(self.orientation[:3]), self.orientation[3]
        turned = np.cross(axis, local)
        return self.position + local + 2 * (w * turned + np.cross(axis, turned))


class Body(NamedTuple):
    """A rigid body in a frame at its centre of mass: mass (kg), moments of inertia (kg m2) about the frame's axes, shapes.

    `height` (m) is that of the centre of mass of a vessel that moves in the plane; `axes` is the orientation of the frame in that
    of the vehicle (x, y, z, w).
    """

    mass: float
    inertia: Vector
    boxes: tuple[Box, ...]
    height: float = 0.0
    axes: Quaternion = (0.0, 0.0, 0.0, 1.0)


def level_box(to_body: np.ndarray, edges: tuple[float, float], bottom: float, top: float) -> Box:
    """A box level in the body frame, about its z axis, in the frame that `to_body` (3, 3) turns into the body frame.

    `edges` along x and y (m), `bottom` and `top` heights above the centre of mass (m).
    """
    x, y, z = (to_body.T @ [0.0, 0.0, (top + bottom) / 2]).tolist()
    return Box((edges[0] / 2, edges[1] / 2, (top - bottom) / 2), (x, y, z), quaternion_from_matrix(to_body.T))


def quaternion_from_matrix(rotation: np.ndarray) -> Quaternion:
    """The unit quaternion (x, y, z, w) of a rotation matrix (3, 3) that turns by clearly less than half a turn."""
    w = math.sqrt(1 + np.trace(rotation)) / 2
    x, y, z = (rotation[k - 1, k - 2] - rotation[k - 2, k - 1] for k in range(3))
    return float(x / (4 * w)), float(y / (4 * w)), float(z / (4 * w)), w
