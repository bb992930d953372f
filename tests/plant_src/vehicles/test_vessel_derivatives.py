"""Derivatives of the vessels against an independent implementation at random states, emerged hulls
included.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
from catamaran_reference import Catamaran
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation

from plant_src.environment import sea
from plant_src.environment.sea import CALM, Sea
from plant_src.vehicles.common.interface import MAX_WAVE_COMPONENTS

casadi = pytest.importorskip("casadi")

STATES = 1000
SHORT_CRESTED = {
    "seed": 5,
    "waves": {
        "significant_height": 0.3,
        "peak_period": 2.0,
        "direction": 0.7,
        "spreading": 4,
        "components": 9,
    },
}


def rate_function(model: Any, given: Mapping[str, Any]) -> tuple[Any, list[str]]:
    """Return the function from state and inputs to the rate, and the names of the inputs."""
    parameters = np.concatenate(
        [
            np.ravel(given.get(v.name, v.start))
            for v in model.variables
            if v.causality == "parameter"
        ]
    )
    constants = casadi.evalf(model.derived_parameters(casadi.SX(parameters)))
    names = [variable.name for variable in model.elements("input")]
    state, inputs = casadi.SX.sym("x", len(model.states)), casadi.SX.sym("u", len(names))
    return casadi.Function(
        "rate", [state, inputs], [model.derivatives(state, inputs, casadi.SX(constants))]
    ), names


def random_catamaran(random: np.random.Generator, realisation: Sea) -> Catamaran:
    thrust, rudder, *current = random.uniform([-3, -0.6, -0.5, -0.5], [3, 0.6, 0.5, 0.5])
    return Catamaran(realisation, thrust, rudder, tuple(current), tuple(random.uniform(-5, 5, 3)))


def inputs_of(reference: Catamaran, names: list[str]) -> list[float]:
    values = dict.fromkeys(names, 0.0) | {
        "thrust": reference.thrust,
        "rudder_angle": reference.rudder,
    }
    values |= {"wave_gain": 1.0} if "wave_gain" in names else {}
    values |= {f"wind.{axis}": value for axis, value in zip("xyz", reference.wind, strict=True)}
    values |= {
        f"current.{axis}": value for axis, value in zip("xy", reference.current, strict=True)
    }
    return list(values.values())


def waves(realisation: Sea) -> dict[str, list[float]]:
    """Parameters of the equations for a sea."""
    count = len(realisation.phase)
    padding = [0.0] * (MAX_WAVE_COMPONENTS - count)
    rows = {
        name: [*getattr(realisation, name), *padding]
        for name in ("amplitude", "frequency", "direction", "phase")
    }
    return {
        "wave.count": [float(count)],
        **{f"wave.{name}": values for name, values in rows.items()},
    }


@pytest.mark.parametrize("hull", ["default", "paper"])
def test_planar_catamaran_at_random_states(hull: str, measured: MeasurementCheck) -> None:
    from plant_src.vehicles.strider import equations

    parameters = dict.fromkeys(["resistance", "propeller_diameter"], 0.0) if hull == "paper" else {}
    rate, names = rate_function(equations.model(), parameters)
    random, worst = np.random.default_rng(4), []
    for _ in range(STATES):
        yaw, nu = random.uniform(-3, 3), random.uniform(-2, 2, 3)
        reference = random_catamaran(random, CALM)
        reference.drag, reference.race = float(not parameters), not parameters
        found = rate([0, 0, yaw, *nu], inputs_of(reference, names)).full().ravel()[3:6]
        turn = np.array([[np.cos(yaw), np.sin(yaw)], [-np.sin(yaw), np.cos(yaw)]])
        u, v = nu[:2] - turn @ reference.current
        air = [*(nu[:2] - turn @ reference.wind[:2]), 0.0]
        loads = reference.loads(np.array([u, v, 0, 0, 0, nu[2]]), np.zeros(3)) + reference.driving(
            np.array(air)
        )
        expected = loads[[0, 1, 5]] / [4.11, 4.11, 0.6391] + [nu[1] * nu[2], -nu[0] * nu[2], 0]
        worst.append(np.abs(found - expected).max() / np.linalg.norm(expected))
    measured(
        "Strider, planar",
        "accelerations at 1000 random states",
        worst,
        0.0,
        "1",
        "equations a second time in NumPy",
        within=1e-12,
        case=hull,
    )


def test_catamaran_at_random_states(measured: MeasurementCheck) -> None:
    """Half of the states lie in all attitudes and up to 0.3 m above or below the water, the others
    near the rest.
    """
    from plant_src.vehicles.strider_6dof import equations

    realisation = sea(SHORT_CRESTED)
    rate, names = rate_function(equations.VESSEL.create_continuous_model(), waves(realisation))
    random, worst, emerged = np.random.default_rng(3), [], 0
    for k in range(STATES):
        tilt = np.pi if k % 2 else 0.05
        turned = Rotation.from_euler(
            "ZYX", [random.uniform(-3, 3), *random.uniform(-tilt, tilt, 2)]
        )
        place = [
            *random.uniform(-5, 5, 2),
            0.1245 + random.uniform(-0.3, 0.3) * (1 if k % 2 else 0.1),
        ]
        nu, time = random.uniform(-1, 1, 6), random.uniform(0, 60)
        reference = random_catamaran(random, realisation)
        x, y, z, w = turned.as_quat()
        found = (
            rate([*place, w, x, y, z, *nu, time], inputs_of(reference, names)).full().ravel()[7:13]
        )
        matrix = turned.as_matrix()
        expected = reference.rate(time, np.concatenate([place, matrix.ravel(), nu]))[12:]
        worst.append(np.abs(found - expected).max() / np.linalg.norm(expected))
        emerged += reference.buoyancy(matrix, place[2], np.zeros(10))[1] < 0.99
    assert emerged > STATES / 4
    measured(
        "Strider, six degrees of freedom",
        "accelerations at 1000 random states, hulls emerged in a part of them",
        worst,
        0.0,
        "1",
        "equations a second time in NumPy",
        within=1e-12,
    )
