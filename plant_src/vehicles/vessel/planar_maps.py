"""Contact functions (`common/contact_maps.py`) and outputs of vessels in the horizontal plane."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
from casadi import SX

from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.contact_maps import (
    contact_impulse,
    correct_function,
    correct_symbols,
    create_symbols,
    initialize_function,
    predict_function,
    predict_symbols,
    predicted_state,
)


class PlanarBody(NamedTuple):
    """Mass (kg), moment of inertia about the vertical axis (kg m2) and height (m).

    Both belong to the centre of mass.
    """

    mass: SX
    yaw_inertia: SX
    height: SX


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
    body: Callable[[SX], PlanarBody]
    observe: Callable[[SX, SX], SX]

    def functions(self) -> list[ca.Function]:
        """Return the functions to export."""
        return [
            initialize_function(
                self.model,
                lambda state, _: _planar_twist(
                    _planar_rotation(state[2]) @ state[3:5], SX(0), state[5]
                ),
                lambda state, constants: _bullet_pose(state, self.body(constants)),
            ),
            self._predict_function(),
            self._correct_function(),
        ]

    def _predict_function(self) -> ca.Function:
        arguments = predict_symbols(self.model) | create_symbols(vertical_load=3)
        state, end = arguments["state"], predicted_state(self.model, arguments)
        constants, load = arguments["constants"], arguments["vertical_load"]
        body = self.body(constants)
        rates = (end[0:3] - state[0:3]) / arguments["step_size"]
        # the weaker of two impulses, 0 for different signs
        last, before, _ = ca.vertsplit(load)
        weaker = ca.if_else(ca.fabs(last) < ca.fabs(before), last, before)
        lift = ca.if_else(last * before > 0, weaker, 0) / body.mass
        positions = [self.observe(x, constants)[0:3] for x in (state, end)]
        return predict_function(
            arguments,
            end,
            _planar_twist(rates[0:2], lift, rates[2]),
            ca.vertcat(*positions),
            SX(0),
            bullet_pose=_bullet_pose(state, body),
            previous_vertical_load=ca.vertcat(load[0], load[2]),
        )

    def _correct_function(self) -> ca.Function:
        arguments = correct_symbols(self.model)
        start, predicted, twist, bullet_twist, constants, step = arguments.values()
        arguments |= create_symbols(previous_vertical_load=2)
        load, heave = ca.vertsplit(arguments["previous_vertical_load"])
        change, body = bullet_twist - twist, self.body(constants)
        turned_change = _planar_rotation(predicted[2]).T @ change[0:2]
        velocity = predicted[3:6] + ca.vertcat(turned_change, change[5])
        impulse = contact_impulse(
            ca.norm_2(ca.vertcat(body.mass * change[0:3], body.yaw_inertia * change[5]))
        )
        pose = start[0:3] + step * ca.vertcat(bullet_twist[0:2], bullet_twist[5])
        mean = _planar_rotation(pose[2]).T @ bullet_twist[0:2]
        return correct_function(
            arguments,
            impulse,
            ca.vertcat(pose, velocity, predicted[6:]),
            ca.vertcat(pose, mean, bullet_twist[5], predicted[6:]),
            lambda state: self.observe(state, constants),
            vertical_load=ca.vertcat(-body.mass * change[2], load, heave + bullet_twist[2] * step),
        )


def _bullet_pose(state: SX, body: PlanarBody) -> SX:
    q = kinematics.quaternion_about_z(state[2])
    return ca.vertcat(state[0:2], body.height, q[1:4], q[0])


def _planar_twist(horizontal: SX, vertical: SX, yaw_rate: SX) -> SX:
    return ca.vertcat(horizontal, vertical, 0, 0, yaw_rate)


def _planar_rotation(yaw: SX) -> SX:
    """Return the rotation matrix (2, 2) body to world frame."""
    return ca.vertcat(ca.horzcat(ca.cos(yaw), -ca.sin(yaw)), ca.horzcat(ca.sin(yaw), ca.cos(yaw)))


def planar_outputs(state: SX, height: SX, deck: SX) -> SX:
    """Return the motion outputs of a planar vessel and of its landing deck.

    Args:
        state: State, which begins with that of `interface.PLANAR_STATES`.
        height: Height of the centre of mass (m, world frame).
        deck: Centre of the top of the landing deck from the centre of mass (m, body frame).
    """
    position = ca.vertcat(state[0:2], height)
    orientation = kinematics.quaternion_about_z(state[2])
    to_world = kinematics.rotation_matrix(orientation)
    rates = ca.vertcat(0, 0, state[5])
    velocity = to_world @ ca.vertcat(state[3:5], 0)
    to_deck = to_world @ deck
    motion = kinematics.motion_outputs(position, orientation, velocity, rates)
    return ca.vertcat(motion, position + to_deck, velocity + ca.cross(rates, to_deck))
