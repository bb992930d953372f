"""Contact functions (`common/contact_maps.py`) of vessels in six degrees of freedom.

A floating vessel responds to a load differently from a free rigid body: the water adds mass,
restoring and damping. Therefore the contact impulse of the previous step acts as a constant force
while the equations predict, and Bullet receives the predicted twist without its effect. Bullet then
finds the whole impulse again, and the difference to the previous one is added to the velocity. In
steady contact both are equal, so that the motion is that of the equations with the contact force
included. The force is constant in world axes, which conserves momentum.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.contact_maps import (
    CORRECT_ARGUMENTS,
    CORRECT_RESULTS,
    IMPULSE_RESULTS,
    INITIALIZE_RESULTS,
    PREDICT_ARGUMENTS,
    TWIST_SIZE,
    contact_impulse,
    correct_symbols,
    create_symbols,
    is_upside_down,
    parameters_and_constants,
    predict_symbols,
    predicted_state,
    step_status,
)
from ..common.shapes import Body
from ..common.water_surface import create_elevation_function
from .hull import Frame, Hull
from .vessel_equations import VesselModel


class _Impulse(NamedTuple):
    """Linear (N s) and angular (N m s, about the centre of mass) impulse, world frame."""

    linear: ca.SX
    angular: ca.SX


class BulletBody(NamedTuple):
    """Mass (kg) and moments of inertia about the body axes (kg m2, shape (3,)) of the body in Bullet."""

    mass: ca.SX
    inertia: ca.SX


def constant_body(body: Body) -> Callable[[ca.SX], BulletBody]:
    """Return the function from the constants to mass and inertia of a body that does not depend on them."""
    return lambda _constants: BulletBody(ca.SX(body.mass), ca.SX(body.inertia))


@dataclass(frozen=True)
class FloatingContactMaps:
    """Contact functions of a vessel with the states `interface.VESSEL_STATES`.

    Bullet's body has its centre of mass in the origin O of the body frame, and mass and inertia of
    `body`. The impulse that Bullet finds does not depend on them, because the previous impulse is
    taken into account; they should not exceed those of the vessel. Poses and twists in Bullet are
    those of O. The argument `contact_impulse` is the impulse on O in the last step (N s, N m s
    about O, world frame), shape (6,).

    Attributes:
        model: Equations of the vessel as they are exported.
        vessel: The same equations by name.
        body: Function from the constants to mass and inertia of the body in Bullet.
    """

    model: ContinuousModel
    vessel: VesselModel
    body: Callable[[ca.SX], BulletBody]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [
            self._initialize_function(),
            self._predict_function(),
            self._correct_function(),
            create_elevation_function(),
        ]

    def _initialize_function(self) -> ca.Function:
        parameters, constants = parameters_and_constants(self.model)
        state = self.model.initial_state(constants)
        frame = self.vessel.hull_with(constants).frame(state[3:7])
        twist = ca.vertcat(
            frame.to_world @ state[7:10],
            frame.attitude @ (frame.rates_to_angular_velocity @ state[10:13]),
        )
        return ca.Function(
            "contact_initialize",
            [parameters],
            [constants, state, twist, twist, _bullet_pose(state)],
            ["parameters"],
            INITIALIZE_RESULTS,
        )

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, inputs, environment_inputs, constants, step = arguments[:5]
        (impulse,) = create_symbols(contact_impulse=6)
        hull, attitude = self.vessel.hull_with(constants), kinematics.rotation_matrix(state[3:7])
        loaded = self._inputs_with_contact_force(
            inputs, _impulse_about_centre(hull, attitude, impulse), step
        )
        end = predicted_state(self.model, state, loaded, environment_inputs, constants, step)
        linear = (end[0:3] - state[0:3]) / step
        angular = (
            kinematics.rotation_vector(
                kinematics.quaternion_product(end[3:7], kinematics.conjugate(state[3:7]))
            )
            / step
        )
        body = self.body(constants)
        inertia = _inertia_in_world(body, attitude)
        twist = ca.vertcat(linear, angular) - ca.vertcat(
            impulse[0:3] / body.mass, _angular_velocity_change(body, attitude, impulse[3:6])
        )
        torque = ca.cross(twist[3:6], inertia @ twist[3:6])
        endpoints = ca.vertcat(state[0:3], end[0:3])
        status = step_status(end, endpoints, arguments, is_upside_down(end[3:7]))
        results = [
            state,
            end,
            twist,
            twist,
            torque,
            _bullet_pose(state),
            impulse,
            endpoints,
            status,
        ]
        return ca.Function(
            "contact_predict",
            [*arguments, impulse],
            results,
            [*PREDICT_ARGUMENTS, "contact_impulse"],
            IMPULSE_RESULTS,
        )

    def _correct_function(self) -> ca.Function:
        arguments = correct_symbols(self.model)
        start, predicted, twist, bullet_twist, constants, step = arguments
        (previous,) = create_symbols(previous_contact_impulse=6)
        hull, attitude = self.vessel.hull_with(constants), kinematics.rotation_matrix(start[3:7])
        change, body = bullet_twist - twist, self.body(constants)
        linear, angular = body.mass * change[0:3], _inertia_in_world(body, attitude) @ change[3:6]
        magnitude = contact_impulse(ca.norm_2(linear))
        impulse = (
            ca.if_else(magnitude > 0, ca.vertcat(linear, angular), ca.SX.zeros(6)) + 0 * magnitude
        )
        in_contact = ca.logic_or(magnitude > 0, ca.norm_2(previous) > 0)
        surplus = _impulse_about_centre(hull, attitude, impulse - previous)
        pose = _integrate_pose(start, bullet_twist, step)
        before, frame = hull.frame(predicted[3:7]), hull.frame(pose[3:7])
        nu = predicted[7:13] + hull.inverse_mass_matrix @ _impulse_load(hull, before, surplus)
        # the velocity in the world frame is kept, although Bullet has turned the body
        velocity = frame.to_world.T @ (before.to_world @ nu[0:3])
        corrected = ca.vertcat(pose, velocity, nu[3:6], predicted[13:])
        mean_nu = ca.vertcat(
            frame.to_world.T @ bullet_twist[0:3],
            ca.inv(frame.rates_to_angular_velocity) @ (frame.attitude.T @ bullet_twist[3:6]),
        )
        state = ca.if_else(in_contact, corrected, predicted)
        published = ca.vertcat(
            state[0:7], ca.if_else(magnitude > 0, mean_nu, state[7:13]), state[13:]
        )
        return ca.Function(
            "contact_correct",
            [*arguments, previous],
            [state, magnitude, hull.observe(published), impulse],
            [*CORRECT_ARGUMENTS, "previous_contact_impulse"],
            [*CORRECT_RESULTS, "contact_impulse"],
        )

    def _inputs_with_contact_force(self, inputs: ca.SX, impulse: _Impulse, step: ca.SX) -> ca.SX:
        """Return the inputs with the contact force, constant over the step, added to the external loads."""
        names = [variable.name for variable in self.model.elements("input")]
        first = names.index("external_force.x")
        load = ca.vertcat(impulse.linear, impulse.angular) / step
        return ca.vertcat(
            inputs[:first], inputs[first : first + TWIST_SIZE] + load, inputs[first + TWIST_SIZE :]
        )


def _inertia_in_world(body: BulletBody, attitude: ca.SX) -> ca.SX:
    return attitude @ ca.diag(body.inertia) @ attitude.T


def _angular_velocity_change(body: BulletBody, attitude: ca.SX, impulse: ca.SX) -> ca.SX:
    """Return the change of angular velocity (rad/s, world frame) of Bullet's body by an angular impulse (N m s)."""
    return attitude @ ((attitude.T @ impulse) / body.inertia)


def _impulse_about_centre(hull: Hull, attitude: ca.SX, impulse: ca.SX) -> _Impulse:
    """Move an impulse (6) on O to the centre of mass."""
    return _Impulse(
        impulse[0:3], impulse[3:6] - ca.cross(attitude @ hull.centre_of_mass, impulse[0:3])
    )


def _impulse_load(hull: Hull, frame: Frame, impulse: _Impulse) -> ca.SX:
    """Return the impulse as a generalised impulse (6) about O in the equations of motion."""
    lever = frame.attitude @ hull.centre_of_mass
    return frame.generalised_force(
        impulse.linear, impulse.angular + ca.cross(lever, impulse.linear)
    )


def _integrate_pose(start: ca.SX, twist: ca.SX, step: ca.SX) -> ca.SX:
    """Return position and quaternion after a step (s) with a constant twist."""
    orientation = kinematics.quaternion_product(
        kinematics.quaternion_from_rotation_vector(twist[3:6] * step), start[3:7]
    )
    return ca.vertcat(start[0:3] + twist[0:3] * step, kinematics.normalised_quaternion(orientation))


def _bullet_pose(state: ca.SX) -> ca.SX:
    return ca.vertcat(state[0:3], state[4:7], state[3])
