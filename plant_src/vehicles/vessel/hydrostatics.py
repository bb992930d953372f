"""Weight and buoyancy of vessels whose hulls are strips, and their equilibrium."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca

from ..common import kinematics
from .hull import load_of_force_at
from .strips import STRIP_COUNT, Immersion, TwinHull, immersion
from .wave_loads import GRAVITY


@dataclass(frozen=True)
class Ballast:
    """Weight of a vessel and density of the water.

    Attributes:
        mass: Mass (kg).
        centre_of_mass: Centre of mass from O (m, body frame), shape (3,).
        water_density: Density of the water (kg/m3).
    """

    mass: ca.SX
    centre_of_mass: ca.SX
    water_density: ca.SX


def weight_and_buoyancy(under_water: Immersion, up: ca.SX, ballast: Ballast) -> ca.SX:
    """Return the load tau (6) of weight and buoyancy for the vertical axis in the body frame."""
    weight = load_of_force_at(ballast.centre_of_mass, -GRAVITY * ballast.mass * up)
    density = GRAVITY * ballast.water_density
    return weight + density * ca.vertcat(under_water.volume * up, ca.cross(under_water.moment, up))


def improved_equilibrium(state: ca.SX, hull: TwinHull, ballast: Ballast, stiffness: ca.SX) -> ca.SX:
    """Return height of O (m), roll and pitch (rad) after one step of Newton's method towards the equilibrium in still water.

    Args:
        state: Height, roll and pitch before the step, shape (3,).
        hull: Hulls.
        ballast: Weight of the vessel.
        stiffness: Stiffness of heave (N/m), roll and pitch (N m/rad) at the centre of the waterplane, shape (3,).
    """
    middle = hull.strips.centre
    up = upward_axis(state)
    load = weight_and_buoyancy(immersion(hull, up, state[0], ca.SX.zeros(STRIP_COUNT)), up, ballast)
    force, moment = ca.dot(load[0:3], up), load[3:6] - ca.cross(middle, load[0:3])
    angles = moment[0:2] / stiffness[1:3]
    return state + ca.vertcat(force / stiffness[0] + middle[0] * angles[1], angles)


def attitude_at(state: ca.SX) -> ca.SX:
    """Return the rotation matrix body to world frame for height, roll and pitch with the yaw angle 0."""
    return kinematics.rotation_matrix(
        kinematics.quaternion_from_euler(state[1], state[2], ca.SX(0))
    )


def upward_axis(state: ca.SX) -> ca.SX:
    """Return the vertical axis of the world in the body frame for height, roll and pitch, shape (3,)."""
    return attitude_at(state)[2, :].T
