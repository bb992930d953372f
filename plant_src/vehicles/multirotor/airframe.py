"""Data of a multirotor: a rigid body with rotors.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from cosim.core.errors import InputError, Problem

from ..common.inertia import Boxes, inertia_problems, principal_body
from ..common.shapes import BODY_UP, Body, Vector

#: largest number of rotors
MAX_ROTORS = 16


@dataclass(frozen=True)
class Rotor:
    """One rotor.

    Attributes:
        label: Place of the rotor in words, for example "front left".
        position: Hub from the centre of mass (m, body frame).
        torque_sign: Sign (+1 or -1) of the reaction torque on the body about `axis`.
        thrust_coefficient: Thrust over squared speed (N s2/rad2).
        torque_coefficient: Reaction torque over squared speed (N m s2/rad2).
        axis: Unit vector of the thrust (body frame), which is also the axis of rotation.
    """

    label: str
    position: Vector
    torque_sign: float
    thrust_coefficient: float
    torque_coefficient: float
    axis: Vector = BODY_UP


@dataclass(frozen=True)
class RotorEffects:
    """Start values of the parameters of all effects beyond thrust and torque.

    Zero switches an effect off.

    Attributes:
        rotor_time_constant: Time constant of the first-order lag of the rotor speeds (s).
        rotor_inertia: Moment of inertia of a rotor with its motor about its axis (kg m2).
        rotor_drag: Force per rotor speed and air speed along x, y and z (kg/rad, body frame).
        body_drag: Force per squared air speed along x, y and z (kg/m, body frame).
        ground_effect: Fraction of the ground effect's thrust that is applied (0 to 1).
        translational_lift: Thrust of a rotor over the square of the air speed in its plane (kg/m).
    """

    rotor_time_constant: float = 0.0
    rotor_inertia: float = 0.0
    rotor_drag: Vector = (0.0, 0.0, 0.0)
    body_drag: Vector = (0.0, 0.0, 0.0)
    ground_effect: float = 0.0
    translational_lift: float = 0.0


@dataclass(frozen=True)
class Hull:
    """The body in water; a hull without volume and size is not affected by water.

    Attributes:
        size: Edges of the box around the body (m, body frame).
        volume: Volume of water that the submerged vehicle displaces (m3).
        drag_coefficient: Drag coefficient of the box (1).
    """

    size: Vector = (0.0, 0.0, 0.0)
    volume: float = 0.0
    drag_coefficient: float = 1.0


@dataclass(frozen=True)
class Airframe:
    """A rigid body with rotors.

    Attributes:
        name: Name of the model.
        mass: Total mass (kg).
        inertia: Inertia tensor about the centre of mass with locked rotors (kg m2, body frame),
            shape (3, 3).
        rotors: All rotors, at most MAX_ROTORS.
        max_rotor_speed: Upper limit of the rotor speeds (rad/s); the lower limit is 0.
        rotor_radius: Radius of a rotor (m).
        effects: Start values of the further effects.
        gravity: Gravitational acceleration (m/s2).
        hull: The body in water.

    Raises:
        InputError: For physically impossible values, all together; a problem's subject begins with
            the name of the attribute.
    """

    name: str
    mass: float
    inertia: np.ndarray
    rotors: Sequence[Rotor]
    max_rotor_speed: float
    rotor_radius: float
    effects: RotorEffects = field(default_factory=RotorEffects)
    gravity: float = 9.81
    hull: Hull = field(default_factory=Hull)

    def __post_init__(self) -> None:
        problems = [*self._number_problems(), *self._inertia_problems(), *self._rotor_problems()]
        if problems:
            raise InputError(problems)

    @property
    def rotor_disc(self) -> tuple[Vector, float]:
        """Mean position of the rotors (m, body frame), and radius (m) of the disc around it that contains their discs."""
        hubs = np.array([rotor.position for rotor in self.rotors])
        x, y, z = hubs.mean(axis=0).tolist()
        return (x, y, z), float(np.hypot(hubs[:, 0] - x, hubs[:, 1] - y).max()) + self.rotor_radius

    @property
    def lift(self) -> float:
        """Sum of the thrusts of all rotors at full speed along z (N, body frame)."""
        return self.max_rotor_speed**2 * sum(
            rotor.thrust_coefficient * rotor.axis[2] for rotor in self.rotors
        )

    def _problem(self, text: str, *subject: str) -> Problem:
        return Problem(text, f"airframe {self.name}: {'.'.join(subject)}", subject)

    def _number_problems(self) -> Iterator[Problem]:
        positive = ("mass", "max_rotor_speed", "rotor_radius", "gravity")
        for name in positive:
            if not 0 < getattr(self, name) < math.inf:
                yield self._problem(
                    f"found {getattr(self, name)!r}, expected a finite number greater than 0", name
                )
        for part in ("effects", "hull"):
            for name, value in vars(getattr(self, part)).items():
                if not all(0 <= number < math.inf for number in np.ravel(value)):
                    yield self._problem(
                        f"found {value!r}, expected finite numbers of at least 0", part, name
                    )

    def _inertia_problems(self) -> Iterator[Problem]:
        return (self._problem(text, "inertia") for text in inertia_problems(self.inertia))

    def _rotor_problems(self) -> Iterator[Problem]:
        if not 1 <= len(self.rotors) <= MAX_ROTORS:
            yield self._problem(
                f"found {len(self.rotors) or 'none'}, expected 1 to {MAX_ROTORS}", "rotors"
            )
        for number, rotor in enumerate(self.rotors, 1):
            name = f"rotors[{number}]"
            for coefficient in ("thrust_coefficient", "torque_coefficient"):
                if not 0 <= (value := getattr(rotor, coefficient)) < math.inf:
                    yield self._problem(
                        f"found {value!r}, expected a finite number of at least 0",
                        name,
                        coefficient,
                    )
            if rotor.torque_sign not in (1, -1):
                yield self._problem(
                    f"found {rotor.torque_sign!r}, expected 1 or -1", name, "torque_sign"
                )
            if not math.isclose(math.hypot(*rotor.axis), 1, rel_tol=1e-9):
                yield self._problem(f"found {rotor.axis}, expected a unit vector", name, "axis")
            if not all(map(math.isfinite, rotor.position)):
                yield self._problem(
                    f"found {rotor.position}, expected finite numbers", name, "position"
                )

    def body(self, boxes: Boxes) -> Body:
        """Return the rigid body for Bullet, in the principal axes."""
        return principal_body(self.mass, self.inertia, boxes)
