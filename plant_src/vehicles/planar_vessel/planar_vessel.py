"""Data of a vessel that moves in the horizontal plane: surge, sway and yaw."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cosim.core.errors import Problem

from ..common.shapes import Body, Shape
from ..vessel.boat import Boat


@dataclass(frozen=True, kw_only=True)
class PlanarVessel(Boat):
    """A vessel in the horizontal plane.

    Attributes:
        yaw_inertia: Moment of inertia about the vertical axis through the centre of mass (kg m2).
        height: Height of O above the still water (m).
        quadratic_damping: Matrices D_u, D_v, D_r of the load -(|u| D_u + |v| D_v + |r| D_r) nu_r,
            each of shape (3, 3).
        cubic_damping: Elements of the load -d_i nu_i^3 for u, v and r.
    """

    yaw_inertia: float
    height: float
    quadratic_damping: tuple[np.ndarray, np.ndarray, np.ndarray]
    cubic_damping: tuple[float, float, float]

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from super().problems()
        if not 0 < self.yaw_inertia < math.inf:
            yield self.problem(
                f"found {self.yaw_inertia!r}, expected a finite number greater than 0",
                "yaw_inertia",
            )
        diagonal = [float(matrix[k, k]) for k, matrix in enumerate(self.quadratic_damping)]
        if min(diagonal) < 0:
            yield self.problem(
                f"found the coefficients {diagonal} of |u| u, |v| v and |r| r, expected at least 0",
                "quadratic_damping",
            )
        if min(self.cubic_damping) < 0:
            yield self.problem(
                f"found {list(self.cubic_damping)}, expected numbers of at least 0", "cubic_damping"
            )

    def body(self, boxes: tuple[Shape, ...]) -> Body:
        """Return the rigid body for Bullet, whose frame has its origin in the centre of mass.

        `boxes` are relative to O.
        """
        x, y, z = self.centre_of_mass
        shifted = tuple(box.moved((-x, -y, -z)) for box in boxes)
        inertia = (
            self.yaw_inertia,
        ) * 3  # that about the other axes has no effect, because the vessel cannot roll or pitch
        return Body(self.mass, inertia, shifted, self.height + z)
