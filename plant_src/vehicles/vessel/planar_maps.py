"""Contact functions (`common/contact_maps.py`) of vessels in the horizontal plane."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca

from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.contact_maps import (
    CORRECT_ARGUMENTS,
    INITIALIZE_RESULTS,
    PREDICT_ARGUMENTS,
    PREDICT_RESULTS,
    contact_impulse,
    correct_function,
    correct_symbols,
    create_symbols,
    parameters_and_constants,
    predict_symbols,
    predicted_state,
    step_status,
)


class PlanarBody(NamedTuple):
    """Mass (kg), moment of inertia about the yaw axis through the centre of mass (kg m2) and height of this centre (m)."""

    mass: ca.SX
    yaw_inertia: ca.SX
    height: ca.SX


@dataclass(frozen=True)
class PlanarContactMaps:
    """Contact functions of a vessel in the horizontal plane.

    The state begins with x, y, yaw, surge, sway and yaw rate of the centre of mass; contact does
    not change its further elements.

    Bullet's body cannot roll or pitch, but it can heave. A load presses it down; the lift that
    cancels this is predicted from the impulses of the last two steps, and Bullet receives it as an
    upward velocity. If Bullet finds the same impulse again, the body keeps its height. Of two
    unequal impulses the weaker one is used, so that an impact does not lift the vessel.

    The argument `vertical_load` holds the downward impulses of the last two steps (N s) and the
    heave in Bullet (m).

    Attributes:
        model: Equations of the vessel.
        body: Function from the constants to mass, inertia and height.
        observe: Function from state and constants to the published motion.
    """

    model: ContinuousModel
    body: Callable[[ca.SX], PlanarBody]
    observe: Callable[[ca.SX, ca.SX], ca.SX]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [self._initialize_function(), self._predict_function(), self._correct_function()]

    def _initialize_function(self) -> ca.Function:
        parameters, constants = parameters_and_constants(self.model)
        state = self.model.initial_state(constants)
        twist = _planar_twist(_planar_rotation(state[2]) @ state[3:5], ca.SX(0), state[5])
        return ca.Function(
            "contact_initialize",
            [parameters],
            [constants, state, twist, twist, _bullet_pose(state, self.body(constants))],
            ["parameters"],
            INITIALIZE_RESULTS,
        )

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model)
        state, end, constants, step = (
            arguments[0],
            predicted_state(self.model, *arguments[:5]),
            *arguments[3:5],
        )
        body = self.body(constants)
        (vertical_load,) = create_symbols(vertical_load=3)
        rates = (end[0:3] - state[0:3]) / step
        twist = _planar_twist(
            rates[0:2], _minmod(vertical_load[0], vertical_load[1]) / body.mass, rates[2]
        )
        endpoints = ca.vertcat(
            self.observe(state, constants)[0:3], self.observe(end, constants)[0:3]
        )
        previous_load = ca.vertcat(vertical_load[0], vertical_load[2])
        status = step_status(end, endpoints, arguments, ca.SX(0))
        results = [
            state,
            end,
            twist,
            twist,
            _bullet_pose(state, body),
            previous_load,
            endpoints,
            status,
        ]
        names = (
            *PREDICT_RESULTS,
            "bullet_pose",
            "previous_vertical_load",
            "endpoints",
            "step_status",
        )
        return ca.Function(
            "contact_predict",
            [*arguments, vertical_load],
            results,
            [*PREDICT_ARGUMENTS, "vertical_load"],
            names,
        )

    def _correct_function(self) -> ca.Function:
        start, predicted, twist, bullet_twist, constants, step = arguments = correct_symbols(
            self.model
        )
        (previous_load,) = create_symbols(previous_vertical_load=2)
        change, body = bullet_twist - twist, self.body(constants)
        velocity = predicted[3:6] + ca.vertcat(
            _planar_rotation(predicted[2]).T @ change[0:2], change[5]
        )
        impulse = contact_impulse(
            ca.norm_2(ca.vertcat(body.mass * change[0:3], body.yaw_inertia * change[5]))
        )
        pose = start[0:3] + step * ca.vertcat(bullet_twist[0:2], bullet_twist[5])
        published = ca.vertcat(
            pose, _planar_rotation(pose[2]).T @ bullet_twist[0:2], bullet_twist[5], predicted[6:]
        )
        vertical_load = ca.vertcat(
            -body.mass * change[2], previous_load[0], previous_load[1] + bullet_twist[2] * step
        )
        corrected = ca.vertcat(pose, velocity, predicted[6:])
        return correct_function(
            [*arguments, previous_load],
            [*CORRECT_ARGUMENTS, "previous_vertical_load"],
            impulse,
            predicted,
            corrected,
            lambda state: self.observe(state, constants),
            published,
            vertical_load=vertical_load,
        )


def _bullet_pose(state: ca.SX, body: PlanarBody) -> ca.SX:
    q = kinematics.quaternion_about_z(state[2])
    return ca.vertcat(state[0:2], body.height, q[1:4], q[0])


def _planar_twist(horizontal: ca.SX, vertical: ca.SX, yaw_rate: ca.SX) -> ca.SX:
    return ca.vertcat(horizontal, vertical, 0, 0, yaw_rate)


def _minmod(a: ca.SX, b: ca.SX) -> ca.SX:
    """Return the number with the smaller magnitude, or zero for different signs."""
    return ca.if_else(a * b > 0, ca.if_else(ca.fabs(a) < ca.fabs(b), a, b), 0)


def _planar_rotation(yaw: ca.SX) -> ca.SX:
    """Return the rotation matrix (2, 2) body to world frame."""
    return ca.vertcat(ca.horzcat(ca.cos(yaw), -ca.sin(yaw)), ca.horzcat(ca.sin(yaw), ca.cos(yaw)))
