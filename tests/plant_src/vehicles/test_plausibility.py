"""Warnings about vehicle files: mostly wrong units, but also rotors and propellers that do nothing
useful.
"""

from __future__ import annotations

import copy
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from cosim.core import resources
from cosim.scenario import load
from plant_src.catalogue import MODELS, model_from_data

DATA = {
    name: json.loads((resources.root() / f"plant_src/vehicles/data/{name}.json").read_text())
    for name in ("x500", "blueboat", "cybership2", "bluerov2_heavy")
}


def warnings_of(name: str, change: Callable[[dict[str, Any]], Any]) -> list[str]:
    change(data := copy.deepcopy(DATA[name]))
    return [
        f"{'.'.join(each.subject[1:])}: {each.message}"
        for each in model_from_data(data, name).warnings()
    ]


def test_shipped_vehicles_have_no_warning() -> None:
    for model in MODELS.values():
        assert list(model.warnings()) == [], model.name


def rotors(**changes: Any) -> Callable[[dict[str, Any]], Any]:
    return lambda data: [rotor.update(changes) for rotor in data["rotors"]]


def every_propeller(**factors: float) -> Callable[[dict[str, Any]], Any]:
    """Return a function that multiplies keys of all propellers."""

    def change(data: dict[str, Any]) -> None:
        for part in (data.get("propeller", {}), *data["propellers"]):
            part.update(
                {key: _value(part[key]) * factor for key, factor in factors.items() if key in part}
            )

    return change


def _value(quantity: Any) -> float:
    return float(quantity["value"] if isinstance(quantity, dict) else quantity)


MISTAKES: list[tuple[str, Callable[[dict[str, Any]], Any], str]] = [
    (
        "x500",
        lambda d: d.update(mass=0.02, inertia=[2e-4, 2e-4, 4e-4]),
        "mass: thrust over weight is 174, expected less than 30",
    ),
    (
        "x500",
        lambda d: d.update(inertia=[24, 24, 44]),
        "inertia: the radius of gyration, the square root of inertia over mass",
    ),
    (
        "x500",
        lambda d: d["rotors"][1].update(position=[174, 174, 60]),
        "rotors.1.position: 253.3 m from the centre of mass",
    ),
    ("x500", lambda d: d["boxes"][0].update(size=[400, 400, 200]), "boxes: a corner is"),
    (
        "x500",
        rotors(turns="clockwise"),
        "rotors: all turn the vehicle about z in the same direction",
    ),
    (
        "blueboat",
        lambda d: d["hull"].update(length=1200),
        "hull.length: found 1200 m, expected less than 500 m",
    ),
    (
        "blueboat",
        lambda d: d.update(
            visual={"vertices": [[0, 0, 0], [4800, 0, 0], [0, 300, 0]], "faces": [[0, 1, 2]]}
        ),
        "visual: 4800 m long, but the vessel floats by hull.length = 1.04 m",
    ),
    (
        "blueboat",
        lambda d: d.update(boxes=[{"size": [5, 1, 0.4], "position": [0, 0, 0]}]),
        "boxes: 5 m long",
    ),
    ("blueboat", lambda d: d.update(inertia=[1200, 3000, 4000]), "inertia: the radius of gyration"),
    ("cybership2", lambda d: d.update(yaw_inertia=1760), "yaw_inertia: the radius of gyration"),
    (
        "blueboat",
        lambda d: d.update(mass=39.68),
        "mass: found 39.68 kg, but the draught of 0.09745 m (hull.bottom with a minus sign) "
        "displaces 18 kg of water: "
        "is the mass in lb?",
    ),
    ("blueboat", lambda d: d.update(mass=9), "mass: found 9 kg, but the draught of 0.09745 m"),
    (
        "bluerov2_heavy",
        lambda d: d.update(mass=29.8),
        "mass: found 29.8 kg, but the displaced_volume of 0.0134 m3 displaces",
    ),
    (
        "bluerov2_heavy",
        lambda d: d.update(inertia=[210, 245, 245]),
        "inertia: the radius of gyration",
    ),
    (
        "x500",
        lambda d: d.update(mass=2.9),
        "mass: thrust over weight is 1.2, expected more than 1.3",
    ),
    (
        "x500",
        lambda d: d["rotor"].update(max_speed=9549),
        "rotor.max_speed: thrust over weight is 154",
    ),
    (
        "x500",
        lambda d: d["rotor"].update(thrust_coefficient=8.55e-4),
        "rotor.thrust_coefficient: thrust over weight is 169",
    ),
    (
        "blueboat",
        every_propeller(thrust_coefficient=4.448),
        "propellers.0.thrust_coefficient: the thrust of all propellers",
    ),
    (
        "blueboat",
        every_propeller(thrust_coefficient=9.81),
        "propellers.0.thrust_coefficient: the thrust of all propellers",
    ),
    ("blueboat", every_propeller(max_speed=9.5492966), "propellers.0.m"),
    (
        "blueboat",
        lambda d: d.update(linear_damping=[0] * 6, quadratic_damping=[0] * 6),
        "linear_damping: the water has no",
    ),
    (
        "blueboat",
        lambda d: d["propellers"][1].update(max_azimuth=45),
        "propellers.1.max_azimuth: found 45, radians expected",
    ),
    (
        "bluerov2_heavy",
        lambda d: d["thruster"].update(max_speed=4000),
        "thruster.max_speed: the thrust of all propellers",
    ),
    (
        "bluerov2_heavy",
        lambda d: d["thrusters"][2].update(position=[15, 0, 0]),
        "thrusters.2.position: 15 m from the centre",
    ),
    (
        "blueboat",
        lambda d: d["propellers"][0].update(position=[0, 7.5, 0]),
        "propellers.0.position: y = 7.5 m is far outside",
    ),
    (
        "blueboat",
        lambda d: d["propellers"][0].update(position=[0, 0, -4]),
        "propellers.0.position: z = -4 m is far outside",
    ),
    (
        "cybership2",
        lambda d: d["rudders"][1].update(position=[-54.9, 0, 0]),
        "rudders.1.position: x = -54.9 m is far outside",
    ),
    (
        "blueboat",
        lambda d: d.update(centre_of_mass=[-0.034, 0, 0.6]),
        "centre_of_mass: z = 0.6 m is 0.36 m above hull and boxes",
    ),
]


