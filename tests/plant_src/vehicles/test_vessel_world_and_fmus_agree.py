"""Vessels in a world and as plant FMUs of both FMI versions agree, in waves, wind and current."""

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
from plant_src.environment import sea

UNITS = "m, 1, m/s, rad/s"
WATERS = {
    "seed": 1,
    "waves": {"significant_height": 0.1, "peak_period": 2.0, "spreading": 2},
    "wind": {"velocity": [3.0, -2.0, 0.0]},
    "current": {"velocity": [0.2, 0.1]},
}
ENVIRONMENT_VALUES = {
    "wind.x": 3.0,
    "wind.y": -2.0,
    "wind.z": 0.0,
    "current.x": 0.2,
    "current.y": 0.1,
}
START = {
    "initial.position.x": 1.0,
    "initial.position.y": 2.0,
    "initial.yaw": 0.5,
    "initial.velocity_body.u": 0.4,
}
VESSELS: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "strider": ({"model": "strider"}, {"thrust": 1.0, "rudder_angle": 0.1}),
    "strider_6dof": ({"model": "strider", "motion": "6dof"}, {"thrust": 1.0, "rudder_angle": 0.1}),
    "otter": (
        {"model": "otter", "parameters": {"payload_mass": 10.0}},
        {"propeller_speed": [80.0, 60.0]},
    ),
    "otter_mss": (
        {"model": "otter_mss", "parameters": {"payload_mass": 10.0}},
        {"propeller_speed": [80.0, 60.0]},
    ),
}
MOTION = [
    *(f"position.{axis}" for axis in "xyz"),
    *(f"orientation.{axis}" for axis in "wxyz"),
    *(f"velocity.{axis}" for axis in "xyz"),
    *(f"rates.{axis}" for axis in "pqr"),
    *(f"deck.position.{axis}" for axis in "xyz"),
]


def scalars(values: dict[str, Any]) -> dict[str, float]:
    """Replace lists by scalars "name[1]", "name[2]"."""
    scalar = dict[str, float]()
    for name, value in values.items():
        if isinstance(value, list):
            scalar |= {f"{name}[{k}]": x for k, x in enumerate(value, 1)}
        else:
            scalar[name] = value
    return scalar


def parameters(model: str) -> dict[str, Any]:
    """Return the environment inputs that the world's environment gives, and the initial state."""
    vehicle, inputs = VESSELS[model]
    waves = sea(WATERS)
    arrays = {
        name: getattr(waves, name).tolist()
        for name in ("amplitude", "frequency", "direction", "phase")
    }
    table = {
        "wave.count": float(len(waves.amplitude)),
        **{f"wave.{name}": values for name, values in arrays.items()},
    }
    return {
        **START,
        **ENVIRONMENT_VALUES,
        **inputs,
        **vehicle.get("parameters", {}),
        **(table if model != "strider" else {}),
    }


def scenario(model: str) -> dict[str, Any]:
    """The same voyage in the world and on FMUs of versions 2.0 and 3.0."""
    vehicle, inputs = VESSELS[model]
    vehicle = {**vehicle, "position": [1.0, 2.0], "yaw": 0.5, "velocity_body": [0.4, 0.0, 0.0]}
    environment = (
        WATERS if model != "strider" else {name: WATERS[name] for name in ("wind", "current")}
    )
    root = resources.root()
    world = {
        "python": f"{root}/plant_src/world.py:World",
        "arguments": {"vehicles": {"usv": vehicle}, "environment": environment},
    }
    return {
        "name": "doors",
        "stop_time": 5.0,
        "step_size": 0.01,
        "components": {
            "world": {
                **world,
                "parameters": {f"usv.{name}": value for name, value in inputs.items()},
            },
            "two": {"fmu": f"{root}/fmus/{model}.fmu", "parameters": parameters(model)},
            "three": {"fmu": f"{root}/fmus/fmi3/{model}.fmu", "parameters": parameters(model)},
        },
    }


@pytest.mark.parametrize("model", VESSELS)
def test_world_and_fmus_of_both_versions_agree(
    model: str, tmp_path: Path, measured: MeasurementCheck
) -> None:
    (file := tmp_path / "doors.json").write_text(json.dumps(scenario(model)))
    result = cosim.run(file)
    alone = PlantFmu(model, scalars(parameters(model)))
    alone.step(0.01, 500)
    for name in MOTION:
        two, three, world = (
            result[f"{component}.{name}"] for component in ("two", "three", "world.usv")
        )
        assert two[-1] == alone.get(name)[0]
        measured(
            "World and plant FMUs",
            "vessel, FMI 3.0",
            three - two,
            0.0,
            UNITS,
            "its FMI 2.0 FMU",
            case=model,
        )
        measured(
            "World and plant FMUs",
            "vessel, world",
            world - two,
            0.0,
            UNITS,
            "its FMI 2.0 FMU",
            within=1e-12,
            case=model,
        )
    assert np.ptp(result["two.position.x"]) > 1
