"""Equations of a submerged vehicle once more, in NumPy (Fossen 2021), also at the surface."""

from __future__ import annotations

from itertools import product
from operator import attrgetter

import numpy as np

from plant_src.vehicles.submerged.craft import Craft

OCTANTS = np.array(list(product((-1, 1), repeat=3))) / 4


def skew(v: np.ndarray) -> np.ndarray:
    x, y, z = v
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def coriolis(mass_matrix: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Fossen 2021, equation 3.46: the Coriolis matrix of a mass matrix."""
    momentum, matrix = mass_matrix @ nu, np.zeros((6, 6))
    matrix[:3, 3:] = matrix[3:, :3] = -skew(momentum[:3])
    matrix[3:, 3:] = -skew(momentum[3:])
    return matrix


def rotation(quaternion: np.ndarray) -> np.ndarray:
    """The matrix from the body to the world of a quaternion of any length, by Euler-Rodrigues."""
    turn = skew(quaternion[1:])
    return np.eye(3) + 2 * (quaternion[0] * turn + turn @ turn) / (quaternion @ quaternion)


def arrays(craft: Craft) -> tuple[np.ndarray, ...]:
    """Hubs, axes, loads of unit thrusts (6, n), coefficients of thrust (both senses) and of torque,
    and the rigid mass matrix.
    """
    hubs = np.array([thruster.position for thruster in craft.thrusters])
    axes = np.array([thruster.axis for thruster in craft.thrusters])
    coefficients = attrgetter(
        "thrust_coefficient", "reverse_thrust_coefficient", "torque_coefficient"
    )
    gains = np.array(list(map(coefficients, craft.thrusters))).T
    rigid = np.diag([craft.mass] * 3 + [0.0] * 3)
    rigid[3:, 3:] = craft.inertia
    return hubs, axes, np.hstack([axes, np.cross(hubs, axes)]).T, gains, rigid


def derivative(
    craft: Craft, state: np.ndarray, command: np.ndarray, loads: np.ndarray, water: np.ndarray
) -> np.ndarray:
    """Fossen's equations for nu in the body frame with nu_c' = -w x nu_c; `water` is the current
    and the level.
    """
    hubs, axes, arms, (ahead, astern, torque), rigid = arrays(craft)
    to_world = rotation(state[3:7])
    up, rates, speeds, depth = to_world[2], state[10:13], state[13:], water[2] - state[2]
    turn, still = skew(rates), np.zeros(3)
    nu = np.concatenate([state[7:10] @ to_world, rates])
    current = np.concatenate([water[:2] @ to_world[:2], still])
    relative = nu - current

    size = np.array(craft.size)
    places = np.array(craft.centre_of_buoyancy) + OCTANTS * size
    shares = np.clip((depth - places @ up) / (np.abs(up) @ size / 2) + 0.5, 0, 1) / 8
    lift, fraction = craft.water_density * craft.gravity * craft.displaced_volume * up, shares.sum()
    load = np.concatenate(
        [fraction * lift - craft.mass * craft.gravity * up, skew(shares @ places) @ lift]
    )
    wet = np.clip((depth - hubs @ up) / (2 * craft.thruster_radius) + 0.5, 0, 1) * np.abs(speeds)
    load += arms @ (
        wet
        * (
            np.where(speeds > 0, ahead, astern) * speeds
            - craft.advance_coefficient * (relative @ arms)
        )
    )
    load[3:] += (wet * torque * speeds) @ axes
    load += np.concatenate([loads[:3] @ to_world, loads[3:] @ to_world])

    added = fraction * craft.added_mass
    load -= coriolis(rigid, nu) @ nu + coriolis(added, relative) @ relative
    load -= fraction * (
        craft.linear_damping @ relative + craft.quadratic_damping @ (np.abs(relative) * relative)
    )
    nu_rate = np.linalg.solve(
        rigid + added, load + added @ np.concatenate([-turn @ current[:3], still])
    )
    acceleration = to_world @ (nu_rate[:3] + turn @ nu[:3])
    turning = 0.5 * np.concatenate(
        [[-state[4:7] @ rates], state[3] * rates + skew(state[4:7]) @ rates]
    )
    speed_rates = (
        np.clip(command, -craft.max_thruster_speed, craft.max_thruster_speed) - speeds
    ) / craft.thruster_time_constant
    return np.concatenate([state[7:10], turning, acceleration, nu_rate[3:], speed_rates])
