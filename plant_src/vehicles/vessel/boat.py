"""Data of vessels that are given by JSON files.

What the planar and the floating family have in common.

Body frame: x forward, y left, z up; its origin O is any point of the centre plane that the file
chooses. SI units. Matrices belong to (u, v, r) of a planar vessel and to (u, v, w, p, q, r) of a
floating one, about O.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import InputError, Problem
from cosim.core.units import parse_unit

from ..common.interface import parameter
from ..common.shapes import Vector
from .actuators import MAX_PROPELLERS, MAX_RUDDERS, Propeller, Rudder

_SYMMETRY_TOLERANCE = 1e-9


@dataclass(frozen=True, kw_only=True)
class Boat:
    """A rigid body on the water with propellers and rudders.

    Attributes:
        name: Name of the model.
        mass: Mass (kg).
        centre_of_mass: Centre of mass from O (m).
        added_mass: Added mass M_A, shape (n, n).
        coriolis_added_mass: Part of M_A whose Coriolis loads the damping does not contain, shape
            (n, n).
        linear_damping: Matrix D of the load -D nu_r, shape (n, n).
        air_drag: Force over squared air velocity along x and y (kg/m).
        air_centre: Point at which this force acts (m).
        deck_centre: Centre of the top of the landing deck (m).
        propellers: All propellers, at most MAX_PROPELLERS.
        rudders: All rudders, at most MAX_RUDDERS.
        water_density: Density of the water (kg/m3).

    Raises:
        InputError: For physically impossible values, all together; a problem's subject begins with
            the name of the attribute.
    """

    name: str
    mass: float
    centre_of_mass: Vector
    added_mass: np.ndarray
    coriolis_added_mass: np.ndarray
    linear_damping: np.ndarray
    air_drag: tuple[float, float]
    air_centre: Vector
    deck_centre: Vector
    propellers: Sequence[Propeller]
    rudders: Sequence[Rudder]
    water_density: float = 1025.0

    def __post_init__(self) -> None:
        if problems := list(self.problems()):
            raise InputError(problems)

    def problems(self) -> Iterator[Problem]:
        """Yield what is physically impossible."""
        if not 0 < self.mass < math.inf:
            yield self.problem(
                f"found {self.mass!r}, expected a finite number greater than 0", "mass"
            )
        for name in ("added_mass", "coriolis_added_mass"):
            if not np.allclose(
                getattr(self, name), getattr(self, name).T, rtol=_SYMMETRY_TOLERANCE, atol=0
            ):
                yield self.problem("expected a symmetric matrix", name)
        added = self.added_mass
        if (
            lowest := float(np.linalg.eigvalsh((added + added.T) / 2)[0])
        ) < -_SYMMETRY_TOLERANCE * np.abs(added).max():
            yield self.problem(
                f"found the eigenvalue {lowest:g}, expected none below 0", "added_mass"
            )
        if (
            diagonal := np.diag(self.linear_damping)
        ).min() < 0:  # published matrices also contain lift, off the diagonal
            yield self.problem(
                f"found the diagonal {diagonal.tolist()}, expected numbers of at least 0",
                "linear_damping",
            )
        for name, most, least in (("propellers", MAX_PROPELLERS, 1), ("rudders", MAX_RUDDERS, 0)):
            if not least <= (count := len(getattr(self, name))) <= most:
                yield self.problem(f"found {count or 'none'}, expected {least} to {most}", name)
        for i, rudder in enumerate(self.rudders):
            if rudder.propeller > len(self.propellers):
                text = (
                    f"found {rudder.propeller}, expected the number of a propeller, 1 to "
                    f"{len(self.propellers)}"
                )
                yield self.problem(text, "rudders", str(i), "propeller")

    def problem(self, text: str, *subject: str) -> Problem:
        """Return a problem of an attribute."""
        return Problem(text, f"vessel {self.name}: {'.'.join(subject)}", subject)

    @property
    def slots(self) -> tuple[int, int]:
        """Numbers of propellers and rudders."""
        return len(self.propellers), len(self.rudders)


def matrix_parameter(name: str, description: str, matrix: np.ndarray) -> Variable:
    """Return a parameter that is a matrix, in SI units."""
    start = tuple(np.ravel(matrix).tolist())
    return Variable(
        name,
        "Float64",
        "parameter",
        "fixed",
        start,
        parse_unit("1"),
        matrix.shape,
        f"{description}, SI units",
    )


def vector_parameters(
    name: str, letters: str, unit: str, description: str, values: Sequence[float]
) -> Iterator[Variable]:
    """Yield a parameter for each component of a vector."""
    for letter, value in zip(letters, values, strict=True):
        yield parameter(
            f"{name}.{letter}", unit, float(value), f"{description}: {letter}, body frame"
        )


def boat_parameters(boat: Boat, velocities: str) -> Iterator[Variable]:
    """Yield the parameters of both families; `velocities` are the names of the elements of nu."""
    yield from vector_parameters(
        "centre_of_mass", "xyz", "m", "centre of mass from O", boat.centre_of_mass
    )
    yield parameter("water_density", "kg/m3", boat.water_density, "density of the water", 0.0)
    for name, text in (
        ("added_mass", "added mass about O"),
        ("coriolis_added_mass", "added mass in the Coriolis loads"),
        ("linear_damping", "load over velocity relative to the water"),
    ):
        yield matrix_parameter(name, f"{text}, for {velocities}", getattr(boat, name))
    yield from vector_parameters(
        "air_drag", "xy", "kg/m", "force over squared air velocity", boat.air_drag
    )
    yield from vector_parameters(
        "air_centre", "xyz", "m", "point at which the air drag acts, from O", boat.air_centre
    )
    yield from vector_parameters(
        "deck_centre", "xyz", "m", "centre of the top of the landing deck, from O", boat.deck_centre
    )
