"""Equations of motion of multirotors: a rigid body in six degrees of freedom under any number of rotors.

State: position p and velocity v (world frame), unit quaternion q (body to world), angular velocity w (body frame) and rotor
speeds n_i. With all effects:

    p' = v                                     u = R(q)^T (v - wind)                   velocity through the air, body frame
    q' = q * (0, w) / 2                        u_i = u + w x r_i                       the same at rotor i
    v' = (R F + F_ext) / m - g e_z             F = sum_i F_i - |u| diag(body_drag) u
    w' = I^-1 (T + R^T T_ext - w x (I w + H) - H')
    F_i = g_i c_T n_i^2 a_i - n_i diag(rotor_drag) u_i
    T = sum_i (r_i x F_i + s_i c_D n_i^2 a_i)  H = -J sum_i s_i n_i a_i                angular momentum of the rotors
    n_i' = (command_i - n_i) / rotor_time_constant

with the position r_i, the thrust axis a_i and the sense s_i of rotor i and the factor g_i of `ground_effect.py`. The drag of
the rotors, at each hub, and that of the body are those of Folk, Paulos and Kumar, "RotorPy", 2023; the former is the lumped
rotor drag of Faessler, Franchi and Scaramuzza, "Differential Flatness of Quadrotor Dynamics Subject to Rotor Drag", 2018,
resolved over the rotors. Without a time constant the rotors turn as commanded at once, and H' is left out.

The rotor speeds follow held commands exactly; the rest is integrated by the method of Runge and Kutta with the rotor speeds at
the times of its stages, so that no time constant is too short. Where all effects are switched off, shorter code is run.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import casadi as ca

from cosim.export.equations.c_code import Callee
from cosim.export.equations.fmu_code import as_block
from cosim.export.equations.model import ContinuousModel, runge_kutta_4
from cosim.export.fmu.block import Block

from ..common import contact_maps, kinematics
from .airframe import Airframe
from .ground_effect import thrust_factors
from .interface import states, variables

#: how many states belong to the rigid body; the rotor speeds come after them
RIGID_BODY_STATE_COUNT = 13

#: where the constants of the equations lie: parameters as in `multirotor_interface.py`, and the inverse of the inertia tensor
MASS_INDEX, INERTIA_SLICE, ROTOR_SPEED_INDEX, EFFECTS_SLICE, INVERSE_INERTIA_SLICE = (
    10,
    slice(11, 17),
    17,
    slice(18, 27),
    slice(27, 36),
)


class ExternalInputs(NamedTuple):
    """What acts on a multirotor from outside: loads and wind in the world frame, and its height above a surface."""

    force: ca.SX
    torque: ca.SX
    wind: ca.SX
    ground_distance: ca.SX


class EffectParameters(NamedTuple):
    """The parameters of the effects, as `airframe.Effects` names them."""

    rotor_time_constant: ca.SX
    rotor_inertia: ca.SX
    rotor_drag: ca.SX
    body_drag: ca.SX
    ground_effect: ca.SX


class RotorSpeeds(NamedTuple):
    """Rotor speeds (rad/s) and how fast they change (rad/s2)."""

    speed: ca.SX
    rate: ca.SX


def derive_constants(parameters: ca.SX) -> ca.SX:
    """The parameters, and what follows from them once."""
    return ca.vertcat(parameters, ca.vec(ca.inv(_symmetric_matrix(parameters[INERTIA_SLICE]))))


def rigid_body(constants: ca.SX) -> contact_maps.RigidBody:
    """Mass and inertia."""
    return contact_maps.RigidBody(
        constants[MASS_INDEX], _symmetric_matrix(constants[INERTIA_SLICE]), ca.reshape(constants[INVERSE_INERTIA_SLICE], 3, 3)
    )


def _symmetric_matrix(elements: ca.SX) -> ca.SX:
    """The tensor (3, 3) with the elements xx, yy, zz, xy, xz, yz."""
    xx, yy, zz, xy, xz, yz = ca.vertsplit(elements)
    return ca.vertcat(ca.horzcat(xx, xy, xz), ca.horzcat(xy, yy, yz), ca.horzcat(xz, yz, zz))


def rigid_body_rate(
    body: contact_maps.RigidBody, gravity: float, state: ca.SX, acting: ExternalInputs, force: ca.SX, torque: ca.SX
) -> ca.SX:
    """Time derivative of (position, orientation, world velocity, body rates) under loads in the body frame (N, N m)."""
    orientation, velocity, rates = state[3:7], state[7:10], state[10:13]
    to_world = kinematics.rotation_matrix(orientation)
    acceleration = (to_world @ force + acting.force) / body.mass - ca.vertcat(0, 0, gravity)
    moment = torque + to_world.T @ acting.torque - ca.cross(rates, body.inertia @ rates)
    return ca.vertcat(velocity, kinematics.quaternion_rate(orientation, rates), acceleration, body.inverse_inertia @ moment)


def rotor_loads(airframe: Airframe, speed: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Force (N) and torque about the centre of mass (N m) of the rotors in still air, body frame."""
    force, torque = ca.SX.zeros(3), ca.SX.zeros(3)
    for i, rotor in enumerate(airframe.rotors):
        thrust = airframe.thrust_coefficient * speed[i] ** 2 * ca.SX(rotor.axis)
        reaction = rotor.torque_sign * airframe.torque_coefficient * speed[i] ** 2 * ca.SX(rotor.axis)
        force += thrust
        torque += ca.cross(ca.SX(rotor.position), thrust) + reaction
    return force, torque


