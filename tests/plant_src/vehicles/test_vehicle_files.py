"""Vehicles that are given by JSON files: a vehicle of one's own flies, and impossible ones are
refused with their paths.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from world_harness import WorldHarness

import cosim
from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.catalogue import MODELS, model_from_data
from plant_src.world import World

DATA = resources.root() / "plant_src/vehicles/data"
QUADCOPTER = json.loads((DATA / "ar_drone.json").read_text())


def changed(change: Callable[[dict[str, Any]], Any]) -> dict[str, Any]:
    data = copy.deepcopy(QUADCOPTER)
    change(data)
    return data


def coaxial_octocopter() -> dict[str, Any]:
    """Eight rotors at four places; the lower ones are weaker and turn the other way."""
    rotors = []
    for rotor in QUADCOPTER["rotors"]:
        x, y, z = rotor["position"]
        other = {"clockwise": "counter-clockwise", "counter-clockwise": "clockwise"}[rotor["turns"]]
        rotors += [
            rotor,
            {"position": [x, y, z - 0.05], "turns": other, "thrust_coefficient": 7e-6},
        ]
    return changed(lambda data: data.update(rotors=rotors, mass=0.8))


def flight(model: Any, seconds: float, speed: float) -> WorldHarness:
    trial = WorldHarness({"uav": {"model": model, "position": [0.0, 0.0, 50.0]}})
    count = len(trial["uav.rotor_speed"])
    trial["uav.rotor_speed"] = [speed] * count
    return trial.step(round(seconds * 100))


def test_the_data_of_a_shipped_vehicle_fly_like_the_vehicle() -> None:
    assert flight(QUADCOPTER, 0.5, 350.0).bytes == flight("ar_drone", 0.5, 350.0).bytes


def test_eight_rotors_of_two_kinds_lift_with_their_thrust() -> None:
    trial = flight(coaxial_octocopter(), 1.0, 300.0)
    thrust = 4 * (8.24e-6 + 7e-6) * 300.0**2
    assert trial["uav.velocity.z"] == pytest.approx(
        thrust / 0.8 - 9.81, abs=0.05
    )  # it tilts, because the rotors are not centred
    assert trial["uav.rates.r"] == pytest.approx(0.0, abs=0.1)  # the torques of the pairs cancel


def test_units_and_sources_are_optional() -> None:
    plain = changed(lambda data: data.update(mass=0.443892, crash_speed=3.1))
    grams = changed(lambda data: data.update(mass={"value": 443.892, "unit": "g"}))
    assert model_from_data(plain).body.mass == model_from_data(QUADCOPTER).body.mass
    assert model_from_data(grams).body.mass == pytest.approx(0.443892, rel=1e-15)


def test_the_collision_shape_turns_with_yaw() -> None:
    corners = [
        model_from_data(changed(lambda data, yaw=yaw: data["boxes"][0].update(yaw=yaw)))
        .body.boxes[0]
        .corners()
        for yaw in (0.3, 0.3 + np.pi / 2, 0.3 - np.pi)
    ]
    for other in corners[1:]:
        distances = np.linalg.norm(corners[0][:, None] - other[None], axis=2)
        assert distances.min(axis=1) == pytest.approx(np.zeros(8), abs=1e-12)


FAULTS: list[tuple[Callable[[dict[str, Any]], Any], str]] = [
    (lambda d: d.update(mass=0), r"uav\.model\.mass: found 0, expected a number greater than 0"),
    (
        lambda d: d.update(mass={"value": 1, "unit": "m"}),
        r"model\.mass\.unit: found 'm', expected a unit that converts to 'kg', 'g', 't', 'lb'$",
    ),
    (
        lambda d: d["rotor"].update(max_speed={"value": 5000, "unit": "1/min"}),
        r"max_speed\.unit: found '1/min', expected a unit that converts to 'rad/s', 'rpm'",
    ),
    (
        lambda d: d.update(mass={"value": 1, "unit": 3}),
        r"model\.mass\.unit: found 3, expected a unit such as 'kg'",
    ),
    (lambda d: d.pop("inertia"), r'model: "inertia" is missing'),
    (
        lambda d: d.update(inertia=[1, 3, 1.5]),
        (
            r"model\.inertia: found the principal moments 1 about x, 3 about y, 1.5 about z, "
            r"expected none greater than the sum"
        ),
    ),
    (
        lambda d: d["rotor"].update(radus=1),
        r'model\.rotor\.radus: unknown key "radus"; did you mean "radius"\?',
    ),
    (
        lambda d: d["rotors"][1].update(turns="left"),
        r"model\.rotors\.1\.turns: found 'left'; valid: clockwise, counter-clockwise",
    ),
    (
        lambda d: d["rotor"].update(max_speed=100),
        r"model\.mass: it cannot fly: the thrust of all rotors at full",
    ),
    (
        lambda d: d["rotor"].update(drag=[-1, 0, 0]),
        r"model\.rotor\.drag: found \[-1\.0, 0\.0, 0\.0\], expected numbers of at",
    ),
    (
        lambda d: d["rotors"][2].update(axis=[0, 0, 0]),
        r"model\.rotors\.2\.axis: found the zero vector, expected a direction",
    ),
    (
        lambda d: d["rotor"].pop("thrust_coefficient"),
        r'model\.rotors\.0: "thrust_coefficient" is missing, here and in "rotor"',
    ),
    (lambda d: d.update(rotors=d["rotors"] * 5), r"model\.rotors: found 20, expected 1 to 16"),
    (
        lambda d: d.update(rotors=[]),
        r"model\.rotors: found \[\], expected a list with at least one element",
    ),
    (
        lambda d: d["boxes"][0].update(size=[1, 0, 1]),
        r"model\.boxes\.0\.size: .* expected edges greater than 0",
    ),
    (
        lambda d: d["boxes"][0].update(yaw=-90),
        (
            r"model\.boxes\.0\.yaw: found -90, expected a number from -6\.28319 to 6\.28319: "
            r"radians expected; in degrees\? Write {"
        ),
    ),
    (
        lambda d: d["boxes"][0].update(yaw={"value": 400, "unit": "deg"}),
        r"yaw: found 6\.98\d*, expected .* to 6\.28319$",
    ),
    (
        lambda d: d.update(family="multirotr"),
        r'model\.family: found \'multirotr\'; did you mean "multirotor"\?',
    ),
    (
        lambda d: d.update(crash_speed="fast"),
        r"model\.crash_speed: found 'fast', expected a finite number",
    ),
]


@pytest.mark.parametrize(("change", "text"), FAULTS)
def test_an_impossible_vehicle_is_refused_with_its_path(
    change: Callable[[dict[str, Any]], Any], text: str
) -> None:
    with pytest.raises(InputError, match=text) as caught:
        World("plant", {"uav": {"model": changed(change), "position": [0, 0, 2]}})
    assert all(str(problem).startswith("vehicles.uav.model") for problem in caught.value.problems)


def test_a_scenario_names_the_file_of_a_vehicle(tmp_path: Path) -> None:
    (tmp_path / "heavy.json").write_text(
        json.dumps(changed(lambda data: data.update(mass=0.5)), indent=1)
    )
    vehicles = {"uav": {"model": "heavy.json"}}
    scenario = {
        "name": "heavy",
        "extends": "demo1_box",
        "components": {"plant": {"arguments": {"vehicles": vehicles}}},
    }
    (file := tmp_path / "heavy_flight.json").write_text(json.dumps(scenario))
    with cosim.load(file) as simulation:
        assert simulation.get("plant.uav.mass") == 0.5
    pointer = "/components/plant/arguments/vehicles/uav/model/mass"
    with cosim.load(file, parameters={pointer: 0.47}) as simulation:
        assert simulation.get("plant.uav.mass") == 0.47
    with pytest.raises(InputError, match=r'setting ".*/model/mass": found -1'):
        cosim.load(file, parameters={pointer: -1})


def test_problems_name_file_and_line_of_the_vehicle(tmp_path: Path) -> None:
    wrong = changed(lambda data: data["rotors"][2].update(turns="sideways"))
    (tmp_path / "wrong.json").write_text(text := json.dumps(wrong, indent=1))
    line = 1 + text[: text.index('"sideways"')].count("\n")
    vehicles = {"uav": {"model": "wrong.json"}}
    scenario = {
        "name": "wrong",
        "extends": "demo1_box",
        "components": {"plant": {"arguments": {"vehicles": vehicles}}},
    }
    (file := tmp_path / "flight.json").write_text(json.dumps(scenario))
    with pytest.raises(
        InputError, match=rf"wrong\.json:{line}:\d+: \$\.rotors\[2\]\.turns: found 'sideways'"
    ):
        cosim.load(file)


def test_every_shipped_file_states_its_sources() -> None:
    for file in DATA.glob("*.json"):
        data = json.loads(file.read_text())
        assert {"description", "validity", "sources"} <= data.keys()
        assert file.stem in MODELS
