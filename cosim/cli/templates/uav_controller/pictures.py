"""Figure of a run, and the vehicles in its 3-D replay."""

import math
from typing import Any

from matplotlib.figure import Figure

from cosim.results import Result

ARM = 0.1815  # m, from the centre of mass to a rotor
HULL = {
    "orientation": [0, math.sqrt(0.5), 0, math.sqrt(0.5)],
    "colour": [0.9, 0.7, 0.1],
}  # along x, yellow
DARK, RED = [0.15, 0.15, 0.17], [0.8, 0.2, 0.15]


def track(result: Result, followed: str, vehicle: str) -> Figure:
    """Draw the tracks seen from above (m), and the altitude of `vehicle` (m) over time (s)."""
    figure = Figure(layout="constrained", figsize=(8, 4))
    plan, height = figure.subplots(1, 2)
    for name, style in ((followed, "--"), (vehicle, "-")):
        plan.plot(result[f"{name}.position.x"], result[f"{name}.position.y"], style, label=name)
    plan.set(xlabel="east / m", ylabel="north / m", aspect="equal")
    figure.legend(loc="outside upper center", ncols=2)
    height.plot(result.time, result[f"{vehicle}.position.z"])
    height.set(xlabel="time / s", ylabel="altitude / m")
    return figure


def scene(scenario: dict[str, Any], vehicle: str, vessel: str) -> dict[str, Any]:
    """Return the scene: a quadcopter and a catamaran on calm water.

    Lengths in m, body frames x forward, y to port, z up.
    """
    heights = [[f"{vehicle}.position.z", f"{vessel}.deck.position.z"]]
    return {
        "bodies": [
            body(vehicle, "#0072b2", quadcopter_parts()),
            body(vessel, "#d55e00", catamaran_parts()),
        ],
        "water": {"waves": [], "gain": 1},
        "plots": [
            *heights,
            [f"{vehicle}.velocity.*"],
            [f"{vehicle}.attitude.*"],
            ["uav.rotor_speed*"],
        ],
    }


def body(name: str, colour: str, parts: list[dict[str, Any]]) -> dict[str, Any]:
    """Return a body of the scene that has the recorded position and orientation of a component."""
    position = [f"{name}.position.{axis}" for axis in "xyz"]
    orientation = [f"{name}.orientation.{part}" for part in "wxyz"]
    return {
        "name": name,
        "colour": colour,
        "position": position,
        "orientation": orientation,
        "parts": parts,
    }


def quadcopter_parts() -> list[dict[str, Any]]:
    """Return hull, arms and rotors of the quadcopter; the rotor in front is red."""
    rotors = {(ARM, 0.0): RED, (0.0, ARM): DARK, (-ARM, 0.0): DARK, (0.0, -ARM): DARK}
    return [
        {"shape": "box", "size": [0.2, 0.09, 0.06], "colour": DARK},
        *(
            {"shape": "box", "size": size, "colour": DARK}
            for size in ([2 * ARM, 0.02, 0.015], [0.02, 2 * ARM, 0.015])
        ),
        *(
            {
                "shape": "cylinder",
                "size": [0.1, 0.008],
                "position": [x, y, 0.03],
                "colour": colour,
                "opacity": 0.6,
            }
            for (x, y), colour in rotors.items()
        ),
    ]


def catamaran_parts() -> list[dict[str, Any]]:
    """Return deck, beams and hulls of the vessel."""
    return [
        {
            "shape": "box",
            "size": [0.7, 0.6, 0.02],
            "position": [0, 0, 0.13],
            "colour": [0.4, 0.4, 0.4],
        },
        {
            "shape": "box",
            "size": [0.52, 0.3, 0.18],
            "position": [0, 0, 0.03],
            "colour": [0.2, 0.4, 0.7],
        },
        *(
            {"shape": "box", "size": [0.04, 1.07, 0.04], "position": [x, 0, -0.06]}
            for x in (-0.24, 0.24)
        ),
        *(
            {"shape": "cylinder", "size": [0.06, 0.98], "position": [0, y, -0.12], **HULL}
            for y in (-0.533, 0.533)
        ),
    ]
