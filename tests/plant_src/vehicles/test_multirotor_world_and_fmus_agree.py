"""Multirotors in a world and as plant FMUs of both FMI versions agree, with all effects."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck

import cosim
from cosim.core import resources

ROTORS = {"ar_drone": 4, "crazyflie": 4, "survey_hexacopter": 6}
HOVER = {"ar_drone": 345.0, "crazyflie": 1728.0, "survey_hexacopter": 387.0}
WIND = (3.0, -2.0, 0.5)
EFFECTS = {
    "rotor_time_constant": 0.04,
    "rotor_inertia": 1e-7,
    "rotor_drag.x": 1e-6,
    "rotor_drag.y": 2e-6,
    "rotor_drag.z": 1e-6,
    "body_drag.x": 0.002,
    "body_drag.y": 0.001,
    "body_drag.z": 0.003,
    "ground_effect": 0.0,
}
MOTION = [
    *(f"position.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
    *(f"rates.{axis}" for axis in "pqr"),
]


def parameters(model: str) -> dict[str, float]:
    return {**EFFECTS, "initial_rotor_speed": HOVER[model]}


def commands(model: str, k: int) -> list[float]:
    """Rotor speeds in second k."""
    random = np.random.default_rng(k)
    return (HOVER[model] * (1 + 2e-3 * random.standard_normal(ROTORS[model]))).tolist()


def scalars(speeds: list[float]) -> dict[str, float]:
    return {f"rotor_speed[{number}]": speed for number, speed in enumerate(speeds, 1)}


def scenario(model: str, wind: dict[str, float]) -> dict[str, Any]:
    """The same flight in the world and on FMUs of versions 2.0 and 3.0."""
    start = {
        **parameters(model),
        "initial.position.z": 50.0,
        "initial.velocity_body.u": 1.0,
        **wind,
    }
    vehicle = {
        "model": model,
        "position": [0, 0, 50],
        "velocity_body": [1, 0, 0],
        "parameters": parameters(model),
    }
    plant = {"vehicles": {"uav": vehicle}, "environment": {"wind": {"velocity": list(WIND)}}}
    root = resources.root()
    events = []
    for k in range(4):
        arrays = dict.fromkeys(("world.uav.rotor_speed", "three.rotor_speed"), commands(model, k))
        events.append(
            {
                "time": k,
                "set": arrays
                | {f"two.{name}": speed for name, speed in scalars(commands(model, k)).items()},
            }
        )
    return {
        "name": "doors",
        "stop_time": 4.0,
        "step_size": 0.01,
        "components": {
            "world": {"python": f"{root}/plant_src/world.py:World", "arguments": plant},
            "two": {"fmu": f"{root}/fmus/{model}.fmu", "parameters": start},
            "three": {"fmu": f"{root}/fmus/fmi3/{model}.fmu", "parameters": start},
        },
        "events": events,
    }


@pytest.mark.parametrize("model", ROTORS)
def test_world_and_fmus_of_both_versions_agree(
    model: str, tmp_path: Path, measured: MeasurementCheck
) -> None:
    wind = dict(zip(("wind.x", "wind.y", "wind.z"), WIND, strict=True))
    (file := tmp_path / "doors.json").write_text(json.dumps(scenario(model, wind)))
    result = cosim.run(file)
    alone = PlantFmu(
        model,
        {**parameters(model), "initial.position.z": 50.0, "initial.velocity_body.u": 1.0, **wind},
    )
    for k in range(4):
        alone.set(scalars(commands(model, k)))
        alone.step(0.01, 100)
    for name in MOTION:
        two, three, world = (
            result[f"{component}.{name}"] for component in ("two", "three", "world.uav")
        )
        assert two[-1] == alone.get(name)[0]
        measured(
            "World and plant FMUs",
            "multirotor, FMI 3.0",
            three - two,
            0.0,
            "m, 1, rad/s",
            "its FMI 2.0 FMU",
            case=model,
        )
        error = world - two
        measured(
            "World and plant FMUs",
            "multirotor in wind, world",
            error,
            0.0,
            "m, 1, rad/s",
            "its FMI 2.0 FMU",
            within=1e-10,
            case=model,
        )
    assert np.ptp(result["two.position.x"]) > 1


def test_wind_matters(tmp_path: Path) -> None:
    calm = {"wind.x": 0.0, "wind.y": 0.0, "wind.z": 0.0}
    (file := tmp_path / "doors.json").write_text(json.dumps(scenario("crazyflie", calm)))
    result = cosim.run(file)
    assert abs(result["world.uav.position.x"][-1] - result["two.position.x"][-1]) > 0.1
