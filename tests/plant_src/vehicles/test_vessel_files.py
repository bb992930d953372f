"""Vessels that are given by JSON files: the Strider as data moves like the Strider, and impossible
vessels are refused.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from strider_data import floating_strider, planar_strider
from world_harness import WorldHarness

import cosim
from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.catalogue import model_from_data
from plant_src.world import World

OTTER = json.loads((resources.root() / "plant_src/vehicles/otter/otter.json").read_text())
ROUGH = {
    "seed": 3,
    "waves": {"significant_height": 0.1, "peak_period": 2.0},
    "wind": {"velocity": [2, -1, 0]},
    "current": {"velocity": [0.1, 0.05]},
}
MOTION = [
    *(f"position.{axis}" for axis in "xyz"),
    *(f"attitude.{axis}" for axis in ("roll", "pitch", "yaw")),
    "rates.r",
]


@pytest.mark.parametrize(
    ("motion", "data"), [("planar", planar_strider()), ("6dof", floating_strider())]
)
def test_the_strider_as_data_moves_like_the_strider(motion: str, data: dict[str, Any]) -> None:
    """60 s with waves, wind, current, changing thrust and rudder: only the rounding differs."""
    place = {"position": [0, 0], "yaw": 0.3}
    settings = {
        "own": {"model": "strider", "motion": motion, "hull": "paper", **place},
        "data": {"model": data, **place},
    }
    trials = {
        name: WorldHarness({"usv": vessel}, environment=ROUGH) for name, vessel in settings.items()
    }
    for k in range(60):
        thrust, rudder = ((8 + round(3 * np.sin(k))) / 8) ** 2, 0.5 * np.sin(0.3 * k)
        trials["own"]["usv.thrust"], trials["own"]["usv.rudder_angle"] = thrust, rudder
        trials["data"]["usv.propeller_speed"], trials["data"]["usv.rudder_angle"] = (
            [thrust**0.5],
            [rudder],
        )
        motions = []
        for trial in trials.values():
            trial.step(100)
            motions.append([trial[f"usv.{name}"] for name in MOTION])
        own, other = motions
        assert other == pytest.approx(own, abs=1e-9)
    assert np.hypot(*own[:2]) > 5
    assert not trials["own"]["usv.crashed"]


def test_the_otter_as_data_runs_as_fast_as_the_otter() -> None:
    trial = WorldHarness({"usv": {"model": OTTER, "position": [0, 0]}})
    trial["usv.propeller_speed"] = [100.0, 100.0]
    assert trial.step(3000)["usv.velocity_body.u"] == pytest.approx(
        2.85735, rel=2e-3
    )  # golden value of MSS


def test_a_steered_thruster_pushes_along_its_azimuth() -> None:
    data = copy.deepcopy(OTTER)
    data["propellers"] = [
        {
            "label": "bow",
            "position": [0.8, 0, -0.1],
            "thrust_coefficient": 0.01,
            "max_speed": 90,
            "max_azimuth": 2.0,
        }
    ]
    trial = WorldHarness({"usv": {"model": data, "position": [0, 0]}})
    trial["usv.propeller_speed"], trial["usv.azimuth"] = [60.0], [np.pi / 2]
    trial.step(50)
    assert trial["usv.velocity_body.v"] > 0.01  # to port
    assert trial["usv.rates.r"] > 0.01  # bow to port
    assert abs(trial["usv.velocity_body.u"]) < 0.01


def changed(change: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    data = copy.deepcopy(OTTER)
    change(data)
    return data


def coupled(sway_by_yaw: float, yaw_by_sway: float) -> list[list[float]]:
    """Added mass with 80 in sway and yaw that the elements outside of the diagonal couple."""
    matrix = np.diag([5.0, 80.0, 55.0, 2.0, 11.0, 80.0])
    matrix[1, 5], matrix[5, 1] = sway_by_yaw, yaw_by_sway
    return matrix.tolist()


FAULTS: list[tuple[Callable[[dict[str, Any]], Any], str]] = [
    (lambda d: d.pop("hull"), r'model: "hull" is missing'),
    (
        lambda d: d["hull"].update(count=3),
        r"model\.hull\.count: found 3, expected an integer from 1 to 2",
    ),
    (lambda d: d["hull"].pop("offset"), r'model\.hull: "offset" is missing'),
    (
        lambda d: d.update(mass=900),
        (
            r"model\.hull\.depth: found 0\.345: the vessel sinks, because its draught at rest is "
            r"1\.171 m"
        ),
    ),
    (
        lambda d: d.update(centre_of_mass=[0.15, 0, 9]),
        r"model\.centre_of_mass: found z = 9 m: the vessel is not stable: its metacentric heights "
        r".* m, expected > 0: "
        r"z must be below 1\.\d+ m, or hull\.transverse_moment \(beam, offset\) larger",
    ),
    (
        lambda d: d.update(centre_of_mass=[4, 0, 0]),
        r"model\.centre_of_mass: found 3\.8469 m ahead of .*: the vessel capsizes",
    ),
    (lambda d: d.update(added_mass=[-1] * 6), r"model\.added_mass: found the eigenvalue -1"),
    (
        lambda d: d.update(added_mass=[5, 80, 55, 2, -0.5, 24]),
        r"model\.added_mass: found the eigenvalue -0\.5, expected none below 0",
    ),
    (
        lambda d: d.update(added_mass=coupled(85.0, 85.0)),
        r"model\.added_mass: found the eigenvalue -5, expected none below 0",
    ),
    (
        lambda d: d.update(added_mass=coupled(10.0, 9.0)),
        r"model\.added_mass: expected a symmetric matrix",
    ),
    (
        lambda d: d.update(coriolis_added_mass=coupled(10.0, 9.0)),
        r"model\.coriolis_added_mass: expected a symmetric matrix",
    ),
    (
        lambda d: d.update(linear_damping=[-1] + [0] * 5),
        r"model\.linear_damping: found the diagonal",
    ),
    (lambda d: d["hull"].update(offset=0.1), r"model\.hull\.offset: found 0\.1: the hulls overlap"),
    (
        lambda d: d["hull"].update(transverse_moment=2),
        r"model\.hull\.transverse_moment: found 2, expected at most 0\.",
    ),
    (
        lambda d: d["propeller"].update(max_speed=0),
        r"model\.propeller\.max_speed: found 0, expected a number greater than 0",
    ),
    (lambda d: d["propellers"][0].pop("position"), r'model\.propellers\.0: "position" is missing'),
    (
        lambda d: d["propeller"].pop("max_speed"),
        r'model\.propellers\.0: "max_speed" is missing, here and in "propeller"',
    ),
    (
        lambda d: d["propeller"].update(time_constant=1e-3),
        r"model\.propeller\.time_constant: found 0\.001, expected 0 \(no lag\)",
    ),
    (
        lambda d: d.update(propellers=d["propellers"] * 9),
        r"model\.propellers: found 18, expected 1 to 16",
    ),
    (
        lambda d: d.update(rudders=[{"position": [-1, 0, 0], "area": 0.01, "propeller": 3}]),
        r"model\.rudders\.0\.propeller: found 3, expected the number of a propeller, 1 to 2",
    ),
    (
        lambda d: d.update(rudders=[{"position": [-1, 0, 0], "area": 0}]),
        r"model\.rudders\.0\.area: found 0, expected a number greater",
    ),
]


@pytest.mark.parametrize("coupling", [79.9, 80.0])
def test_added_mass_may_be_coupled_and_singular(coupling: float) -> None:
    data = changed(lambda d: d.update(added_mass=coupled(coupling, coupling)))
    boat = model_from_data(data).boat
    assert boat is not None
    assert boat.added_mass[1, 5] == coupling


@pytest.mark.parametrize(("change", "text"), FAULTS)
def test_an_impossible_vessel_is_refused_with_its_path(
    change: Callable[[dict[str, Any]], Any], text: str
) -> None:
    with pytest.raises(InputError, match=text) as caught:
        World("plant", {"usv": {"model": changed(change), "position": [0, 0]}})
    assert all(str(problem).startswith("vehicles.usv.model") for problem in caught.value.problems)


@pytest.mark.parametrize(
    ("path", "key"),
    [
        ((), "mass"),
        ((), "hull"),
        (("hull",), "length"),
        (("propellers", 0), "position"),
        (("propeller",), "max_speed"),
    ],
)
def test_a_misspelt_key_is_one_problem(path: tuple[str | int, ...], key: str) -> None:
    def misspell(data: Any) -> None:
        for each in path:
            data = data[each]
        data[key[:-1]] = data.pop(key)

    with pytest.raises(InputError) as caught:
        model_from_data(changed(misspell))
    place = ".".join(map(str, (*path, key[:-1])))
    assert list(map(str, caught.value.problems)) == [
        f'{place}: unknown key "{key[:-1]}"; did you mean "{key}"?'
    ]


def test_a_parameter_of_a_scenario_replaces_a_value_of_the_file() -> None:
    settings = {
        "model": OTTER,
        "position": [0, 0],
        "parameters": {"mass": 70.0, "propeller_time_constant": [0.2, 0.2]},
    }
    trial = WorldHarness({"usv": settings})
    assert trial["usv.mass"] == 70.0
    low = (
        WorldHarness({"usv": {"model": OTTER, "position": [0, 0]}})["usv.position.z"]
        - trial["usv.position.z"]
    )
    assert low == pytest.approx(
        (70 - model_from_data(OTTER).body.mass) / 1025 / 0.75, rel=0.02
    )  # it floats deeper


def test_a_scenario_names_the_file_of_a_boat(tmp_path: Path) -> None:
    (tmp_path / "my_boat.json").write_text(json.dumps(OTTER))
    plant = {
        "python": f"{resources.root()}/plant_src/world.py:World",
        "arguments": {"vehicles": {"usv": {"model": "my_boat.json", "position": [0, 0]}}},
    }
    scenario = {"name": "boat", "stop_time": 1.0, "step_size": 0.01, "components": {"plant": plant}}
    scenario["events"] = [{"time": 0.0, "set": {"plant.usv.propeller_speed": [50.0, 50.0]}}]
    (file := tmp_path / "run.json").write_text(json.dumps(scenario))
    assert cosim.run(file)["plant.usv.velocity_body.u"][-1] > 0.2