def aerodynamic_loads(
    airframe: Airframe, state: ca.SX, speed: ca.SX, acting: ExternalInputs, effects: EffectParameters
) -> tuple[ca.SX, ca.SX]:
    """Force (N) and torque (N m) that ground effect, rotor drag and body drag add to `rotor_loads`, body frame."""
    air = kinematics.rotation_matrix(state[3:7]).T @ (state[7:10] - acting.wind)
    force, torque = -ca.norm_2(air) * effects.body_drag * air, ca.SX.zeros(3)
    factors = thrust_factors(airframe, acting.ground_distance)
    for i, rotor in enumerate(airframe.rotors):
        position = ca.SX(rotor.position)
        gain = effects.ground_effect * (factors[i] - 1) * airframe.thrust_coefficient * speed[i] ** 2
        load = gain * ca.SX(rotor.axis) - speed[i] * effects.rotor_drag * (air + ca.cross(state[10:13], position))
        force += load
        torque += ca.cross(position, load)
    return force, torque


def gyroscopic_torque(airframe: Airframe, rates: ca.SX, rotors: RotorSpeeds, inertia: ca.SX) -> ca.SX:
    """Torque (N m) on the body, body frame, of spinning rotors when it turns and when their speeds change."""
    axes = ca.horzcat(*(-rotor.torque_sign * ca.SX(rotor.axis) for rotor in airframe.rotors))
    return -inertia * (ca.cross(rates, axes @ rotors.speed) + axes @ rotors.rate)


@dataclass(frozen=True)
class MultirotorEquations:
    """The equations of an airframe, for vectors in the order of `multirotor_interface.py`; `parameters` are its `constants`."""

    airframe: Airframe

    def external_inputs(self, inputs: ca.SX) -> ExternalInputs:
        """What the inputs after the rotor speeds say."""
        return ExternalInputs(*ca.vertsplit(inputs[len(self.airframe.rotors) :], [0, 3, 6, 9, 10]))

    def commanded_speeds(self, inputs: ca.SX) -> ca.SX:
        """The rotor speeds (rad/s), limited to what the motors reach."""
        return ca.fmin(ca.fmax(inputs[: len(self.airframe.rotors)], 0), self.airframe.max_rotor_speed)

    def effect_parameters(self, parameters: ca.SX) -> EffectParameters:
        """The parameters of the effects."""
        return EffectParameters(*ca.vertsplit(parameters[EFFECTS_SLICE], [0, 1, 2, 5, 8, 9]))

    def initial_state(self, parameters: ca.SX) -> ca.SX:
        """The state from initial position, yaw, body velocity, rates and rotor speed."""
        orientation = kinematics.quaternion_about_z(parameters[3])
        velocity = kinematics.rotation_matrix(orientation) @ parameters[4:7]
        rotors = ca.repmat(parameters[ROTOR_SPEED_INDEX], len(self.airframe.rotors))
        return ca.vertcat(parameters[0:3], orientation, velocity, parameters[7:10], rotors)

    def body_rate(self, state: ca.SX, rotors: RotorSpeeds, inputs: ca.SX, parameters: ca.SX) -> ca.SX:
        """Time derivative of the rigid body's states with all effects."""
        acting, effects = self.external_inputs(inputs), self.effect_parameters(parameters)
        force, torque = rotor_loads(self.airframe, rotors.speed)
        more_force, more_torque = aerodynamic_loads(self.airframe, state, rotors.speed, acting, effects)
        more_torque += gyroscopic_torque(self.airframe, state[10:13], rotors, effects.rotor_inertia)
        return rigid_body_rate(
            rigid_body(parameters), self.airframe.gravity, state, acting, force + more_force, torque + more_torque
        )

    def rotor_speeds(self, speed: ca.SX, inputs: ca.SX, parameters: ca.SX) -> RotorSpeeds:
        """Rotors at these speeds on the way to the commanded ones."""
        lag = self.effect_parameters(parameters).rotor_time_constant
        return RotorSpeeds(speed, ca.if_else(lag > 0, (self.commanded_speeds(inputs) - speed) / lag, 0))

    def rate(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX) -> ca.SX:
        """Time derivative of the state where the rotors lag."""
        rotors = self.rotor_speeds(state[RIGID_BODY_STATE_COUNT:], inputs, parameters)
        return ca.vertcat(self.body_rate(state[:RIGID_BODY_STATE_COUNT], rotors, inputs, parameters), rotors.rate)

    def step_without_effects(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX) -> ca.SX:
        """The state after a step without any effect."""
        acting, speed, body = self.external_inputs(inputs), self.commanded_speeds(inputs), rigid_body(parameters)
        force, torque = rotor_loads(self.airframe, speed)
        end = runge_kutta_4(
            lambda x: rigid_body_rate(body, self.airframe.gravity, x, acting, force, torque), state[:RIGID_BODY_STATE_COUNT], step
        )
        return ca.vertcat(normalised_state(end), speed)

    def step_with_effects(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX) -> ca.SX:
        """The state after a step with all effects."""
        target, lag = self.commanded_speeds(inputs), self.effect_parameters(parameters).rotor_time_constant
        start = ca.if_else(lag > 0, state[RIGID_BODY_STATE_COUNT:], target)
        share = ca.exp(-step / 2 / lag)  # of the way to go that is left after half a step; zero without a lag
        middle, end = (target + left * (start - target) for left in (share, share**2))
        stages = (self.rotor_speeds(speed, inputs, parameters) for speed in (start, middle, middle, end))
        moved = runge_kutta_4(lambda x: self.body_rate(x, next(stages), inputs, parameters), state[:RIGID_BODY_STATE_COUNT], step)
        return ca.vertcat(normalised_state(moved), end)


