"""Derivatives of vessels that are given by data, with random matrices, propellers and rudders,
against NumPy.
"""

from __future__ import annotations

from typing import Any

import boat_reference as reference
import numpy as np
import pytest
from catamaran_reference import water_at
from scipy.spatial.transform import Rotation

from plant_src.environment import sea
from plant_src.vehicles.common.interface import MAX_WAVE_COMPONENTS
from plant_src.vehicles.planar_vessel.planar_vessel import PlanarVessel
from plant_src.vehicles.surface_vessel.surface_vessel import HullForm, SurfaceVessel
from plant_src.vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS, Propeller, Rudder

casadi = pytest.importorskip("casadi")

RANDOM = np.random.default_rng(8)
STATES = 100  # of each family; half of those of floating vessels with one hull, half with two
SEA = {
    "seed": 5,
    "waves": {
        "significant_height": 0.4,
        "peak_period": 2.5,
        "direction": 0.7,
        "spreading": 4,
        "components": 9,
    },
}


def positive_definite(size: int, scale: float) -> np.ndarray:
    factor = RANDOM.standard_normal((size, size))
    matrix = scale * (factor @ factor.T + np.eye(size)) / (size + 1)
    return (matrix + matrix.T) / 2


def propeller(number: int) -> Propeller:
    axis = RANDOM.standard_normal(3)
    numbers = RANDOM.uniform(
        [1e-3, 1e-3, 50, 30, 0.1, 0.03, 1e-3, 0], [5e-3, 4e-3, 90, 60, 0.3, 0.06, 5e-3, 2]
    )
    numbers[[4, 5, 7]] *= (
        number % 2,
        number % 3 > 0,
        number % 4 > 0,
    )  # without lag, radius or azimuth angle
    return Propeller(
        str(number),
        tuple(RANDOM.uniform(-1, 1, 3)),
        tuple(axis / np.linalg.norm(axis)),
        *numbers.tolist(),
    )


def rudder(number: int) -> Rudder:
    numbers = RANDOM.uniform([0.01, 0.8, 0.3, 0.4], [0.05, 1.4, 0.7, 0.9]).tolist()
    return Rudder(str(number), tuple(RANDOM.uniform(-1, 1, 3)), *numbers, propeller=2 * number % 5)


def boat(size: int) -> dict[str, Any]:
    propellers = tuple(propeller(k) for k in range(MAX_PROPELLERS))
    return {
        "name": "scatter",
        "mass": 40.0,
        "centre_of_mass": (0.05, 0.02, 0.1),
        "added_mass": positive_definite(size, 20),
        "coriolis_added_mass": positive_definite(size, 20),
        "linear_damping": positive_definite(size, 30),
        "air_drag": (0.3, 0.5),
        "air_centre": (0.1, 0.05, 0.4),
        "deck_centre": (0.0, 0.0, 0.5),
        "propellers": propellers,
        "rudders": tuple(rudder(k) for k in range(MAX_RUDDERS)),
        "water_density": 1010.0,
    }


def commands() -> reference.Commands:
    speed, azimuth = RANDOM.uniform([[-100], [-2]], [[100], [2]], (2, MAX_PROPELLERS))
    loads = RANDOM.uniform(-5, 5, 11)
    return reference.Commands(
        speed, azimuth, RANDOM.uniform(-1, 1, MAX_RUDDERS), *np.split(loads, [3, 6, 9])
    )


def inputs(given: reference.Commands) -> list[float]:
    return [
        *given.force,
        *given.torque,
        *given.speed,
        *given.azimuth,
        *given.rudder,
        *given.wind,
        *given.current,
    ]


def rate_function(model: Any, given: dict[str, Any]) -> Any:
    values = np.concatenate(
        [
            np.ravel(given.get(v.name, v.start))
            for v in model.variables
            if v.causality == "parameter"
        ]
    )
    constants = casadi.DM(model.derived_parameters(casadi.SX(values)))
    state, u = (
        casadi.SX.sym("x", len(model.states)),
        casadi.SX.sym("u", len(model.elements("input"))),
    )
    return casadi.Function("rate", [state, u], [model.derivatives(state, u, casadi.SX(constants))])


