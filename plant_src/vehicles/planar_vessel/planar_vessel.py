"""Vessels in the horizontal plane (surge, sway, yaw): reader of their data, and variables."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import Problem

from ..common.interface import (
    CURRENT_INPUTS,
    EXTERNAL_LOADS,
    PLANAR_STATES,
    VESSEL_OUTPUTS,
    WIND_INPUTS,
    element_states,
    initial_variables,
    matrix_parameter,
    parameter,
)
from ..common.shapes import Body, Boxes
from ..vessel import boat as boat_data
from ..vessel.actuators import actuator_inputs, actuator_parameters
from ..vessel.boat import Boat, BoatReader, boat_parameters


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
        yield from self.size_problems("yaw_inertia")
        diagonal = [float(matrix[k, k]) for k, matrix in enumerate(self.quadratic_damping)]
        if min(diagonal) < 0:
            found = f"found the coefficients {diagonal} of |u| u, |v| v and |r| r"
            yield self.problem(f"{found}, expected at least 0", "quadratic_damping")
        if min(self.cubic_damping) < 0:
            text = f"found {list(self.cubic_damping)}, expected numbers of at least 0"
            yield self.problem(text, "cubic_damping")

    def body(self, boxes: Boxes) -> Body:
        """Return the rigid body for Bullet, whose frame has its origin in the centre of mass.

        The collision shape in the body frame is relative to O.
        """
        x, y, z = self.centre_of_mass
        shifted = tuple(box.moved((-x, -y, -z)) for box in boxes(np.eye(3)))
        # the inertia about the other axes has no effect, because the vessel cannot roll or pitch
        inertia = (self.yaw_inertia,) * 3
        return Body(self.mass, inertia, shifted, self.height + z)


#: required keys of the file
KEYS = (*boat_data.KEYS, "yaw_inertia")
_OPTIONAL_KEYS = (*boat_data.OPTIONAL_KEYS, "height", "quadratic_damping", "cubic_damping")


class PlanarVesselReader(BoatReader[PlanarVessel]):
    """Reader of the data of a planar vessel (`plant_src/vehicles/data/README.md`)."""

    keys, optional_keys, vehicle_class = KEYS, _OPTIONAL_KEYS, PlanarVessel
    velocities = ("u", "v", "r")

    def read_values(self, data: Mapping[str, Any]) -> dict[str, Any]:
        """Read the attributes of the vessel, and the collision shape."""
        boxes = self.read_boxes(data)
        a, b, c = self.vector_quantity(
            data.get("cubic_damping", [0.0] * 3), ("cubic_damping",), "1", self.velocities
        )
        return {
            **self.read_boat(data, boxes),
            "yaw_inertia": self.entry(data, "yaw_inertia", "kg.m2", above=0.0),
            "height": self.entry(data, "height", "m", 0.0),
            "quadratic_damping": self.read_quadratic_damping(data),
            "cubic_damping": (a, b, c),
        }

    def read_quadratic_damping(self, data: Mapping[str, Any]) -> tuple[np.ndarray, ...]:
        """Read the matrices of |u|, |v| and |r|.

        They may be one matrix, whose columns belong to |u| u, |v| v and |r| r.
        """
        key, zero = "quadratic_damping", [0.0] * 3
        value = data.get(key, zero)
        if isinstance(value, Mapping) and "value" not in value:
            given = self.read_data(value, (key,), (), self.velocities)
            return tuple(
                self.read_nu_matrix(given, letter, zero, (key,)) for letter in self.velocities
            )
        matrix = self.read_nu_matrix(data, key, zero)
        return tuple(np.where(np.arange(3) == k, matrix, 0.0) for k in range(3))


_INITIAL_PARAMETERS = initial_variables("xy", "uv", "r")


def variables(vessel: PlanarVessel, slots: tuple[int, int] | None = None) -> tuple[Variable, ...]:
    """Return parameters, inputs and outputs, in the order of the equations.

    Parameters other than `initial.*` start at the values of the vessel.

    Args:
        vessel: Data of the vessel.
        slots: Numbers of elements of the arrays of propellers and rudders. None means the numbers
            of the vessel.
    """
    slots = slots or vessel.slots
    return (
        *_INITIAL_PARAMETERS,
        parameter("mass", "kg", vessel.mass, "total mass", 0.0),
        parameter(
            "yaw_inertia",
            "kg.m2",
            vessel.yaw_inertia,
            "moment of inertia about the vertical axis through the centre of mass",
            0.0,
        ),
        *boat_parameters(vessel, "u, v, r"),
        *_damping_parameters(vessel),
        parameter("height", "m", vessel.height, "height of O above the still water"),
        *actuator_parameters(vessel.propellers, vessel.rudders, slots),
        *EXTERNAL_LOADS,
        *actuator_inputs(vessel.propellers, vessel.rudders, slots),
        *WIND_INPUTS,
        *CURRENT_INPUTS,
        *VESSEL_OUTPUTS,
    )


def _damping_parameters(vessel: PlanarVessel) -> Iterator[Variable]:
    dampings = zip("uvr", vessel.quadratic_damping, vessel.cubic_damping, strict=True)
    for letter, matrix, value in dampings:
        text = f"load over |{letter}| times velocity, for u, v, r"
        yield matrix_parameter(f"quadratic_damping.{letter}", text, matrix)
        text = f"load over {letter} cubed, SI units"
        yield parameter(f"cubic_damping.{letter}", "1", value, text, 0.0)


def states(propeller_slots: int) -> tuple[str, ...]:
    """Return the names of the states: those of a planar body, then the propeller speeds."""
    return (*PLANAR_STATES, *element_states("propeller_speed", propeller_slots))
