"""Derivatives of a submerged vehicle with 16 different thrusters, below and at the surface, against
NumPy.
"""

from __future__ import annotations

import casadi as ca
import numpy as np
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation
from submerged_reference import derivative

from plant_src.vehicles.submerged.craft import MAX_THRUSTERS, Craft, Thruster, variables
from plant_src.vehicles.submerged.equations import SubmergedEquations

RANDOM = np.random.default_rng(21)


def positive_definite(scale: float) -> np.ndarray:
    factor = RANDOM.standard_normal((6, 6))
    return scale * (factor @ factor.T + np.eye(6)) / 7


TURN = Rotation.from_rotvec([0.2, 0.4, -0.7]).as_matrix()
INERTIA = TURN @ np.diag([0.5, 0.6, 0.8]) @ TURN.T
MASS, GRAVITY, DENSITY, VOLUME, LAG, ADVANCE, RADIUS, LIMIT = (
    12.0,
    9.7,
    1010.0,
    0.0125,
    0.2,
    0.003,
    0.05,
    250.0,
)
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
    tuple(
        Thruster(str(i), tuple(HUBS[i]), tuple(AXES[i]), FORWARD[i], REVERSE[i], TORQUE[i])
        for i in range(MAX_THRUSTERS)
    ),
    LIMIT,
    RADIUS,
    LAG,
    ADVANCE,
    GRAVITY,
    DENSITY,
)


def test_derivatives_equal_those_of_numpy_at_1000_random_states(measured: MeasurementCheck) -> None:
    equations = SubmergedEquations(CRAFT, MAX_THRUSTERS)
    starts = [v.start for v in variables(CRAFT) if v.causality == "parameter"]
    constants = ca.DM(
        equations.constants.vector(ca.SX(np.concatenate([np.ravel(start) for start in starts])))
    )
    symbols = [ca.SX.sym("", size) for size in (13 + MAX_THRUSTERS, MAX_THRUSTERS + 9)]
    rate = ca.Function("rate", symbols, [equations.rate(*symbols, ca.SX(constants))])
    worst, surfaced = 0.0, 0
    for _ in range(1000):
        quaternion = RANDOM.standard_normal(4)
        state = np.concatenate(
            [
                RANDOM.standard_normal(3),
                quaternion / np.linalg.norm(quaternion),
                RANDOM.standard_normal(6),
            ]
        )
        state = np.concatenate([state, RANDOM.uniform(-LIMIT, LIMIT, MAX_THRUSTERS)])
        command, loads = RANDOM.uniform(-300, 300, MAX_THRUSTERS), 5 * RANDOM.standard_normal(6)
        water = np.array([*RANDOM.standard_normal(2), state[2] + RANDOM.uniform(-0.4, 0.6)])
        surfaced += abs(water[2] - state[2]) < 0.3
        found = rate(state, np.concatenate([loads, command, water])).full().ravel()
        expected = derivative(CRAFT, state, command, loads, water)
        worst = max(worst, float(np.max(np.abs(found - expected)) / np.max(np.abs(expected))))
    assert surfaced > 75
    measured(
        "Submerged vehicles",
        "derivatives at 1000 random states, 16 thrusters, full matrices, below and at the surface",
        worst,
        0.0,
        "1",
        "NumPy, Fossen 2021",
        within=1e-12,
    )
