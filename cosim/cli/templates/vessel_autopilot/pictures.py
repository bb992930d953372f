"""Figure of a run, and the vessel in its 3-D replay."""

import math
from typing import Any

from matplotlib.figure import Figure

from cosim.results import Result

HULL = {
    "orientation": [0, math.sqrt(0.5), 0, math.sqrt(0.5)],
    "colour": [0.9, 0.7, 0.1],
}  # along x, yellow


def course(result: Result, vessel: str) -> Figure:
    """Draw the course (rad) and the speed (m/s) of `vessel` over time (s)."""
    figure = Figure(layout="constrained")
    yaw, speed = figure.subplots(2, sharex=True)
    yaw.plot(result.time, result[f"{vessel}.attitude.yaw"])
    yaw.set_ylabel("course / rad")
    speed.plot(result.time, result[f"{vessel}.velocity_body.u"])
    speed.set(xlabel="time / s", ylabel="speed / (m/s)")
    return figure


def scene(scenario: dict[str, Any], vessel: str) -> dict[str, Any]:
    """Return the scene: the catamaran `vessel` on calm water.

    Lengths in m, body frame x forward, y to port, z up.
    """
    parts = [
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
    return {
        "bodies": [
            {
                "name": vessel,
                "colour": "#d55e00",
                "position": [f"{vessel}.position.{axis}" for axis in "xyz"],
                "orientation": [f"{vessel}.orientation.{part}" for part in "wxyz"],
                "parts": parts,
            }
        ],
        "water": {"waves": [], "gain": 1},
        "plots": [[f"{vessel}.attitude.yaw"], [f"{vessel}.velocity_body.u"]],
    }
