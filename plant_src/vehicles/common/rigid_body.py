"""Motion of a free rigid body as CasADi expressions.

The state begins with position (m) and velocity (m/s) of the centre of mass in the world frame, a
unit quaternion (body to world) and the angular velocity (rad/s, body frame), in the order of
`interface.FREE_STATES`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca
from casadi import SX

from cosim.export.equations.model import ContinuousModel

from . import kinematics
from .interface import FREE_STATES, WORLD_OUTPUTS
from .named_values import NamedValues

#: number of rigid-body states; those of the actuators follow them in the state vector
RIGID_BODY_STATE_COUNT = len(FREE_STATES)


class RigidBody(NamedTuple):
    """Mass (kg), inertia about the centre of mass (kg m2, body frame, (3, 3)) and its inverse."""

    mass: SX
    inertia: SX
    inverse_inertia: SX

    def inertia_in_world(self, orientation: SX) -> SX:
        """Return the inertia (kg m2) in world axes."""
        to_world = kinematics.rotation_matrix(orientation)
        return to_world @ self.inertia @ to_world.T


def rigid_body(constants: NamedValues) -> RigidBody:
    """Return mass and inertia."""
    return RigidBody(
        constants["mass"], symmetric_matrix(constants["inertia"]), constants["inverse_inertia"]
    )


def initial_rigid_state(initial: NamedValues) -> SX:
    """Return the states of the rigid body at the start from the parameters `initial.*`."""
    orientation = kinematics.quaternion_about_z(initial["initial.yaw"])
    velocity = kinematics.rotation_matrix(orientation) @ initial["initial.velocity_body"]
    return ca.vertcat(initial["initial.position"], orientation, velocity, initial["initial.rates"])


def symmetric_matrix(elements: SX) -> SX:
    """Return the symmetric matrix (3, 3) with the elements xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = ca.vertsplit(elements)
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def rigid_body_rate(
    body: RigidBody, gravity: SX, state: SX, inputs: NamedValues, force: SX, torque: SX
) -> SX:
    """Return the time derivative of the rigid-body states.

    Args:
        body: Mass and inertia.
        gravity: Gravitational acceleration (m/s2).
        state: Position, quaternion, velocity (world frame) and rates (body frame), shape (13,).
        inputs: Inputs by name; the external force and torque are used.
        force: Force without weight and external force (N, body frame).
        torque: Torque about the centre of mass without external torque (N m, body frame).
    """
    orientation, velocity, rates = state[3:7], state[7:10], state[10:13]
    to_world = kinematics.rotation_matrix(orientation)
    acceleration = (to_world @ force + inputs["external_force"]) / body.mass - ca.vertcat(
        0, 0, gravity
    )
    moment = torque + to_world.T @ inputs["external_torque"] - ca.cross(rates, body.inertia @ rates)
    return ca.vertcat(
        velocity,
        kinematics.quaternion_rate(orientation, rates),
        acceleration,
        body.inverse_inertia @ moment,
    )


def lagging_speeds(speed: SX, target: SX, lag: SX, step: SX) -> tuple[SX, SX, SX]:
    """Return speeds with a first-order lag at the start, the middle and the end of a step.

    They are the exact solution for held commands: the difference to the command decays by
    exp(-t / lag). Without a lag (0) the speeds equal their commands.

    Args:
        speed: Speeds of the state (rad/s).
        target: Commanded speeds (rad/s).
        lag: Time constant (s).
        step: Length of the step (s).
    """
    start = ca.if_else(lag > 0, speed, target)
    # fraction of the difference left after half a step; 0 without a lag
    remaining = ca.exp(-step / 2 / lag)
    middle, end = (target + fraction * (start - target) for fraction in (remaining, remaining**2))
    return start, middle, end


def normalised_state(state: SX) -> SX:
    """Return the rigid-body states with a unit quaternion."""
    return ca.vertcat(
        state[0:3], kinematics.normalised_quaternion(state[3:7]), state[7:RIGID_BODY_STATE_COUNT]
    )


def motion_of_state(state: SX) -> SX:
    """Return the published motion (`interface.MOTION_OUTPUTS`)."""
    return kinematics.motion_outputs(
        state[0:3], state[3:7], state[7:10], state[10:RIGID_BODY_STATE_COUNT]
    )


def with_world_outputs(motion: SX) -> SX:
    """Return all outputs of a plant FMU: its motion, and 0 for what only a world computes."""
    return ca.vertcat(motion, SX.zeros(len(WORLD_OUTPUTS)))


@dataclass(frozen=True)
class SteppedModel(ContinuousModel):
    """A vehicle that is integrated by a compiled function.

    Attributes:
        step: Function of state, inputs, constants and length of a step (s) to the next state.
    """

    step: Callable[[SX, SX, SX, SX], SX] = field(kw_only=True)

    def integrate(self, state: SX, inputs: SX, parameters: SX, step: SX, sub_steps: int = 1) -> SX:
        """Return the state after `step` (s) with held inputs, in equal sub-steps."""
        for _ in range(sub_steps):
            state = self.step(state, inputs, parameters, step / sub_steps)
        return state