def normalised_state(state: ca.SX) -> ca.SX:
    """The states of the rigid body with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised_quaternion(state[3:7]), state[7:RIGID_BODY_STATE_COUNT])


def motion_of_state(state: ca.SX) -> ca.SX:
    """The published motion."""
    return kinematics.motion_outputs(state[0:3], state[3:7], state[7:10], state[10:RIGID_BODY_STATE_COUNT])


@dataclass(frozen=True)
class Multirotor(ContinuousModel):
    """A multirotor in free flight, whose step is one of the compiled function `free_step`."""

    free_step: ca.Function = field(kw_only=True)

    def integrate(self, state: ca.SX, inputs: ca.SX, parameters: ca.SX, step: ca.SX, sub_steps: int = 1) -> ca.SX:
        """The state after `step` (s) with held inputs, in equal sub-steps."""
        for _ in range(sub_steps):
            state = self.free_step(state, inputs, parameters, step / sub_steps)
        return state


def free_step(airframe: Airframe) -> Callee:
    """The state after a step; the shorter code is run where no effect is switched on."""
    equations, count = MultirotorEquations(airframe), len(airframe.rotors)
    sizes = {"state": RIGID_BODY_STATE_COUNT + count, "inputs": count + 10, "parameters": INVERSE_INERTIA_SLICE.stop, "step": 1}
    state, inputs, parameters, step = arguments = [ca.SX.sym(name, size) for name, size in sizes.items()]
    plain = ca.Function("plain_step", arguments, [equations.step_without_effects(*arguments)])
    full = ca.Function("step_with_effects", arguments, [equations.step_with_effects(state, inputs, parameters, step)])
    either = ca.Function("free_step", arguments, [full(*arguments)], {"never_inline": True})
    return Callee(either, _FREE_STEP_C % {"first": EFFECTS_SLICE.start, "end": EFFECTS_SLICE.stop}, [plain, full])


_FREE_STEP_C = """{
    for (int i = %(first)d; i < %(end)d; ++i)
        if (in[2][i] != 0) {
            step_with_effects(in, out);
            return;
        }
    plain_step(in, out);
}
"""


def multirotor_block(airframe: Airframe, description: str) -> Block:
    """A multirotor in free flight as FMU, and in the world."""
    equations, step = MultirotorEquations(airframe), free_step(airframe)
    model = Multirotor(
        airframe.name,
        description,
        variables(airframe),
        states(airframe),
        equations.initial_state,
        equations.rate,
        lambda state, inputs, parameters: ca.vertcat(motion_of_state(state), ca.SX.zeros(3)),
        derived_parameters=derive_constants,
        callees=[step],
        free_step=step.function,
    )
    return as_block(model, contact_maps.FreeContactMaps(model, rigid_body, motion_of_state).functions())
