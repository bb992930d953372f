"""The compiled half of the shadow scheme (`shadow_maps.py`) for vessels in six degrees of freedom.

Water makes a vessel answer a load otherwise than a free rigid body: added mass in the inertia, springs and dampers in the
rates. So the contact impulse of the last step is carried over: it acts as a held force while the equations look ahead, and
Bullet is told a motion without it. What Bullet then finds is the whole impulse again, of which the difference to the one
carried over is added to the velocity. In steady contact both are equal, and the motion is that of the equations with the
contact force inside. Forces are held along the axes of the world, so that momentum is conserved.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.contact_maps import (
    TWIST_SIZE,
    alarm_code,
    contact_impulse,
    correct_symbols,
    create_symbols,
    parameters_and_constants,
    predict_symbols,
    predicted_state,
)
from ..common.shapes import Body
from .hull import Frame, Hull
from .vessel_equations import VesselModel
from .wave_loads import create_surface_function


class _Impulse(NamedTuple):
    """Linear (N s) and angular (N m s, about the centre of mass) impulse, world frame."""

    linear: ca.SX
    angular: ca.SX


@dataclass(frozen=True)
class FloatingContactMaps:
    """A vessel with the state of `vessel_model.Vessel`.

    Bullet's body has its centre of mass in the origin O of the vessel's frame and mass and inertia of `body`, whatever the
    payload: an impulse is an impulse, and with the one carried over the ratio of masses does not matter. They should not
    exceed those of the vessel. A pose in Bullet's terms is (position of O, quaternion x y z w), a motion (velocity of O,
    angular velocity), all in the world frame; `carried` is the impulse on O of the last step.
    """

    model: ContinuousModel
    vessel: VesselModel
    body: Body

    def functions(self) -> list[ca.Function]:
        """The functions to export."""
        return [self._initialize_function(), self._predict_function(), self._correct_function(), create_surface_function()]

    def _initialize_function(self) -> ca.Function:
        parameters, constants = parameters_and_constants(self.model)
        state = self.model.initial_state(constants)
        frame = self.vessel.hull_with(constants).frame(state[3:7])
        motion = ca.vertcat(frame.to_world @ state[7:10], frame.attitude @ (frame.rates_to_angular_velocity @ state[10:13]))
        return ca.Function("shadow_spawn", [parameters], [constants, state, motion, motion, _bullet_pose(state)])

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, inputs, surroundings, constants, step = arguments[:5]
        (carried,) = create_symbols(carried=6)
        hull, attitude = self.vessel.hull_with(constants), kinematics.rotation_matrix(state[3:7])
        pressed = self._inputs_with_contact_force(inputs, _impulse_about_centre(hull, attitude, carried), step)
        end = predicted_state(self.model, state, pressed, surroundings, constants, step)
        linear = (end[0:3] - state[0:3]) / step
        angular = kinematics.rotation_vector(kinematics.quaternion_product(end[3:7], kinematics.conjugate(state[3:7]))) / step
        inertia = self._inertia_in_world(attitude)
        twist = ca.vertcat(linear, angular) - ca.vertcat(
            carried[0:3] / self.body.mass, self._angular_velocity_change(attitude, carried[3:6])
        )
        torque = ca.cross(twist[3:6], inertia @ twist[3:6])
        path = ca.vertcat(state[0:3], end[0:3])
        results = [state, end, twist, twist, torque, _bullet_pose(state), carried, path, alarm_code(end, path, arguments)]
        return ca.Function("shadow_before", [*arguments, carried], results)

    def _correct_function(self) -> ca.Function:
        arguments = correct_symbols(self.model)
        start, predicted, twist, motion, constants, step = arguments
        (previous,) = create_symbols(previous=6)
        hull, attitude = self.vessel.hull_with(constants), kinematics.rotation_matrix(start[3:7])
        change = motion - twist
        linear, angular = self.body.mass * change[0:3], self._inertia_in_world(attitude) @ change[3:6]
        strength = contact_impulse(ca.norm_2(linear))
        found = ca.if_else(strength > 0, ca.vertcat(linear, angular), ca.SX.zeros(6)) + 0 * strength
        touched = ca.logic_or(strength > 0, ca.norm_2(previous) > 0)
        surplus = _impulse_about_centre(hull, attitude, found - previous)
        pose = _integrate_pose(start, motion, step)
        before, frame = hull.frame(predicted[3:7]), hull.frame(pose[3:7])
        nu = predicted[7:13] + hull.inverse_mass_matrix @ _impulse_load(hull, before, surplus)
        velocity = frame.to_world.T @ (before.to_world @ nu[0:3])  # that in the world stays, though Bullet has turned the body
        corrected = ca.vertcat(pose, velocity, nu[3:6], predicted[13:])
        label = ca.vertcat(
            frame.to_world.T @ motion[0:3], ca.inv(frame.rates_to_angular_velocity) @ (frame.attitude.T @ motion[3:6])
        )
        state = ca.if_else(touched, corrected, predicted)
        seen = ca.vertcat(state[0:7], ca.if_else(strength > 0, label, state[7:13]), state[13:])
        return ca.Function("shadow_after", [*arguments, previous], [state, strength, hull.observe(seen), found])

    def _inputs_with_contact_force(self, inputs: ca.SX, impulse: _Impulse, step: ca.SX) -> ca.SX:
        """The inputs with a held contact force among the external loads."""
        names = [slot.name for slot in self.model.elements("input")]
        first = names.index("external_force.x")
        load = ca.vertcat(impulse.linear, impulse.angular) / step
        return ca.vertcat(inputs[:first], inputs[first : first + TWIST_SIZE] + load, inputs[first + TWIST_SIZE :])

    def _inertia_in_world(self, attitude: ca.SX) -> ca.SX:
        return attitude @ ca.diag(ca.SX(self.body.inertia)) @ attitude.T

    def _angular_velocity_change(self, attitude: ca.SX, impulse: ca.SX) -> ca.SX:
        """The change of angular velocity of Bullet's body."""
        return attitude @ ((attitude.T @ impulse) / ca.SX(self.body.inertia))


def _impulse_about_centre(hull: Hull, attitude: ca.SX, impulse: ca.SX) -> _Impulse:
    return _Impulse(impulse[0:3], impulse[3:6] - ca.cross(attitude @ hull.centre_of_mass, impulse[0:3]))


def _impulse_load(hull: Hull, frame: Frame, impulse: _Impulse) -> ca.SX:
    """The impulse as a load in the equations of motion."""
    lever = frame.attitude @ hull.centre_of_mass
    return frame.generalised_force(impulse.linear, impulse.angular + ca.cross(lever, impulse.linear))


def _integrate_pose(start: ca.SX, motion: ca.SX, step: ca.SX) -> ca.SX:
    """Position and orientation to which Bullet has moved the body."""
    orientation = kinematics.quaternion_product(kinematics.quaternion_from_rotation_vector(motion[3:6] * step), start[3:7])
    return ca.vertcat(start[0:3] + motion[0:3] * step, kinematics.normalised_quaternion(orientation))


def _bullet_pose(state: ca.SX) -> ca.SX:
    return ca.vertcat(state[0:3], state[4:7], state[3])
