"""Without contact the plant FMUs and the PyBullet world are the same plant."""

from itertools import product

import numpy as np

import cosim
from cosim.core.resources import root

MOTION = [
    *map(".".join, product(("position", "velocity"), "xyz")),
    *(f"attitude.{angle}" for angle in ("roll", "pitch", "yaw")),
    *(f"rates.{rate}" for rate in "pqr"),
]

WORLD = {
    "python": f"{root()}/plant_src/world.py:World",
    "arguments": {
        "vehicles": {
            "quadcopter": {
                "model": "ar_drone",
                "position": [-5.0, 1.0, 2.0],
                "yaw": 1.5707963267948966,
            },
            "vessel": {
                "model": "strider",
                "hull": "paper",
                "position": [-0.1, 0.075],
                "velocity_body": [0.5, 0.0, 0.0],
                "rates": [0.0, 0.0, 0.1],
            },
        }
    },
}
CHANGES = {
    "/components/quadcopter": WORLD,
    "/connections": [
        {"from": "quadcopter.quadcopter", "to": "uav.vehicle"},
        {"from": "quadcopter.vessel.deck", "to": "uav.target"},
        {"from": "uav.rotor_speed", "to": "quadcopter.quadcopter.rotor_speed"},
        {"from": "quadcopter.vessel", "to": "usv.vehicle"},
        {"from": "usv.thrust", "to": "quadcopter.vessel.thrust"},
        {"from": "usv.rudder_angle", "to": "quadcopter.vessel.rudder_angle"},
    ],
    "/kpis": [],
    "/checks": [],
}


def test_plant_fmus_and_world_agree_over_forty_seconds():
    alone = cosim.run("free_flight")
    together = cosim.run("free_flight", CHANGES)
    for vehicle in ("quadcopter", "vessel"):
        for name in MOTION:
            difference = np.abs(
                alone[f"{vehicle}.{name}"] - together[f"quadcopter.{vehicle}.{name}"]
            ).max()
            assert difference <= 1e-6, f"{vehicle}.{name}: {difference}"


def test_the_quadcopter_follows_the_vessel():
    result = cosim.run("free_flight")
    assert result.kpis["tracking.max"] <= 0.2
    assert np.abs(result["quadcopter.position.z"][-1000:] - 2.0).max() < 0.01
