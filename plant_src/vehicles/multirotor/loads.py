"""Forces and torques of rotors and air on a multirotor, as CasADi expressions; `multirotor_equations.py` has the formulas."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca

from ..common import kinematics
from ..common.named_values import NamedValues
from .airframe import Airframe
from .ground_effect import thrust_factors


class RotorSpeeds(NamedTuple):
    """Speeds (rad/s) and accelerations (rad/s2) of all rotors."""

    speed: ca.SX
    rate: ca.SX


def rotor_loads(airframe: Airframe, speed: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return force (N) and torque about the centre of mass (N m) of the rotors in still air, body frame."""
    force, torque = ca.SX.zeros(3), ca.SX.zeros(3)
    for i, rotor in enumerate(airframe.rotors):
        thrust = airframe.thrust_coefficient * speed[i] ** 2 * ca.SX(rotor.axis)
        reaction = rotor.torque_sign * airframe.torque_coefficient * speed[i] ** 2 * ca.SX(rotor.axis)
        force += thrust
        torque += ca.cross(ca.SX(rotor.position), thrust) + reaction
    return force, torque


def aerodynamic_loads(
    airframe: Airframe, state: ca.SX, speed: ca.SX, inputs: NamedValues, constants: NamedValues
) -> tuple[ca.SX, ca.SX]:
    """Return the force (N) and torque (N m) of ground effect, rotor drag and body drag, body frame."""
    air = kinematics.rotation_matrix(state[3:7]).T @ (state[7:10] - inputs["wind"])
    force, torque = -ca.norm_2(air) * constants["body_drag"] * air, ca.SX.zeros(3)
    factors = thrust_factors(airframe, inputs["ground_distance"])
    for i, rotor in enumerate(airframe.rotors):
        position = ca.SX(rotor.position)
        gain = constants["ground_effect"] * (factors[i] - 1) * airframe.thrust_coefficient * speed[i] ** 2
        load = gain * ca.SX(rotor.axis) - speed[i] * constants["rotor_drag"] * (air + ca.cross(state[10:13], position))
        force += load
        torque += ca.cross(position, load)
    return force, torque


def gyroscopic_torque(airframe: Airframe, rates: ca.SX, rotors: RotorSpeeds, rotor_inertia: ca.SX) -> ca.SX:
    """Return the torque (N m, body frame) of spinning rotors on a rotating body, and of their acceleration."""
    axes = ca.horzcat(*(-rotor.torque_sign * ca.SX(rotor.axis) for rotor in airframe.rotors))
    return -rotor_inertia * (ca.cross(rates, axes @ rotors.speed) + axes @ rotors.rate)
