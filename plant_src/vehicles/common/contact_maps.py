"""Compiled half of the contact scheme (`plant_src/physics/body.py`): the functions that the world calls at each step.

Each vehicle exports three functions beside its FMU:

    shadow_spawn   parameters -> constants (`ContinuousModel.constants`, or the parameters), state at the start, as if a free
                   step had led to it, and pose in Bullet's terms
    shadow_before  state, inputs, surroundings (the last inputs of the model), constants, step, the box in which the vehicle
                   comes near nothing
                   -> state after a free step, the constant motion that leads there and what Bullet needs to make it,
                      path of the centre of mass, alarm
    shadow_after   these, and the motion that Bullet made of it
                   -> state, contact impulse (zero for a free step), published variables

Each kind of body adds what it alone needs: a free one the `axes` of its body in Bullet, a planar one by what it was `pressed`,
a floating one the impulse that is `carried` over. Floating vessels export `shadow_surface` too, the height of the water
(`waves.py`).

Bullet's solver changes the motion when something is in the way. That change times Bullet's inertia is the contact impulse;
divided by the vehicle's inertia it is added to the velocity that the equations predicted. The published velocity is that
of Bullet while there is contact: the own velocity is a label for the end of the step and not zero at rest. Bullet moves a
body by the motion at the end of its step, so the pose after contact is known from that as well.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from cosim.export.equations.model import ContinuousModel

from . import kinematics
from .alarms import INVALID_STATE, LEAVES_SAFE_BOX, MAX_STATE_NORM
from .interface import ENVIRONMENT_INPUTS

#: at most 5 ms long, since the world makes steps of at most 10 ms
SUB_STEPS = 2

#: how many numbers a force and a torque are
TWIST_SIZE = 6

#: below this contact impulse (N s) a step was free; rounding leaves less than 1e-14
IMPULSE_TOLERANCE = 1e-12


class RigidBody(NamedTuple):
    """Mass (kg), inertia about the centre of mass (3, 3; kg m2, body frame) and its inverse."""

    mass: ca.SX
    inertia: ca.SX
    inverse_inertia: ca.SX

    def inertia_in_world(self, orientation: ca.SX) -> ca.SX:
        """The inertia in the axes of the world."""
        to_world = kinematics.rotation_matrix(orientation)
        return to_world @ self.inertia @ to_world.T


@dataclass(frozen=True)
class FreeContactMaps:
    """A free rigid body with the state (position, orientation, world velocity, body rates), and more that contact leaves alone.

    `rigid` gives its mass and inertia of the constants, `observe` the published variables of a state. A pose in Bullet's terms is
    (position, quaternion x y z w), a motion (velocity, angular velocity), all in the world frame; `axes` is the orientation of
    Bullet's body in the vehicle's frame (x, y, z, w).
    """

    model: ContinuousModel
    rigid: Callable[[ca.SX], RigidBody]
    observe: Callable[[ca.SX], ca.SX]

    def functions(self) -> list[ca.Function]:
        """The functions to export."""
        return [self._initialize_function(), self._predict_function(), self._correct_function()]

    def _initialize_function(self) -> ca.Function:
        parameters, constants = parameters_and_constants(self.model)
        (axes,) = create_symbols(axes=4)
        state = self.model.initial_state(constants)
        motion = ca.vertcat(state[7:10], kinematics.rotation_matrix(state[3:7]) @ state[10:13])
        return ca.Function("shadow_spawn", [parameters, axes], [constants, state, motion, motion, _bullet_pose(state, axes)])

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, end, step = arguments[0], predicted_state(self.model, *arguments[:5]), arguments[4]
        (axes,) = create_symbols(axes=4)
        linear = (end[0:3] - state[0:3]) / step
        angular = kinematics.rotation_vector(kinematics.quaternion_product(end[3:7], kinematics.conjugate(state[3:7]))) / step
        # Bullet adds the gyroscopic torque of its body by itself: this one cancels it
        torque = ca.cross(angular, self.rigid(arguments[3]).inertia_in_world(state[3:7]) @ angular)
        twist, path = ca.vertcat(linear, angular), ca.vertcat(state[0:3], end[0:3])
        results = [state, end, twist, twist, torque, _bullet_pose(state, axes), path, alarm_code(end, path, arguments)]
        return ca.Function("shadow_before", [*arguments, axes], results)

    def _correct_function(self) -> ca.Function:
        start, predicted, twist, motion, constants, step = arguments = correct_symbols(self.model)
        linear, angular = ca.vertsplit(motion - twist, 3)
        rigid, to_body = self.rigid(constants), kinematics.rotation_matrix(predicted[3:7]).T
        turned = rigid.inverse_inertia @ (to_body @ (rigid.inertia_in_world(start[3:7]) @ angular))
        velocity, others = predicted[7:13] + ca.vertcat(linear, turned), predicted[13:]
        impulse = contact_impulse(rigid.mass * ca.norm_2(linear))
        orientation = kinematics.quaternion_product(kinematics.quaternion_from_rotation_vector(motion[3:6] * step), start[3:7])
        pose = ca.vertcat(start[0:3] + motion[0:3] * step, kinematics.normalised_quaternion(orientation))
        seen = ca.vertcat(pose, motion[0:3], kinematics.rotation_matrix(orientation).T @ motion[3:6], others)
        return _correct_function(arguments, impulse, predicted, ca.vertcat(pose, velocity, others), self.observe, seen)


@dataclass(frozen=True)
class PlanarContactMaps:
    """A vessel in the horizontal plane with the state (x, y, yaw, surge, sway, yaw rate).

    `mass` (kg) and `moment` (kg m2, about z) are those of the hull, whose centre of mass lies on the yaw axis at `height` (m).
    Pose and motion in Bullet's terms are those of a free body. Bullet's body cannot roll and pitch, but it can heave. What
    presses it down, `pressed` (vertical impulses of the last two steps, N s), is foreseen: Bullet is told to lift it by as much,
    and when it finds the same again the body has kept its height. Of two unequal impulses the weaker one is foreseen, so that a
    blow does not make it jump. The last number of `pressed` is how far it has moved up all the same (m).
    """

    model: ContinuousModel
    mass: float
    yaw_inertia: float
    height: float
    observe: Callable[[ca.SX], ca.SX]

    def functions(self) -> list[ca.Function]:
        """The functions to export."""
        return [self._initialize_function(), self._predict_function(), self._correct_function()]

    def _initialize_function(self) -> ca.Function:
        parameters, constants = parameters_and_constants(self.model)
        state = self.model.initial_state(constants)
        motion = _planar_twist(_planar_rotation(state[2]) @ state[3:5], ca.SX(0), state[5])
        return ca.Function("shadow_spawn", [parameters], [constants, state, motion, motion, self._pose(state)])

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, end, step = arguments[0], predicted_state(self.model, *arguments[:5]), arguments[4]
        (pressed,) = create_symbols(pressed=3)
        rates = (end[0:3] - state[0:3]) / step
        twist = _planar_twist(rates[0:2], _minmod(pressed[0], pressed[1]) / self.mass, rates[2])
        path = ca.vertcat(self.observe(state)[0:3], self.observe(end)[0:3])
        previous = ca.vertcat(pressed[0], pressed[2])
        results = [state, end, twist, twist, self._pose(state), previous, path, alarm_code(end, path, arguments)]
        return ca.Function("shadow_before", [*arguments, pressed], results)

    def _correct_function(self) -> ca.Function:
        start, predicted, twist, motion, _, step = arguments = correct_symbols(self.model)
        (previous,) = create_symbols(previous=2)
        change = motion - twist
        velocity = predicted[3:6] + ca.vertcat(_planar_rotation(predicted[2]).T @ change[0:2], change[5])
        impulse = contact_impulse(ca.norm_2(ca.vertcat(self.mass * change[0:3], self.yaw_inertia * change[5])))
        pose = start[0:3] + step * ca.vertcat(motion[0:2], motion[5])
        seen = ca.vertcat(pose, _planar_rotation(pose[2]).T @ motion[0:2], motion[5])
        pressed = ca.vertcat(-self.mass * change[2], previous[0], previous[1] + motion[2] * step)
        return _correct_function(
            [*arguments, previous], impulse, predicted, ca.vertcat(pose, velocity), self.observe, seen, pressed
        )

    def _pose(self, state: ca.SX) -> ca.SX:
        q = kinematics.quaternion_about_z(state[2])
        return ca.vertcat(state[0:2], self.height, q[1:4], q[0])


def parameters_and_constants(model: ContinuousModel) -> tuple[ca.SX, ca.SX]:
    """Symbols of the parameters, and the constants that follow from them."""
    (parameters,) = create_symbols(parameters=len(model.elements("parameter")))
    return parameters, model.derived_parameters(parameters) if model.derived_parameters else parameters


def predict_symbols(model: ContinuousModel) -> list[ca.SX]:
    """State, inputs, surroundings, constants, step, and middle and half edges (world frame, m) of the box in which the vehicle
    comes near nothing."""
    surroundings = sum(variable.name in ENVIRONMENT_INPUTS for variable in model.elements("input"))
    inputs = len(model.elements("input")) - surroundings
    state, given, around = create_symbols(state=len(model.states), inputs=inputs, surroundings=surroundings)
    return [state, given, around, model.derived_parameter_symbols(), *create_symbols(step=1, anchor=3, leash=3)]


def correct_symbols(model: ContinuousModel) -> list[ca.SX]:
    """State at the start and foreseen at the end of a step, foreseen and real mean motion, constants and step."""
    count = len(model.states)
    states = create_symbols(start=count, predicted=count, twist=TWIST_SIZE, motion=TWIST_SIZE)
    return [*states, model.derived_parameter_symbols(), *create_symbols(step=1)]


def predicted_state(
    model: ContinuousModel, state: ca.SX, inputs: ca.SX, surroundings: ca.SX, constants: ca.SX, step: ca.SX
) -> ca.SX:
    """The state after a free step."""
    return model.integrate(state, ca.vertcat(inputs, surroundings), constants, step, SUB_STEPS)


def _correct_function(
    arguments: list[ca.SX],
    impulse: ca.SX,
    free: ca.SX,
    touched: ca.SX,
    observe: Callable[[ca.SX], ca.SX],
    seen: ca.SX,
    *more: ca.SX,
) -> ca.Function:
    """The state after a free step or one with contact, where `seen` is published instead of it."""
    state, published = (ca.if_else(impulse > 0, other, free) for other in (touched, seen))
    return ca.Function("shadow_after", arguments, [state, impulse, observe(published), *more])


def create_symbols(**sizes: int) -> list[ca.SX]:
    return [ca.SX.sym(name, size) for name, size in sizes.items()]


def alarm_code(end: ca.SX, path: ca.SX, arguments: list[ca.SX]) -> ca.SX:
    """Zero when all is well, ADRIFT when the path leaves the box, UNSOUND when inputs or the state at the end are unusable.

    `arguments` are those of `shadow_before`.
    """
    _, inputs, surroundings, _, _, anchor, leash = arguments
    given = ca.fabs(ca.vertcat(inputs, surroundings))
    sound = ca.logic_and(ca.sum1(given) < ca.inf, ca.norm_2(end) < MAX_STATE_NORM)
    excess = ca.fabs(path - ca.vertcat(anchor, anchor)) - ca.vertcat(leash, leash)
    return ca.if_else(sound, ca.if_else(ca.mmax(excess) > 0, LEAVES_SAFE_BOX, 0), INVALID_STATE)


def contact_impulse(impulse: ca.SX) -> ca.SX:
    """The impulse (N s), zero where there is only rounding; not a number stays so."""
    return ca.if_else(impulse <= IMPULSE_TOLERANCE, 0, impulse)


def _bullet_pose(state: ca.SX, axes: ca.SX) -> ca.SX:
    """The pose of a free body in Bullet's terms."""
    turned = kinematics.quaternion_product(state[3:7], ca.vertcat(axes[3], axes[0:3]))
    return ca.vertcat(state[0:3], turned[1:4], turned[0])


def _planar_twist(horizontal: ca.SX, vertical: ca.SX, yaw_rate: ca.SX) -> ca.SX:
    """The motion of a body that neither rolls nor pitches: velocity and angular velocity."""
    return ca.vertcat(horizontal, vertical, 0, 0, yaw_rate)


def _minmod(a: ca.SX, b: ca.SX) -> ca.SX:
    """The number that is nearer to zero; zero if they have different signs."""
    return ca.if_else(a * b > 0, ca.if_else(ca.fabs(a) < ca.fabs(b), a, b), 0)


def _planar_rotation(yaw: ca.SX) -> ca.SX:
    """Rotation matrix (2, 2) of the plane."""
    return ca.vertcat(ca.horzcat(ca.cos(yaw), -ca.sin(yaw)), ca.horzcat(ca.sin(yaw), ca.cos(yaw)))
