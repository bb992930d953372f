"""Equations of motion of the quadcopter: a rigid body in six degrees of freedom under four rotors.

Equations 3 to 5 of the paper, with the full inertia tensor; README.md has them in our notation.
"""

from __future__ import annotations

import casadi as ca

from cosim.export.block import Block
from cosim.export.equations import ContinuousModel
from cosim.export.equations import block as as_block

from .. import kinematics, shadow_maps
from . import parameters as p
from .interface import STATES, VARIABLES


def rate(state: ca.SX, inputs: ca.SX) -> ca.SX:
    """Time derivative of (position, orientation, world velocity, body rates)."""
    orientation, velocity, rates = state[3:7], state[7:10], state[10:13]
    rotor_speed, external_force, external_torque = inputs[0:4], inputs[4:7], inputs[7:10]
    force, torque = rotor_loads(rotor_speed)
    to_world = kinematics.matrix(orientation)
    inertia = ca.SX(p.INERTIA)
    acceleration = (to_world @ force + external_force) / p.MASS - ca.vertcat(0, 0, p.GRAVITY)
    moment = torque + to_world.T @ external_torque - ca.cross(rates, inertia @ rates)
    return ca.vertcat(velocity, kinematics.rate(orientation, rates), acceleration, ca.inv(inertia) @ moment)


def rotor_loads(rotor_speed: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Force (N) and torque about the centre of mass (N m) of the rotors, body frame."""
    speed = ca.fmin(ca.fmax(rotor_speed, 0), p.MAX_ROTOR_SPEED)
    force, torque = ca.SX.zeros(3), ca.SX.zeros(3)
    for i in range(4):
        thrust = ca.vertcat(0, 0, p.THRUST_COEFFICIENT * speed[i] ** 2)
        reaction = ca.vertcat(0, 0, p.ROTOR_SENSES[i] * p.TORQUE_COEFFICIENT * speed[i] ** 2)
        force += thrust
        torque += ca.cross(ca.SX(p.ROTORS[i]), thrust) + reaction
    return force, torque


def normalise(state: ca.SX) -> ca.SX:
    """The state with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised(state[3:7]), state[7:13])


def initial_state(parameters: ca.SX) -> ca.SX:
    """The state from initial position, yaw, body velocity and rates."""
    orientation = kinematics.about_z(parameters[3])
    velocity = kinematics.matrix(orientation) @ parameters[4:7]
    return ca.vertcat(parameters[0:3], orientation, velocity, parameters[7:10])


def observe(state: ca.SX) -> ca.SX:
    """The published motion."""
    return kinematics.motion(state[0:3], state[3:7], state[7:10], state[10:13])


def block() -> Block:
    """The quadcopter in free flight."""
    model = ContinuousModel(
        "ar_drone",
        "AR.Drone 2.0 quadcopter in free flight",
        VARIABLES,
        STATES,
        initial_state,
        lambda state, inputs, parameters: rate(state, inputs),
        lambda state, inputs, parameters: ca.vertcat(observe(state), ca.SX.zeros(3)),
        normalise,
    )
    shadow = shadow_maps.FreeBody(model, p.MASS, p.INERTIA, p.principal_axes()[1], observe)
    return as_block(model, shadow.functions())
