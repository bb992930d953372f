"""Forces and torques of rotors and air on a multirotor, as CasADi expressions.

`multirotor_equations.py` has the formulas.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from cosim.export.equations.c_code import Callee
from cosim.export.equations.simd_sum import sum_over_rows

from ..common import kinematics
from ..common.named_values import NamedValues
from .ground_effect import AIR_DENSITY, create_reductions, thrust_factor
from .interface import ROTOR_TABLE_COLUMNS, table_rows


def rotor_table(parameters: NamedValues, slots: int) -> ca.SX:
    """Return position, axis, thrust and torque coefficient of each rotor, shape (table_rows(slots), ROTOR_TABLE_COLUMNS)."""
    names = [f"{group}.{axis}" for group in ("rotor_position", "rotor_axis") for axis in "xyz"]
    columns = [parameters[name] for name in (*names, "thrust_coefficient", "torque_coefficient")]
    return ca.vertcat(
        ca.horzcat(*columns), ca.SX.zeros(table_rows(slots) - slots, ROTOR_TABLE_COLUMNS)
    )


def still_air_loads(table: ca.SX, slots: int) -> ca.SX:
    """Return the matrix (6, slots) from squared rotor speeds to force (N) and torque about the centre of mass (N m)."""
    loads = []
    for k in range(slots):
        position, axis, thrust, torque = table[k, 0:3].T, table[k, 3:6].T, table[k, 6], table[k, 7]
        loads.append(ca.vertcat(thrust * axis, ca.cross(position, thrust * axis) + torque * axis))
    return ca.horzcat(*loads)


def create_still_air_load(slots: int) -> Callee:
    """Create the function of all rotors' load in still air far from a surface.

    Args:
        slots: Number of elements of the arrays of rotors.

    Returns:
        Function of the matrix of `still_air_loads`, the number of rotors and the speeds (rad/s).
        Its result has the shape (6,).
    """
    arguments = matrix, _, speed = (
        ca.SX.sym("matrix", 6, slots),
        ca.SX.sym("count"),
        ca.SX.sym("speed", slots),
    )
    return Callee(ca.Function("still_air_load", arguments, [matrix @ speed**2]), _STILL_AIR_LOAD_C)


_STILL_AIR_LOAD_C = """{
    for (int j = 0; j < 6; ++j) out[0][j] = 0;
    for (int i = 0; i < in[1][0]; ++i) {
        const double *const column = in[0] + 6 * i, squared = in[2][i] * in[2][i];
        for (int j = 0; j < 6; ++j) out[0][j] += column[j] * squared;
    }
}
"""


#: largest ratio of the air speed in the plane of a rotor to the speed of its tips for which the
#: translational lift grows
MAX_ADVANCE_RATIO = 0.5


def _rotor_term() -> ca.Function:
    """Return the function of one rotor to its load.

    Its arguments are (air velocity, rates, rotor drag, gain of the ground effect, 2 rho A,
    translational lift, rotor radius), (speed, reduction of the inflow by the ground effect) and the
    row of the rotor.
    """
    common, moving, row = (
        ca.SX.sym("common", 13),
        ca.SX.sym("moving", 2),
        ca.SX.sym("row", ROTOR_TABLE_COLUMNS),
    )
    (air, rates, drag), (gain, wake, lift, radius) = (
        ca.vertsplit(common[0:9], 3),
        ca.vertsplit(common[9:13]),
    )
    (speed, reduction), (position, axis) = ca.vertsplit(moving), ca.vertsplit(row[0:6], 3)
    squared = speed**2
    local_air = air + ca.cross(rates, position)
    in_plane = ca.dot(local_air, local_air) - ca.dot(local_air, axis) ** 2
    thrust = row[6] * squared
    pull = thrust_factor(reduction, gain, thrust, in_plane, wake) * thrust
    pull += lift * ca.fmin(in_plane, (MAX_ADVANCE_RATIO * radius) ** 2 * squared)
    force = pull * axis - speed * drag * local_air
    torque = ca.cross(position, force) + row[7] * squared * axis
    return ca.Function("rotor_load", [common, moving, row], [ca.vertcat(force, torque)])


@dataclass(frozen=True)
class RotorFunctions:
    """Functions of all rotors that remain calls in the generated C code.

    Attributes:
        slots: Number of elements of the arrays of rotors.
    """

    slots: int

    @property
    def callees(self) -> tuple[Callee, ...]:
        """All functions."""
        return self.inflow_reductions, self.still_air_load, self.load_sum

    @cached_property
    def inflow_reductions(self) -> Callee:
        """Reductions of the inflow by the ground effect."""
        return create_reductions(self.slots)

    @cached_property
    def still_air_load(self) -> Callee:
        """Sum of the loads of all rotors in still air."""
        return create_still_air_load(self.slots)

    @cached_property
    def load_sum(self) -> Callee:
        """Sum of the loads of all rotors in moving air."""
        return sum_over_rows("rotor_loads", _rotor_term(), table_rows(self.slots))

    def ground_reductions(self, inputs: NamedValues, constants: NamedValues) -> ca.SX:
        """Return the relative reduction of each hovering rotor's inflow by the surface below, shape (slots,)."""
        common = ca.vertcat(
            inputs["ground_distance"], constants["rotor_radius"], constants["rotor_count"]
        )
        return self.inflow_reductions(
            common, constants["rotor_position.x"], constants["rotor_position.y"]
        )

    def aerodynamic_loads(
        self,
        state: ca.SX,
        speed: ca.SX,
        reductions: ca.SX,
        inputs: NamedValues,
        constants: NamedValues,
    ) -> tuple[ca.SX, ca.SX]:
        """Return force (N) and torque (N m) of rotors and body in moving air, body frame.

        Args:
            state: States of the rigid body.
            speed: Rotor speeds (rad/s), shape (slots,).
            reductions: Result of `ground_reductions`.
            inputs: Inputs of the model.
            constants: Constants of the equations.
        """
        air = kinematics.rotation_matrix(state[3:7]).T @ (state[7:10] - inputs["wind"])
        padding = ca.SX.zeros(table_rows(self.slots) - self.slots)
        moving = ca.vertcat(speed, padding, reductions, padding)
        gain, radius = (
            constants["ground_effect"] * inputs["ground_share"],
            constants["rotor_radius"],
        )
        wake = 2 * math.pi * AIR_DENSITY * radius**2
        rotors = (gain, wake, constants["translational_lift"], radius)
        common = ca.vertcat(air, state[10:13], constants["rotor_drag"], *rotors)
        rows = table_rows(self.slots)
        load = self.load_sum(
            common, constants["rotor_count"], ca.reshape(moving, rows, 2), constants["rotor_table"]
        )
        return load[0:3] - ca.norm_2(air) * constants["body_drag"] * air, load[3:6]


def gyroscopic_torque(rates: ca.SX, momentum: ca.SX, momentum_rate: ca.SX) -> ca.SX:
    """Return the torque (N m, body frame) of spinning rotors on a rotating body, and of their acceleration.

    Args:
        rates: Angular velocity of the body (rad/s).
        momentum: Angular momentum of the rotors relative to the body (N m s).
        momentum_rate: Its time derivative in the body frame (N m).
    """
    return -(ca.cross(rates, momentum) + momentum_rate)
