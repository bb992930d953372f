"""Warnings about vehicle files: mostly wrong units, but also rotors and propellers that do nothing useful."""

from __future__ import annotations

import copy
import json
import logging
from collections.abc import Callable
from typing import Any

import pytest

from cosim.core import resources
from plant_src.catalogue import MODELS, model_from_data
from plant_src.vehicle_files.plausibility import vehicle_warnings
from plant_src.world import World

DATA = {
    name: json.loads((resources.root() / f"plant_src/vehicles/data/{name}.json").read_text())
    for name in ("x500", "blueboat", "cybership2", "bluerov2_heavy")
}


def warnings_of(name: str, change: Callable[[dict[str, Any]], Any]) -> list[str]:
    change(data := copy.deepcopy(DATA[name]))
    return list(vehicle_warnings(model_from_data(data, name)))


def test_shipped_vehicles_have_no_warning() -> None:
    assert {model.name: found for model in MODELS.values() if (found := list(vehicle_warnings(model)))} == {}


def rotors(**changes: Any) -> Callable[[dict[str, Any]], Any]:
    return lambda data: [rotor.update(changes) for rotor in data["rotors"]]


MISTAKES: list[tuple[str, Callable[[dict[str, Any]], Any], str]] = [
    ("x500", lambda d: d.update(mass=0.02, inertia=[2e-4, 2e-4, 4e-4]), "mass: thrust over weight is 174, expected less than 30"),
    (
        "x500",
        lambda d: d.update(inertia=[24, 24, 44]),
        "inertia: the radius of gyration, the square root of inertia over mass",
    ),
    ("x500", lambda d: d["rotors"][1].update(position=[174, 174, 60]), "rotors[1].position: 253.3 m from the centre of mass"),
    ("x500", lambda d: d["boxes"][0].update(size=[400, 400, 200]), "boxes: a corner is"),
    ("x500", rotors(turns="clockwise"), "rotors: all turn the vehicle about z in the same direction"),
    ("blueboat", lambda d: d["hull"].update(length=1200), "hull.length: found 1200 m, expected less than 500 m"),
    (
        "blueboat",
        lambda d: d.update(visual={"vertices": [[0, 0, 0], [4800, 0, 0], [0, 300, 0]], "faces": [[0, 1, 2]]}),
        "visual: 4800 m long, but the vessel floats by hull.length = 1.04 m",
    ),
    ("blueboat", lambda d: d.update(boxes=[{"size": [5, 1, 0.4], "position": [0, 0, 0]}]), "boxes: 5 m long"),
    ("blueboat", lambda d: d.update(inertia=[1200, 3000, 4000]), "inertia: the radius of gyration"),
    ("cybership2", lambda d: d.update(yaw_inertia=1760), "yaw_inertia: the radius of gyration"),
    (
        "blueboat",
        lambda d: d.update(mass=39.68),
        "mass: found 39.68 kg, but the draught of 0.09745 m (hull.bottom with a minus sign) displaces 18 kg of water: "
        "is the mass in lb?",
    ),
    ("blueboat", lambda d: d.update(mass=9), "mass: found 9 kg, but the draught of 0.09745 m"),
    (
        "bluerov2_heavy",
        lambda d: d.update(mass=29.8),
        "mass: found 29.8 kg, but the displaced_volume of 0.0134 m3 displaces",
    ),
    ("bluerov2_heavy", lambda d: d.update(inertia=[210, 245, 245]), "inertia: the radius of gyration"),
]


@pytest.mark.parametrize(("name", "change", "text"), MISTAKES)
def test_a_probable_mistake_is_named(name: str, change: Callable[[dict[str, Any]], Any], text: str) -> None:
    assert [found for found in warnings_of(name, change) if found.startswith(text)]


def test_one_rotor_upside_down() -> None:
    def overturn(data: dict[str, Any]) -> None:
        data["rotors"][0]["axis"] = [0, 0, -1]
        data["rotor"]["max_speed"] = 2000

    assert "rotors[0].axis: the rotor pushes downwards" in warnings_of("x500", overturn)


def test_propellers_and_origin_above_the_water() -> None:
    """A boat that floats 0.2 m above its origin: propellers at 0.5 m are dry, those at 0.1 m are not."""

    def raised(data: dict[str, Any]) -> None:
        data["hull"]["bottom"] = 0.1
        data["propeller"] = {**data.get("propeller", {}), "radius": 0.05}
        for propeller, height in zip(data["propellers"], (0.5, 0.1), strict=True):
            propeller["position"] = [-0.5, 0.3, height]

    found = warnings_of("blueboat", raised)
    assert [text.partition(":")[0] for text in found] == ["hull.bottom", "propellers[0].position"]


def test_the_world_logs_the_warning(caplog: pytest.LogCaptureFixture) -> None:
    rotors(turns="clockwise")(data := copy.deepcopy(DATA["x500"]))
    with caplog.at_level(logging.WARNING, "cosim.component"):
        World("plant", {"uav": {"model": data, "position": [0, 0, 2]}}).free()
    assert "uav: rotors: all turn the vehicle about z in the same direction" in caplog.text