def test_planar_vessel_at_random_states() -> None:
    from plant_src.vehicles.planar_vessel.equations import planar_vessel_model

    quadratic = tuple(10 * RANDOM.uniform(0, 1, (3, 3)) for _ in range(3))
    vessel = PlanarVessel(
        **boat(3),
        yaw_inertia=7.0,
        height=0.1,
        quadratic_damping=quadratic,
        cubic_damping=(1.0, 2.0, 3.0),
    )
    rate = rate_function(planar_vessel_model(vessel, "", (MAX_PROPELLERS, MAX_RUDDERS)), {})
    for _ in range(STATES):
        yaw, nu, speeds, given = (
            RANDOM.uniform(-3, 3),
            RANDOM.uniform(-2, 2, 3),
            RANDOM.uniform(-60, 60, MAX_PROPELLERS),
            commands(),
        )
        found = rate([0, 0, yaw, *nu, *speeds], inputs(given)).full().ravel()
        expected = reference.planar_rate(vessel, yaw, nu, speeds, given)
        assert found[3:6] == pytest.approx(expected, rel=0, abs=1e-12 * np.linalg.norm(expected))
        turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
        assert found[:3] == pytest.approx([*(turn @ nu[:2]), nu[2]], abs=1e-12)
        assert found[6:] == pytest.approx(reference.speed_rates(vessel, speeds, given), rel=1e-12)


@pytest.mark.parametrize("count", [1, 2])
def test_floating_vessel_at_random_states(count: int) -> None:
    """Half of the states lie in all attitudes and up to 0.4 m above or below the water, the others
    near the rest.
    """
    from plant_src.vehicles.surface_vessel.equations import surface_vessel_model

    hull = HullForm(
        count, 1.6, 0.4 / count, 0.3, 0.4, -0.25, -0.04, 0.8, 0.05 * count, 0.1 * count, 1.2, 0.9
    )
    inertia, quadratic = positive_definite(3, 1) + 4 * np.eye(3), RANDOM.uniform(0, 30, (6, 6))
    vessel = SurfaceVessel(**boat(6), inertia=inertia, quadratic_damping=quadratic, hull=hull)
    equations = surface_vessel_model(vessel, "", (MAX_PROPELLERS, MAX_RUDDERS))
    realisation = sea(SEA)
    components = len(realisation.phase)
    given_waves: dict[str, Any] = {"wave.count": float(components)}
    for name in ("amplitude", "frequency", "direction", "phase"):
        given_waves[f"wave.{name}"] = [
            *getattr(realisation, name),
            *[0.0] * (MAX_WAVE_COMPONENTS - components),
        ]
    rate = rate_function(equations.create_continuous_model(), given_waves)
    points, centre, emerged = (
        reference.strip_points(vessel),
        np.array([hull.waterplane_centre, 0, hull.bottom + vessel.draught]),
        0,
    )
    for k in range(STATES // 2):
        tilt = np.pi if k % 2 else 0.05
        turned = Rotation.from_euler(
            "ZYX", [RANDOM.uniform(-3, 3), *RANDOM.uniform(-tilt, tilt, 2)]
        )
        place = np.array(
            [
                *RANDOM.uniform(-5, 5, 2),
                -centre[2] + RANDOM.uniform(-0.4, 0.4) * (1 if k % 2 else 0.1),
            ]
        )
        nu, speeds, time, given = (
            RANDOM.uniform(-1, 1, 6),
            RANDOM.uniform(-60, 60, MAX_PROPELLERS),
            RANDOM.uniform(0, 60),
            commands(),
        )
        matrix, (x, y, z, w) = turned.as_matrix(), turned.as_quat()
        surface = (np.column_stack([points, np.zeros(10)]) + centre) @ matrix.T + place
        water = water_at(realisation, surface[:, :2], time, points, hull.strip_beam, vessel.draught)
        found = rate([*place, w, x, y, z, *nu, time, *speeds], [*inputs(given), 1.0]).full().ravel()
        expected = reference.floating_rate(
            vessel, np.concatenate([place, nu, speeds]), given, water, matrix
        )
        assert found[7:13] == pytest.approx(expected, rel=0, abs=1e-12 * np.linalg.norm(expected))
        assert found[14:] == pytest.approx(reference.speed_rates(vessel, speeds, given), rel=1e-12)
        emerged += reference.buoyancy(vessel, matrix[2], place[2], np.zeros(10))[1] < 0.99
    assert emerged > STATES / 8