@pytest.mark.parametrize(("name", "change", "text"), MISTAKES)
def test_a_probable_mistake_is_named(
    name: str, change: Callable[[dict[str, Any]], Any], text: str
) -> None:
    assert [found for found in warnings_of(name, change) if found.startswith(text)]


def test_one_rotor_upside_down() -> None:
    def overturn(data: dict[str, Any]) -> None:
        data["rotors"][0]["axis"] = [0, 0, -1]
        data["rotor"]["max_speed"] = 2000

    assert (
        "rotors.0.axis: the rotor pushes downwards, its thrust points along [0, 0, -1]"
        in warnings_of("x500", overturn)
    )


def test_the_origin_of_a_planar_vessel_does_not_matter() -> None:
    """A vessel of 1.3 m whose data start from a point 5 m behind it has no warning."""

    def moved(data: dict[str, Any]) -> None:
        data["centre_of_mass"] = [5, 0, 0]
        for part in (*data["propellers"], *data["rudders"], *data["boxes"]):
            x, y, z = part.get("position", [0, 0, 0])
            part["position"] = [x + 5, y, z]

    assert warnings_of("cybership2", moved) == []


def test_a_planing_boat_has_no_warning() -> None:
    """A boat of 2 m and 40 kg that planes at 15 m/s: resistance 1/4 of its weight, thrust at rest
    half of it.
    """

    def planing(data: dict[str, Any]) -> None:
        hull = {
            "count": 1,
            "length": 2,
            "beam": 0.5,
            "depth": 0.3,
            "bottom": -0.05,
            "waterplane_coefficient": 0.78,
        }
        data.update(
            hull=hull, mass=40, centre_of_mass=[0, 0, 0.05], inertia=[1.2, 10, 10], rudders=[]
        )
        data.update(added_mass=[2, 10, 80, 0.5, 30, 4], quadratic_damping=[0.44, 0, 0, 0, 0, 0])
        data.update(boxes=[{"size": [2, 0.5, 0.3], "position": [0, 0, 0.1]}])
        propeller = {
            "position": [-1.05, 0, -0.1],
            "thrust_coefficient": 2e-4,
            "max_speed": 1000,
            "advance_coefficient": 0.0065,
        }
        data.update(propeller={"radius": 0.035}, propellers=[propeller])

    assert warnings_of("blueboat", planing) == []


def test_propellers_and_origin_above_the_water() -> None:
    """A boat that floats 0.2 m above its origin: propellers at 0.5 m are dry, those at 0.1 m are
    not.
    """

    def raised(data: dict[str, Any]) -> None:
        data["hull"]["bottom"] = 0.1
        data["propeller"] = {**data.get("propeller", {}), "radius": 0.05}
        for propeller, height in zip(data["propellers"], (0.5, 0.1), strict=True):
            propeller["position"] = [-0.5, 0.3, height]

    found = warnings_of("blueboat", raised)
    assert [text.partition(":")[0] for text in found] == ["hull.bottom", "propellers.0.position"]


def test_a_warning_names_file_and_line_of_the_key(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    data = copy.deepcopy(DATA["blueboat"])
    data["propellers"][1]["position"] = [-22, 0, 0]
    (tmp_path / "boat.json").write_text(text := json.dumps(data, indent=1))
    plant = {
        "python": "cosim:plant_src/world.py:World",
        "arguments": {"vehicles": {"boat": {"model": "boat.json", "position": [0, 0], "yaw": 90}}},
    }
    scenario = {
        "name": "trial",
        "stop_time": 1,
        "step_size": 0.01,
        "components": {"plant": plant},
        "connections": [],
    }
    (tmp_path / "trial.json").write_text(json.dumps(scenario))
    load(tmp_path / "trial.json").free()
    line = text[: text.index("-22")].count("\n")
    message, yaw = caplog.messages
    assert re.search(
        (
            rf"boat.json:{line}:\d+: \$.propellers\[1\].position: x = -22 m is far outside of hull "
            r"and boxes"
        ),
        message,
    )
    assert yaw.endswith(
        "vehicles.boat.yaw: found 90, radians expected; in degrees? A right angle is 1.5708"
    )
    assert "trial.json:1:" in yaw
