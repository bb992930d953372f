"""What a multirotor is made of, as data: any number of rotors of one kind on a rigid body.

Body frame: x forward, y left, z up, origin at the centre of mass. SI units.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import permutations, product

import numpy as np

from cosim.core.errors import InputError, Problem

from ..common.shapes import Body, Box, Vector, quaternion_from_matrix

BODY_UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True)
class Rotor:
    """Its place in words and its position (m); the unit vector `axis` of its thrust, about which it turns; the sense (+1 or -1)
    in which its reaction turns the body about that axis."""

    label: str
    position: Vector
    torque_sign: float
    axis: Vector = BODY_UP


@dataclass(frozen=True)
class RotorEffects:
    """Start values of the parameters that switch the effects beyond thrust and torque; zero leaves an effect out.

    `rotor_time_constant` s: first-order lag of the rotor speeds. `rotor_inertia` kg m2: of a rotor with its motor about its
    axis. `rotor_drag` kg/rad: force per rotor speed and air speed along x, y and z. `body_drag` kg/m: force per squared air
    speed along x, y and z. `ground_effect`: share of the thrust that the ground effect adds.
    """

    rotor_time_constant: float = 0.0
    rotor_inertia: float = 0.0
    rotor_drag: Vector = (0.0, 0.0, 0.0)
    body_drag: Vector = (0.0, 0.0, 0.0)
    ground_effect: float = 0.0


@dataclass(frozen=True)
class Airframe:
    """A rigid body with rotors.

    `mass` kg; `inertia` (3, 3) kg m2 about the centre of mass, rotors locked; a rotor at the speed n (rad/s, 0 to
    `max_rotor_speed`) pulls with thrust_coefficient n^2 (N s2/rad2) along its axis and turns the body with
    torque_coefficient n^2 (N m s2/rad2); `rotor_radius` m; `gravity` m/s2. Raises InputError with everything that is impossible.
    """

    name: str
    mass: float
    inertia: np.ndarray
    rotors: Sequence[Rotor]
    thrust_coefficient: float
    torque_coefficient: float
    max_rotor_speed: float
    rotor_radius: float
    effects: RotorEffects = field(default_factory=RotorEffects)
    gravity: float = 9.81

    def __post_init__(self) -> None:
        found = (*self._number_problems(), *self._inertia_problems(), *self._rotor_problems())
        if found:
            raise InputError([Problem(text, f"airframe {self.name}") for text in found])

    @property
    def rotor_centre(self) -> Vector:
        """Centre of the rotors (m)."""
        x, y, z = np.mean([rotor.position for rotor in self.rotors], axis=0).tolist()
        return x, y, z

    def _number_problems(self) -> Iterator[str]:
        positive = ("mass", "thrust_coefficient", "torque_coefficient", "max_rotor_speed", "rotor_radius", "gravity")
        for name in positive:
            if not 0 < getattr(self, name) < math.inf:
                yield f"{name}: found {getattr(self, name)!r}, expected a finite number greater than 0"
        for name, value in vars(self.effects).items():
            if not all(0 <= number < math.inf for number in np.ravel(value)):
                yield f"effects.{name}: found {value!r}, expected finite numbers of at least 0"

    def _inertia_problems(self) -> Iterator[str]:
        tensor = np.asarray(self.inertia, float)
        if tensor.shape != (3, 3) or not np.isfinite(tensor).all():
            yield f"inertia: found {tensor.tolist()}, expected 3 rows of 3 finite numbers"
        elif not np.allclose(tensor, tensor.T, rtol=1e-12, atol=0):
            yield f"inertia: found {tensor.tolist()}, expected a symmetric tensor"
        else:
            yield from _principal_moment_problems(np.linalg.eigvalsh(tensor))

    def _rotor_problems(self) -> Iterator[str]:
        if not self.rotors:
            yield "rotors: found none, expected at least one"
        for number, rotor in enumerate(self.rotors, 1):
            if rotor.torque_sign not in (1, -1):
                yield f"rotors[{number}].sense: found {rotor.torque_sign!r}, expected 1 or -1"
            if not math.isclose(math.hypot(*rotor.axis), 1, rel_tol=1e-9):
                yield f"rotors[{number}].axis: found {rotor.axis}, expected a unit vector"
            if not all(map(math.isfinite, rotor.position)):
                yield f"rotors[{number}].position: found {rotor.position}, expected finite numbers"

    def principal_axes(self) -> tuple[np.ndarray, np.ndarray]:
        """Principal moments of inertia (3,) and the rotation (3, 3), by clearly less than half a turn, from their frame to the
        body frame; the moments ascend as far as that is possible."""
        moments, axes = np.linalg.eigh(self.inertia)
        for order in permutations(range(3)):
            ordered = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
            for signs in product((1.0, -1.0), repeat=3):
                turn = ordered * signs[::-1]
                if np.linalg.det(turn) > 0 and np.trace(turn) > 0:
                    return moments[list(order)], turn
        raise AssertionError("one of the 24 frames of the principal axes is turned by less than 63 degrees")

    def body(self, boxes: Callable[[np.ndarray], tuple[Box, ...]]) -> Body:
        """What Bullet knows of it, in the principal-axis frame; `boxes` are made for the rotation (3, 3) to the body frame."""
        moments, to_body = self.principal_axes()
        x, y, z = moments.tolist()
        return Body(self.mass, (x, y, z), boxes(to_body), axes=quaternion_from_matrix(to_body))


def _principal_moment_problems(moments: np.ndarray) -> Iterator[str]:
    """What is wrong with principal moments of inertia in ascending order; no body has one above the sum of the others."""
    small, middle, large = moments.tolist()
    if small <= 0:
        yield f"inertia: found the principal moments {moments.tolist()}, expected them greater than 0"
    elif large > (small + middle) * (1 + 1e-9):
        yield f"inertia: found the principal moments {moments.tolist()}, expected none greater than the sum of the others"
