"""Saved states while several shapes of a vehicle touch one other body: restored bit for bit, and
saving changes nothing.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from plant_validation import MeasurementCheck
from world_harness import DECK_TOP, REST_HEIGHT, WorldHarness, quadcopter_settings, vessel_settings

from cosim.core import resources

AGAIN = "20 steps from before, during and after the first contact, repeated"
STEPS, HORIZON = 120, 20
#: quads of a box as corners of its vertices
QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def wall(
    low: tuple[float, ...] = (3.0, -2.0, -1.0),
    high: tuple[float, ...] = (4.0, 2.0, 1.0),
    **more: Any,
) -> dict[str, Any]:
    (a, b, c), (d, e, f) = low, high
    vertices = [[x, y, z] for z in (c, f) for x, y in ((a, b), (d, b), (d, e), (a, e))]
    faces = []
    for p, q, r, s in QUADS:
        faces += [[p, q, r], [p, r, s]]
    return {"mesh": {"vertices": vertices, "faces": faces}, **more}


def ahead(motion: str, **more: Any) -> dict[str, Any]:
    """A Strider at 1 m/s towards the wall, which both bows touch after half a second."""
    start = {"velocity_body": [1.0, 0.0, 0.0], "motion": motion, "crash_speed": 9.0, **more}
    return vessel_settings([2.0, 0.0], **start)


def bows(motion: str) -> WorldHarness:
    return WorldHarness({"usv": ahead(motion)}, obstacles={"quay": wall()})


def triangles(motion: str) -> WorldHarness:
    return WorldHarness({"usv": ahead(motion)}, obstacles={"quay": wall(collision="concave")})


def platform(motion: str) -> WorldHarness:
    return WorldHarness(
        {"usv": ahead(motion, yaw=0.05)},
        {"quay": {"size": [1.0, 4.0, 2.0], "position": [3.5, 0.0, 0.0]}},
    )


def corner(motion: str) -> WorldHarness:
    return WorldHarness(
        {"usv": ahead(motion, yaw=0.4)},
        obstacles={"a": wall(), "b": wall((0.0, 1.0, -1.0), (3.0, 2.0, 1.0))},
    )


def side_by_side(motion: str) -> WorldHarness:
    other = ahead(motion) | {"position": [2.1, 1.25], "velocity_body": [0.7, 0.0, 0.0]}
    return WorldHarness({"usv": ahead(motion), "other": other}, obstacles={"quay": wall()})


def bow_to_bow(motion: str) -> WorldHarness:
    return WorldHarness(
        {"usv": ahead(motion), "other": ahead(motion) | {"position": [3.4, 0.03], "yaw": 3.1}}
    )


def with_a_landed_quadcopter(motion: str) -> WorldHarness:
    uav = quadcopter_settings(
        [1.9865, 0.002, DECK_TOP + REST_HEIGHT + 0.05], yaw=0.3, velocity_body=[0.9, -0.3, 0.0]
    )
    return WorldHarness({"uav": uav, "usv": ahead(motion)}, obstacles={"quay": wall()})


def on_skids(motion: str) -> WorldHarness:
    """A quadcopter on two skids, which lands on the deck."""
    vehicle = json.loads((resources.root() / "plant_src/vehicles/data/x500.json").read_text())
    sizes = {(0.0, side, -0.205): [0.3, 0.03, 0.03] for side in (-0.13, 0.13)} | {
        (0.0, 0.0, 0.0): [0.36, 0.36, 0.1]
    }
    vehicle["boxes"] = [
        {"size": size, "position": list(place), "source": "test"} for place, size in sizes.items()
    ]
    uav = {
        "model": vehicle,
        "position": [0.0, 0.02, DECK_TOP + 0.3],
        "yaw": 0.3,
        "velocity_body": [0.3, 0.0, 0.0],
    }
    return WorldHarness(
        {
            "uav": uav,
            "usv": vessel_settings([0.0, 0.0], velocity_body=[0.3, 0.0, 0.0], motion=motion),
        }
    )


def under_way(scene: Callable[[str], WorldHarness], motion: str) -> WorldHarness:
    trial = scene(motion)
    for variable in trial.inputs.variables:
        if variable.name.endswith(".thrust"):
            trial[variable.name] = 1.0
    return trial


def rows(trial: WorldHarness, count: int) -> list[bytes]:
    return [trial.step().bytes for _ in range(count)]


@pytest.mark.parametrize("motion", ["planar", "6dof"])
@pytest.mark.parametrize(
    "scene",
    [
        bows,
        triangles,
        platform,
        corner,
        side_by_side,
        bow_to_bow,
        with_a_landed_quadcopter,
        on_skids,
    ],
)
def test_a_state_is_restored_bit_for_bit(
    scene: Callable[[str], WorldHarness], motion: str, measured: MeasurementCheck
) -> None:
    expected = rows(under_way(scene, motion), STEPS + HORIZON)
    trial, states, touched = under_way(scene, motion), {}, False
    for step in range(STEPS):
        if step % 5 == 0:
            states[step] = trial.world.get_state()
        assert trial.step().bytes == expected[step]
        touched |= trial["usv.contact.touching"]
    assert touched
    differing = 0
    for step, state in [*states.items(), *reversed(states.items())]:
        trial.world.set_state(state)
        differing += sum(
            one != other for one, other in zip(rows(trial, HORIZON), expected[step:], strict=False)
        )
    measured(
        "Determinism and saved states",
        "steps that differ after a return, at walls",
        differing,
        0,
        "1",
        AGAIN,
    )
