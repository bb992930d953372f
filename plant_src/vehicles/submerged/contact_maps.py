"""Contact functions (`common/contact_maps.py`) of submerged vehicles.

As for floating vessels, the contact impulse of the previous step acts as a constant force while the
equations predict, and Bullet receives the predicted twist without its effect. Bullet then finds the
whole impulse again. The difference to the previous one changes the velocity by the mass matrix with
the added mass. In steady contact both are equal, and the force is that which the vehicle exerts.
The argument `contact_impulse` is the impulse in the last step (N s, N m s about the centre of mass,
world frame).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca

from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.contact_maps import (
    CORRECT_ARGUMENTS,
    CORRECT_RESULTS,
    IMPULSE_RESULTS,
    PREDICT_ARGUMENTS,
    TWIST_SIZE,
    contact_impulse,
    correct_symbols,
    create_symbols,
    free_initialize_function,
    predict_symbols,
    predicted_state,
    principal_pose,
    step_status,
)
from ..common.named_values import NamedValues
from ..common.rigid_body import motion_of_state, rigid_body
from .restoring import immersed_fraction, mass_matrix, solve_symmetric


@dataclass(frozen=True)
class SubmergedContactMaps:
    """Contact functions of a submerged vehicle.

    Attributes:
        model: Equations of the vehicle as they are exported; its environment inputs are the current
            (x, y) and the water level.
        by_name: Function from a vector of constants to the constants by name.
    """

    model: ContinuousModel
    by_name: Callable[[ca.SX], NamedValues]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [
            free_initialize_function(self.model),
            self._predict_function(),
            self._correct_function(),
        ]

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, inputs, environment_inputs, constants, step = arguments[:5]
        axes, impulse = create_symbols(principal_axes=4, contact_impulse=TWIST_SIZE)
        # the external loads are the first inputs
        loaded = ca.vertcat(inputs[:TWIST_SIZE] + impulse / step, inputs[TWIST_SIZE:])
        end = predicted_state(self.model, state, loaded, environment_inputs, constants, step)
        linear = (end[0:3] - state[0:3]) / step
        turn = kinematics.quaternion_product(end[3:7], kinematics.conjugate(state[3:7]))
        body, to_world = rigid_body(self.by_name(constants)), kinematics.rotation_matrix(state[3:7])
        angular = kinematics.rotation_vector(turn) / step - to_world @ (
            body.inverse_inertia @ (to_world.T @ impulse[3:6])
        )
        twist = ca.vertcat(linear - impulse[0:3] / body.mass, angular)
        # cancels the gyroscopic torque that Bullet adds to its body
        torque = ca.cross(angular, body.inertia_in_world(state[3:7]) @ angular)
        endpoints = ca.vertcat(state[0:3], end[0:3])
        status = step_status(end, endpoints, arguments, ca.SX(0))
        results = [
            state,
            end,
            twist,
            twist,
            torque,
            principal_pose(state, axes),
            impulse,
            endpoints,
            status,
        ]
        return ca.Function(
            "contact_predict",
            [*arguments, axes, impulse],
            results,
            [*PREDICT_ARGUMENTS, "principal_axes", "contact_impulse"],
            IMPULSE_RESULTS,
        )

    def _correct_function(self) -> ca.Function:
        start, predicted, twist, bullet_twist, constants, step = arguments = correct_symbols(
            self.model
        )
        environment_inputs, previous = create_symbols(
            environment_inputs=3, previous_contact_impulse=TWIST_SIZE
        )
        known, change = self.by_name(constants), bullet_twist - twist
        body, to_world = rigid_body(known), kinematics.rotation_matrix(predicted[3:7])
        linear, angular = body.mass * change[0:3], body.inertia_in_world(start[3:7]) @ change[3:6]
        magnitude = contact_impulse(ca.norm_2(linear))
        impulse = (
            ca.if_else(magnitude > 0, ca.vertcat(linear, angular), ca.SX.zeros(TWIST_SIZE))
            + 0 * magnitude
        )
        in_contact = ca.logic_or(magnitude > 0, ca.norm_2(previous) > 0)
        surplus = impulse - previous
        immersed = immersed_fraction(to_world[2, :].T, environment_inputs[-1] - predicted[2], known)
        surplus = ca.vertcat(to_world.T @ surplus[0:3], to_world.T @ surplus[3:6])
        gained = solve_symmetric(mass_matrix(known, immersed), surplus)
        rotation = kinematics.quaternion_from_rotation_vector(bullet_twist[3:6] * step)
        orientation = kinematics.normalised_quaternion(
            kinematics.quaternion_product(rotation, start[3:7])
        )
        pose = ca.vertcat(start[0:3] + bullet_twist[0:3] * step, orientation)
        velocity = predicted[7:13] + ca.vertcat(to_world @ gained[0:3], gained[3:6])
        state = ca.if_else(in_contact, ca.vertcat(pose, velocity, predicted[13:]), predicted)
        mean = ca.vertcat(
            bullet_twist[0:3], kinematics.rotation_matrix(orientation).T @ bullet_twist[3:6]
        )
        published = ca.vertcat(state[0:7], ca.if_else(magnitude > 0, mean, state[7:13]), state[13:])
        results = [state, magnitude, motion_of_state(published), impulse]
        return ca.Function(
            "contact_correct",
            [*arguments, environment_inputs, previous],
            results,
            [*CORRECT_ARGUMENTS, "environment_inputs", "previous_contact_impulse"],
            [*CORRECT_RESULTS, "contact_impulse"],
        )
