"""Derivatives of a multirotor with 16 different, tilted rotors in air and water against an
implementation in NumPy.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation

from plant_src.vehicles.multirotor.airframe import (
    MAX_ROTORS,
    Airframe,
    Hull,
    Rotor,
    RotorEffects,
    variables,
)
from plant_src.vehicles.multirotor.equations import MultirotorEquations

RANDOM = np.random.default_rng(20)
MASS, GRAVITY, RADIUS, LAG, SPIN_INERTIA = 3.0, 9.7, 0.08, 0.05, 2e-5
TURN = Rotation.from_rotvec([0.3, -0.8, 0.5]).as_matrix()
INERTIA = TURN @ np.diag([0.05, 0.06, 0.08]) @ TURN.T
HUBS = RANDOM.uniform(-0.6, 0.6, (MAX_ROTORS, 3))
AXES = RANDOM.standard_normal((MAX_ROTORS, 3)) + np.array([0, 0, 3])
AXES /= np.linalg.norm(AXES, axis=1)[:, None]
SIGNS = RANDOM.choice([-1.0, 1.0], MAX_ROTORS)
THRUST, TORQUE = RANDOM.uniform(1e-6, 9e-6, MAX_ROTORS), RANDOM.uniform(1e-8, 9e-8, MAX_ROTORS)
LIFT, EDGES, VOLUME, WATER_DRAG = 0.02, np.array([0.5, 0.4, 0.3]), 2e-3, 0.9
ROTOR_DRAG, BODY_DRAG = np.array([3e-5, 2e-5, 1e-5]), np.array([0.02, 0.03, 0.05])

AIRFRAME = Airframe(
    "scatter",
    MASS,
    (INERTIA + INERTIA.T) / 2,
    tuple(
        Rotor(str(i), tuple(HUBS[i]), SIGNS[i], THRUST[i], TORQUE[i], tuple(AXES[i]))
        for i in range(MAX_ROTORS)
    ),
    900.0,
    RADIUS,
    RotorEffects(LAG, SPIN_INERTIA, tuple(ROTOR_DRAG), tuple(BODY_DRAG), 0.8, LIFT),
    GRAVITY,
    Hull(tuple(EDGES), VOLUME, WATER_DRAG),
)


def ground_factor(i: int, height: float, share: float, speed_ratio: float) -> float:
    """The ratio of a rotor's thrust; the speed of the air is that in its plane over the induced
    velocity.
    """
    z = max(height, RADIUS / 2)
    distances = np.hypot(*(HUBS[:, :2] - HUBS[i, :2]).T)
    reduction = float(np.sum(RADIUS**2 / 2 * z / np.sqrt(distances**2 + 4 * z**2) ** 3)) / (
        1 + speed_ratio**2
    )
    return 1 + 0.8 * share * (1 / (1 - min(0.5, reduction)) - 1)


def derivative(
    state: np.ndarray,
    command: np.ndarray,
    loads: np.ndarray,
    wind: np.ndarray,
    ground: np.ndarray,
    water: np.ndarray,
) -> np.ndarray:
    """Newton and Euler, rotor by rotor, with rotation matrices; `water` is the level and the
    current.
    """
    w, x, y, z = state[3:7]
    to_world = Rotation.from_quat([x, y, z, w]).as_matrix()
    velocity, rates, speeds = state[7:10], state[10:13], state[13:]
    air = to_world.T @ (velocity - wind)
    speed_rates = (np.clip(command, 0, 900) - speeds) / LAG
    force, torque = -np.linalg.norm(air) * BODY_DRAG * air, np.zeros(3)
    for i in range(MAX_ROTORS):
        hub_height = state[2] + (to_world @ HUBS[i])[2]
        speed = speeds[i] * np.clip((hub_height - water[0]) / RADIUS + 0.5, 0, 1)
        flow = air + np.cross(rates, HUBS[i])
        in_plane = float(np.linalg.norm(np.cross(AXES[i], flow)))
        thrust = THRUST[i] * speed**2
        induced = np.sqrt(thrust / (2 * 1.225 * np.pi * RADIUS**2))
        lift = LIFT * min(in_plane, RADIUS * speed / 2) ** 2
        factor = ground_factor(i, *ground, speed_ratio=in_plane / induced) if speed else 1.0
        pull = (factor * thrust + lift) * AXES[i] - speed * ROTOR_DRAG * flow
        momentum = -SPIN_INERTIA * SIGNS[i] * AXES[i]
        force += pull
        torque += np.cross(HUBS[i], pull) + SIGNS[i] * TORQUE[i] * speed**2 * AXES[i]
        torque -= np.cross(rates, momentum * speeds[i]) + momentum * speed_rates[i]
    immersed = np.clip((water[0] - state[2]) / EDGES[2] + 0.5, 0, 1)
    flow, (a, b, c) = to_world.T @ (velocity - [*water[1:], 0]), EDGES
    force -= (
        immersed
        * 1025
        / 2
        * WATER_DRAG
        * np.linalg.norm(flow)
        * np.array([b * c, a * c, a * b])
        * flow
    )
    plates = np.array([a * b**4, b * a**4, c * (a**4 + b**4)]) / 32
    torque -= immersed * 1025 / 2 * WATER_DRAG * np.linalg.norm(rates) * plates * rates
    weight = [0, 0, MASS * GRAVITY - immersed * 1025 * VOLUME * GRAVITY]
    acceleration = (to_world @ force + loads[:3] - weight) / (
        MASS + immersed * 0.68 * 1025 * a * b * c
    )
    moment = torque + to_world.T @ loads[3:] - np.cross(rates, AIRFRAME.inertia @ rates)
    p, q, r = rates
    turning = 0.5 * np.array(
        [
            -x * p - y * q - z * r,
            w * p + y * r - z * q,
            w * q + z * p - x * r,
            w * r + x * q - y * p,
        ]
    )
    return np.concatenate(
        [velocity, turning, acceleration, np.linalg.solve(AIRFRAME.inertia, moment), speed_rates]
    )


def test_derivatives_equal_those_of_numpy_at_1000_random_states(measured: MeasurementCheck) -> None:
    equations = MultirotorEquations(AIRFRAME, MAX_ROTORS)
    starts = [v.start for v in variables(AIRFRAME) if v.causality == "parameter"]
    constants = ca.DM(
        equations.constants.vector(ca.SX(np.concatenate([np.ravel(start) for start in starts])))
    )
    symbols = [ca.SX.sym("", size) for size in (13 + MAX_ROTORS, MAX_ROTORS + 14)]
    rate = ca.Function("rate", symbols, [equations.rate(*symbols, ca.SX(constants))])
    worst = 0.0
    for _ in range(1000):
        quaternion = RANDOM.standard_normal(4)
        state = np.concatenate(
            [
                RANDOM.standard_normal(3),
                quaternion / np.linalg.norm(quaternion),
                5 * RANDOM.standard_normal(6),
            ]
        )
        state = np.concatenate([state, RANDOM.uniform(0, 900, MAX_ROTORS)])
        command, ground = RANDOM.uniform(-100, 1000, MAX_ROTORS), RANDOM.uniform(0, 1, 2)
        water = np.array([state[2] + RANDOM.uniform(-1.5, 0.5), *RANDOM.standard_normal(2)])
        loads, wind = 5 * RANDOM.standard_normal(6), 5 * RANDOM.standard_normal(3)
        found = rate(state, np.concatenate([loads, command, wind, ground, water])).full().ravel()
        expected = derivative(state, command, loads, wind, ground, water)
        worst = max(worst, float(np.max(np.abs(found - expected)) / np.max(np.abs(expected))))
    measured(
        "Multirotors",
        "derivatives at 1000 random states, 16 tilted rotors, in air and water",
        worst,
        0.0,
        "1",
        "NumPy",
        within=1e-12,
    )
