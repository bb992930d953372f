"""Derivatives of a submerged vehicle with 16 different thrusters, below and at the surface, against NumPy."""

from __future__ import annotations

import casadi as ca
import numpy as np
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation

from plant_src.vehicles.submerged.craft import MAX_THRUSTERS, Craft, Thruster
from plant_src.vehicles.submerged.interface import variables
from plant_src.vehicles.submerged.submerged_equations import SubmergedEquations

RANDOM = np.random.default_rng(21)


def positive_definite(scale: float) -> np.ndarray:
    factor = RANDOM.standard_normal((6, 6))
    return scale * (factor @ factor.T + np.eye(6)) / 7


TURN = Rotation.from_rotvec([0.2, 0.4, -0.7]).as_matrix()
INERTIA = TURN @ np.diag([0.5, 0.6, 0.8]) @ TURN.T
MASS, GRAVITY, DENSITY, VOLUME, LAG, ADVANCE, RADIUS, LIMIT = 12.0, 9.7, 1010.0, 0.0125, 0.2, 0.003, 0.05, 250.0
CENTRE, SIZE = np.array([0.01, -0.02, 0.03]), np.array([0.5, 0.4, 0.3])
ADDED, LINEAR = positive_definite(6.0), positive_definite(8.0)
QUADRATIC = RANDOM.uniform(0, 30, (6, 6))
HUBS = RANDOM.uniform(-0.4, 0.4, (MAX_THRUSTERS, 3))
AXES = RANDOM.standard_normal((MAX_THRUSTERS, 3))
AXES /= np.linalg.norm(AXES, axis=1)[:, None]
FORWARD, REVERSE = RANDOM.uniform(1e-4, 5e-4, (2, MAX_THRUSTERS))
TORQUE = RANDOM.uniform(-9e-6, 9e-6, MAX_THRUSTERS)

CRAFT = Craft(
    "scatter",
    MASS,
    (INERTIA + INERTIA.T) / 2,
    VOLUME,
    tuple(CENTRE),
    tuple(SIZE),
    (ADDED + ADDED.T) / 2,
    LINEAR,
    QUADRATIC,
    tuple(Thruster(str(i), tuple(HUBS[i]), tuple(AXES[i]), FORWARD[i], REVERSE[i], TORQUE[i]) for i in range(MAX_THRUSTERS)),
    LIMIT,
    RADIUS,
    LAG,
    ADVANCE,
    GRAVITY,
    DENSITY,
)


def skew(v: np.ndarray) -> np.ndarray:
    return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


def coriolis(mass_matrix: np.ndarray, nu: np.ndarray) -> np.ndarray:
    """Fossen 2021, equation 3.46: the Coriolis matrix of a mass matrix."""
    first, second = mass_matrix[:3] @ nu, mass_matrix[3:] @ nu
    return np.block([[np.zeros((3, 3)), -skew(first)], [-skew(first), -skew(second)]])


def derivative(state: np.ndarray, command: np.ndarray, loads: np.ndarray, water: np.ndarray) -> np.ndarray:
    """Fossen's equations for nu in the body frame with nu_c' = -w x nu_c; `water` is the current and the level."""
    w, x, y, z = state[3:7]
    to_world = Rotation.from_quat([x, y, z, w]).as_matrix()
    rates, speeds = state[10:13], state[13:]
    nu = np.concatenate([to_world.T @ state[7:10], rates])
    current = np.concatenate([to_world.T @ [*water[:2], 0.0], np.zeros(3)])
    current_rate = np.concatenate([-np.cross(rates, current[:3]), np.zeros(3)])
    relative, level = nu - current, water[2]

    load = np.zeros(6)
    fraction = 0.0
    for i in (-1, 1):
        for j in (-1, 1):
            for k in (-1, 1):
                place = CENTRE + np.array([i, j, k]) * SIZE / 4
                extent = float(np.abs(to_world[2]) @ SIZE) / 2
                share = np.clip((level - state[2] - to_world[2] @ place) / extent + 0.5, 0, 1) / 8
                lift = to_world.T @ [0, 0, DENSITY * GRAVITY * VOLUME * share]
                load += np.concatenate([lift, np.cross(place, lift)])
                fraction += share
    load[:3] -= to_world.T @ [0, 0, MASS * GRAVITY]
    for i in range(MAX_THRUSTERS):
        n = speeds[i]
        wet = np.clip((level - state[2] - to_world[2] @ HUBS[i]) / (2 * RADIUS) + 0.5, 0, 1)
        inflow = AXES[i] @ (relative[:3] + np.cross(rates, HUBS[i]))
        thrust = wet * ((FORWARD[i] if n > 0 else REVERSE[i]) * n * abs(n) - ADVANCE * abs(n) * inflow) * AXES[i]
        load += np.concatenate([thrust, np.cross(HUBS[i], thrust) + wet * TORQUE[i] * n * abs(n) * AXES[i]])
    load += np.concatenate([to_world.T @ loads[:3], to_world.T @ loads[3:]])

    rigid = np.block([[MASS * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), CRAFT.inertia]])
    added = fraction * CRAFT.added_mass
    load -= coriolis(rigid, nu) @ nu + coriolis(added, relative) @ relative
    load -= fraction * (LINEAR @ relative + QUADRATIC @ (np.abs(relative) * relative))
    nu_rate = np.linalg.solve(rigid + added, load + added @ current_rate)
    acceleration = to_world @ (nu_rate[:3] + np.cross(rates, nu[:3]))
    p, q, r = rates
    turning = 0.5 * np.array([-x * p - y * q - z * r, w * p + y * r - z * q, w * q + z * p - x * r, w * r + x * q - y * p])
    speed_rates = (np.clip(command, -LIMIT, LIMIT) - speeds) / LAG
    return np.concatenate([state[7:10], turning, acceleration, nu_rate[3:], speed_rates])


def test_derivatives_equal_those_of_numpy_at_random_states(measured: MeasurementCheck) -> None:
    equations = SubmergedEquations(CRAFT, MAX_THRUSTERS)
    starts = [v.start for v in variables(CRAFT) if v.causality == "parameter"]
    constants = ca.DM(equations.constants.vector(ca.SX(np.concatenate([np.ravel(start) for start in starts]))))
    symbols = [ca.SX.sym("", size) for size in (13 + MAX_THRUSTERS, MAX_THRUSTERS + 9)]
    rate = ca.Function("rate", symbols, [equations.rate(*symbols, ca.SX(constants))])
    worst, surfaced = 0.0, 0
    for _ in range(250):
        quaternion = RANDOM.standard_normal(4)
        state = np.concatenate([RANDOM.standard_normal(3), quaternion / np.linalg.norm(quaternion), RANDOM.standard_normal(6)])
        state = np.concatenate([state, RANDOM.uniform(-LIMIT, LIMIT, MAX_THRUSTERS)])
        command, loads = RANDOM.uniform(-300, 300, MAX_THRUSTERS), 5 * RANDOM.standard_normal(6)
        water = np.array([*RANDOM.standard_normal(2), state[2] + RANDOM.uniform(-0.4, 0.6)])
        surfaced += abs(water[2] - state[2]) < 0.3
        found = rate(state, np.concatenate([loads, command, water])).full().ravel()
        expected = derivative(state, command, loads, water)
        worst = max(worst, float(np.max(np.abs(found - expected)) / np.max(np.abs(expected))))
    assert surfaced > 75
    measured(
        "Submerged vehicles",
        "derivatives at 250 random states, 16 thrusters, full matrices, below and at the surface",
        worst,
        0.0,
        "1",
        "NumPy, Fossen 2021",
        within=1e-12,
    )
