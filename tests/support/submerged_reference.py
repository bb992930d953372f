"""Equations of a submerged vehicle a second time, in NumPy (Fossen 2021), below and at the surface."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from plant_src.vehicles.submerged.craft import Craft


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def coriolis(mass_matrix: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Fossen 2021, equation 3.46: the Coriolis matrix of a mass matrix."""
    first, second = mass_matrix[:3] @ nu, mass_matrix[3:] @ nu
    return np.block([[np.zeros((3, 3)), -skew(first)], [-skew(first), -skew(second)]])


def derivative(craft: Craft, state: np.ndarray, command: np.ndarray, loads: np.ndarray, water: np.ndarray) -> np.ndarray:
    """Fossen's equations for nu in the body frame with nu_c' = -w x nu_c; `water` is the current and the level."""
    w, x, y, z = state[3:7]
    to_world = Rotation.from_quat([x, y, z, w]).as_matrix()
    rates, speeds = state[10:13], state[13:]
    nu = np.concatenate([to_world.T @ state[7:10], rates])
    current = np.concatenate([to_world.T @ [*water[:2], 0.0], np.zeros(3)])
    current_rate = np.concatenate([-np.cross(rates, current[:3]), np.zeros(3)])
    relative, level = nu - current, water[2]

    load, size = np.zeros(6), np.array(craft.size)
    fraction = 0.0
    for i in (-1, 1):
        for j in (-1, 1):
            for k in (-1, 1):
                place = np.array(craft.centre_of_buoyancy) + np.array([i, j, k]) * size / 4
                extent = float(np.abs(to_world[2]) @ size) / 2
                share = np.clip((level - state[2] - to_world[2] @ place) / extent + 0.5, 0, 1) / 8
                lift = to_world.T @ [0, 0, craft.water_density * craft.gravity * craft.displaced_volume * share]
                load += np.concatenate([lift, np.cross(place, lift)])
                fraction += share
    load[:3] -= to_world.T @ [0, 0, craft.mass * craft.gravity]
    for thruster, n in zip(craft.thrusters, speeds, strict=True):
        hub, axis = np.array(thruster.position), np.array(thruster.axis)
        wet = np.clip((level - state[2] - to_world[2] @ hub) / (2 * craft.thruster_radius) + 0.5, 0, 1)
        inflow = axis @ (relative[:3] + np.cross(rates, hub))
        gain = thruster.thrust_coefficient if n > 0 else thruster.reverse_thrust_coefficient
        thrust = wet * (gain * n * abs(n) - craft.advance_coefficient * abs(n) * inflow) * axis
        load += np.concatenate([thrust, np.cross(hub, thrust) + wet * thruster.torque_coefficient * n * abs(n) * axis])
    load += np.concatenate([to_world.T @ loads[:3], to_world.T @ loads[3:]])

    rigid = np.block([[craft.mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), craft.inertia]])
    added = fraction * craft.added_mass
    load -= coriolis(rigid, nu) @ nu + coriolis(added, relative) @ relative
    load -= fraction * (craft.linear_damping @ relative + craft.quadratic_damping @ (np.abs(relative) * relative))
    nu_rate = np.linalg.solve(rigid + added, load + added @ current_rate)
    acceleration = to_world @ (nu_rate[:3] + np.cross(rates, nu[:3]))
    p, q, r = rates
    turning = 0.5 * np.array([-x * p - y * q - z * r, w * p + y * r - z * q, w * q + z * p - x * r, w * r + x * q - y * p])
    speed_rates = (np.clip(command, -craft.max_thruster_speed, craft.max_thruster_speed) - speeds) / craft.thruster_time_constant
    return np.concatenate([state[7:10], turning, acceleration, nu_rate[3:], speed_rates])
