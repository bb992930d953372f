"""Data of a floating vessel in six degrees of freedom.

One hull or two, whose strips the surface of the water cuts.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from cosim.core.errors import Problem

from ..common.inertia import inertia_problems
from ..common.shapes import Body, Shape
from ..vessel.boat import Boat
from .equilibrium import rest


@dataclass(frozen=True)
class HullForm:
    """Form of one hull or of two equal ones (`vessel/strips.py`).

    Attributes:
        count: Number of hulls, 1 or 2.
        length: Length of the waterline (m).
        beam: Beam of each hull (m).
        offset: Distance of the centre lines of two hulls from the middle (m).
        depth: Height of the hulls from the bottom to the deck edge (m).
        bottom: Height of the bottom above O (m).
        waterplane_centre: Centre of the waterplane ahead of O (m).
        waterplane_coefficient: Area of the waterplane of a hull over length times beam.
        transverse_moment: Second moment of the waterplane about the x axis (m4).
        longitudinal_moment: Second moment about the y axis through its centre (m4).
        vertical_drag_coefficient: Drag coefficient of the bottoms.
        cross_flow_drag_coefficient: Drag coefficient of the immersed sides in cross-flow.
    """

    count: int
    length: float
    beam: float
    offset: float
    depth: float
    bottom: float
    waterplane_centre: float
    waterplane_coefficient: float
    transverse_moment: float
    longitudinal_moment: float
    vertical_drag_coefficient: float = 0.0
    cross_flow_drag_coefficient: float = 0.0

    @property
    def area(self) -> float:
        """Area of the waterplane of all hulls (m2)."""
        return self.count * self.waterplane_coefficient * self.length * self.beam

    @property
    def strip_beam(self) -> float:
        """Beam of a strip (m): two strips side by side cover a single hull."""
        return self.beam / (3 - self.count)

    @property
    def drag_point(self) -> tuple[float, float]:
        """Distances ahead and to port of the four points at which the bottom drag acts (m)."""
        return self.length / 12**0.5, self.offset if self.count == 2 else self.beam / 12**0.5


@dataclass(frozen=True, kw_only=True)
class SurfaceVessel(Boat):
    """A vessel in six degrees of freedom.

    Attributes:
        inertia: Inertia tensor about the centre of mass (kg m2, body frame), shape (3, 3).
        quadratic_damping: Matrix D_q of the load -D_q (|nu_r| nu_r), products by elements, shape
            (6, 6).
        hull: Form of the hulls.
    """

    inertia: np.ndarray
    quadratic_damping: np.ndarray
    hull: HullForm

    @property
    def draught(self) -> float:
        """Mean draught of boxes with the waterplane of the hulls (m)."""
        return self.mass / self.water_density / self.hull.area

    @property
    def metacentric_heights(self) -> tuple[float, float]:
        """Transverse and longitudinal metacentric height (m)."""
        volume = self.mass / self.water_density
        lever = self.hull.bottom + self.draught / 2 - self.centre_of_mass[2]
        return (
            lever + self.hull.transverse_moment / volume,
            lever + self.hull.longitudinal_moment / volume,
        )

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        yield from super().problems()
        yield from (self.problem(text, "inertia") for text in inertia_problems(self.inertia))
        if (np.diag(self.quadratic_damping) < 0).any():
            diagonal = np.diag(self.quadratic_damping).tolist()
            yield self.problem(
                f"found the diagonal {diagonal}, expected numbers of at least 0",
                "quadratic_damping",
            )
        if not self.draught < self.hull.depth:
            text = (
                f"found {self.hull.depth:g}: the vessel sinks, because its draught at rest is "
                f"{self.draught:.4g} m"
            )
            yield self.problem(text, "hull", "depth")
        elif not min(self.metacentric_heights) > 0:
            yield self.problem(self._instability(), "centre_of_mass")
        elif text := self._imbalance():
            yield self.problem(text, "centre_of_mass")

    def _instability(self) -> str:
        """Return the height of the centre of mass, or else the moment of the waterplane, that would make the vessel stable."""
        heights, z = self.metacentric_heights, self.centre_of_mass[2]
        key = (
            "transverse_moment (beam, offset)"
            if heights[0] == min(heights)
            else "longitudinal_moment (length)"
        )
        return (
            f"found z = {z:g} m: the vessel is not stable: its metacentric heights (transverse, "
            "longitudinal) are "
            f"{heights[0]:.4g}, {heights[1]:.4g} m, expected > 0: z must be below "
            f"{z + min(heights):.4g} m, or hull.{key} larger"
        )

    def _imbalance(self) -> str:
        """Return why the vessel does not rest with its deck above the water; "" if it does."""
        x, y, _ = self.centre_of_mass
        if x == self.hull.waterplane_centre and y == 0:
            return ""
        found = (
            f"found {x - self.hull.waterplane_centre:g} m ahead of the centre of the waterplane "
            f"and {y:g} m to port"
        )
        if (attitude := rest(self)) is None:
            return f"{found}: the vessel capsizes"
        if attitude.freeboard > 0:
            return ""
        heel, trim = math.degrees(attitude.heel), math.degrees(attitude.trim)
        return (
            f"{found}: at rest it heels by {heel:.3g} and trims by {trim:.3g} degrees, a deck edge "
            "is under water"
        )

    def body(self, boxes: tuple[Shape, ...]) -> Body:
        """Return the rigid body for Bullet, whose frame has its origin in O.

        Products of inertia have no influence on contact.
        """
        x, y, z = np.diag(self.inertia).tolist()
        return Body(self.mass, (x, y, z), boxes)
