"""Forces and torques of rotors and air on a multirotor, as CasADi expressions; `multirotor_equations.py` has the formulas."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca

from cosim.export.equations.c_code import Callee
from cosim.export.equations.simd_sum import sum_over_rows

from ..common import kinematics
from ..common.named_values import NamedValues
from .ground_effect import create_thrust_factors
from .interface import ROTOR_TABLE_COLUMNS, table_rows


def rotor_table(parameters: NamedValues, slots: int) -> ca.SX:
    """Return position, axis, thrust and torque coefficient of each rotor, shape (table_rows(slots), ROTOR_TABLE_COLUMNS)."""
    names = [f"{group}.{axis}" for group in ("rotor_position", "rotor_axis") for axis in "xyz"]
    columns = [parameters[name] for name in (*names, "thrust_coefficient", "torque_coefficient")]
    return ca.vertcat(ca.horzcat(*columns), ca.SX.zeros(table_rows(slots) - slots, ROTOR_TABLE_COLUMNS))


def still_air_loads(table: ca.SX, slots: int) -> ca.SX:
    """Return the matrix (6, slots) from squared rotor speeds to force (N) and torque about the centre of mass (N m)."""
    loads = []
    for k in range(slots):
        position, axis, thrust, torque = table[k, 0:3].T, table[k, 3:6].T, table[k, 6], table[k, 7]
        loads.append(ca.vertcat(thrust * axis, ca.cross(position, thrust * axis) + torque * axis))
    return ca.horzcat(*loads)


def _rotor_term() -> ca.Function:
    """Return the function of one rotor: (air velocity, rates, rotor drag), (speed, thrust factor) and its row to its load."""
    common, moving, row = ca.SX.sym("common", 9), ca.SX.sym("moving", 2), ca.SX.sym("row", ROTOR_TABLE_COLUMNS)
    (air, rates, drag), (speed, factor), (position, axis) = (
        ca.vertsplit(common, 3),
        ca.vertsplit(moving),
        ca.vertsplit(row[0:6], 3),
    )
    squared = speed**2
    force = factor * row[6] * squared * axis - speed * drag * (air + ca.cross(rates, position))
    torque = ca.cross(position, force) + row[7] * squared * axis
    return ca.Function("rotor_load", [common, moving, row], [ca.vertcat(force, torque)])


@dataclass(frozen=True)
class RotorFunctions:
    """Functions of all rotors that remain calls in the generated C code.

    Attributes:
        slots: Number of elements of the arrays of rotors.
    """

    slots: int

    @cached_property
    def thrust_factors(self) -> Callee:
        """Factors of the ground effect."""
        return create_thrust_factors(self.slots)

    @cached_property
    def load_sum(self) -> Callee:
        """Sum of the loads of all rotors in moving air."""
        return sum_over_rows("rotor_loads", _rotor_term(), table_rows(self.slots))

    def ground_factors(self, inputs: NamedValues, constants: NamedValues) -> ca.SX:
        """Return the ratio of each rotor's thrust to that in free air, shape (slots,)."""
        common = ca.vertcat(inputs["ground_distance"], constants["rotor_radius"], constants["rotor_count"])
        factors = self.thrust_factors(common, constants["rotor_position.x"], constants["rotor_position.y"])
        return 1 + constants["ground_effect"] * (factors - 1)

    def aerodynamic_loads(
        self, state: ca.SX, speed: ca.SX, factors: ca.SX, inputs: NamedValues, constants: NamedValues
    ) -> tuple[ca.SX, ca.SX]:
        """Return force (N) and torque (N m) of rotors and body in moving air, body frame.

        Args:
            state: States of the rigid body.
            speed: Rotor speeds (rad/s), shape (slots,).
            factors: Result of `ground_factors`.
            inputs: Inputs of the model.
            constants: Constants of the equations.
        """
        air = kinematics.rotation_matrix(state[3:7]).T @ (state[7:10] - inputs["wind"])
        padding = ca.SX.zeros(table_rows(self.slots) - self.slots)
        moving = ca.vertcat(speed, padding, factors, padding)
        common = ca.vertcat(air, state[10:13], constants["rotor_drag"])
        rows = table_rows(self.slots)
        load = self.load_sum(common, constants["rotor_count"], ca.reshape(moving, rows, 2), constants["rotor_table"])
        return load[0:3] - ca.norm_2(air) * constants["body_drag"] * air, load[3:6]


def gyroscopic_torque(rates: ca.SX, momentum: ca.SX, momentum_rate: ca.SX) -> ca.SX:
    """Return the torque (N m, body frame) of spinning rotors on a rotating body, and of their acceleration.

    Args:
        rates: Angular velocity of the body (rad/s).
        momentum: Angular momentum of the rotors relative to the body (N m s).
        momentum_rate: Its time derivative in the body frame (N m).
    """
    return -(ca.cross(rates, momentum) + momentum_rate)
