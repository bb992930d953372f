"""Data of a submerged vehicle: a rigid body in water with thrusters.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units. Matrices (6, 6) belong
to (u, v, w, p, q, r).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.core.errors import InputError, Problem

from ..common.inertia import Boxes, inertia_problems, principal_body
from ..common.shapes import Body, Vector

#: largest number of thrusters
MAX_THRUSTERS = 16

_SYMMETRY_TOLERANCE = 1e-9


@dataclass(frozen=True)
class Thruster:
    """One thruster.

    Attributes:
        label: Place of the thruster in words.
        position: Centre of the propeller from the centre of mass (m, body frame).
        axis: Unit vector of the thrust at a positive speed (body frame).
        thrust_coefficient: Thrust over squared speed at positive speeds (N s2/rad2).
        reverse_thrust_coefficient: The same at negative speeds.
        torque_coefficient: Reaction torque on the body about the axis over squared speed (N m
            s2/rad2), with its sign at positive speeds.
    """

    label: str
    position: Vector
    axis: Vector
    thrust_coefficient: float
    reverse_thrust_coefficient: float
    torque_coefficient: float = 0.0


@dataclass(frozen=True)
class Craft:
    """A rigid body in water with thrusters.

    Attributes:
        name: Name of the model.
        mass: Total mass with the water in free-flooding spaces (kg).
        inertia: Inertia tensor about the centre of mass (kg m2, body frame), shape (3, 3).
        displaced_volume: Volume of water that the submerged vehicle displaces (m3).
        centre_of_buoyancy: Centre of this volume (m, body frame).
        size: Edges of the box over which this volume is distributed (m); it matters at the surface
            only.
        added_mass: Added mass about the centre of mass, shape (6, 6).
        linear_damping: Matrix D_l of the load -D_l nu_r, shape (6, 6).
        quadratic_damping: Matrix D_q of the load -D_q (|nu_r| nu_r), products by elements, shape
            (6, 6).
        thrusters: All thrusters, at most MAX_THRUSTERS.
        max_thruster_speed: Largest magnitude of the thruster speeds (rad/s).
        thruster_radius: Radius of the propellers (m).
        thruster_time_constant: Time constant of the thruster speeds (s); 0: no lag.
        advance_coefficient: Loss of thrust over speed and axial velocity of the water (kg/rad).
        gravity: Gravitational acceleration (m/s2).
        water_density: Density of the water (kg/m3).

    Raises:
        InputError: For physically impossible values, all together; a problem's subject begins with
            the name of the attribute.
    """

    name: str
    mass: float
    inertia: np.ndarray
    displaced_volume: float
    centre_of_buoyancy: Vector
    size: Vector
    added_mass: np.ndarray
    linear_damping: np.ndarray
    quadratic_damping: np.ndarray
    thrusters: Sequence[Thruster]
    max_thruster_speed: float
    thruster_radius: float
    thruster_time_constant: float = 0.0
    advance_coefficient: float = 0.0
    gravity: float = 9.81
    water_density: float = 1025.0

    def __post_init__(self) -> None:
        if problems := [
            *self._inertia_problems(),
            *self._matrix_problems(),
            *self._thruster_problems(),
        ]:
            raise InputError(problems)

    def _problem(self, text: str, *subject: str) -> Problem:
        return Problem(text, f"submerged vehicle {self.name}: {'.'.join(subject)}", subject)

    def _inertia_problems(self) -> Iterator[Problem]:
        if not 0 < self.mass < math.inf:
            yield self._problem(
                f"found {self.mass!r}, expected a finite number greater than 0", "mass"
            )
        yield from (self._problem(text, "inertia") for text in inertia_problems(self.inertia))

    def _matrix_problems(self) -> Iterator[Problem]:
        added = self.added_mass
        if not np.allclose(added, added.T, rtol=_SYMMETRY_TOLERANCE, atol=0):
            yield self._problem("expected a symmetric matrix", "added_mass")
        for name in ("added_mass", "linear_damping"):
            matrix = getattr(self, name)
            if (
                lowest := float(np.linalg.eigvalsh((matrix + matrix.T) / 2)[0])
            ) < -_SYMMETRY_TOLERANCE * np.abs(matrix).max():
                yield self._problem(
                    (
                        f"found the eigenvalue {lowest:g}, expected none below 0: energy is not "
                        "generated"
                    ),
                    name,
                )
        if (np.diag(self.quadratic_damping) < 0).any():
            diagonal = np.diag(self.quadratic_damping).tolist()
            yield self._problem(
                f"found the diagonal {diagonal}, expected numbers of at least 0",
                "quadratic_damping",
            )

    def _thruster_problems(self) -> Iterator[Problem]:
        if not 1 <= len(self.thrusters) <= MAX_THRUSTERS:
            yield self._problem(
                f"found {len(self.thrusters) or 'none'}, expected 1 to {MAX_THRUSTERS}", "thrusters"
            )

    def body(self, boxes: Boxes) -> Body:
        """Return the rigid body for Bullet, in the principal axes."""
        return principal_body(self.mass, self.inertia, boxes)
