"""Obstacles: collisions with convex parts and with triangles, mesh files, saved states, scenes and
refusals.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from world_harness import WorldHarness, quadcopter_settings, vessel_settings

import cosim
from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.placement import obstacles_of
from plant_src.scene.replay import world_scene

HARBOUR = json.loads((resources.root() / "scenarios/meshes/harbour.json").read_text())
#: quads of a box as corners of its vertices
QUADS = ((0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7))


def triangles(quads: Iterable[tuple[int, ...]]) -> list[list[int]]:
    """Return both triangles of each quad."""
    faces = []
    for a, b, c, d in quads:
        faces += [[a, b, c], [a, c, d]]
    return faces


def box(low: tuple[float, ...], high: tuple[float, ...]) -> dict[str, Any]:
    (a, b, c), (d, e, f) = low, high
    return {
        "vertices": [[x, y, z] for z in (c, f) for x, y in ((a, b), (d, b), (d, e), (a, e))],
        "faces": triangles(QUADS),
    }


def arch() -> dict[str, Any]:
    """Two posts and a beam of 0.5 m around an opening of 2 x 2 m in the plane x = 3, as one
    connected mesh.
    """
    inner, outer = (
        [(-1, 0), (1, 0), (1, 2), (-1, 2)],
        [(-1.5, 0), (1.5, 0), (1.5, 2.5), (-1.5, 2.5)],
    )
    vertices = [[x, *point] for x in (3.0, 3.5) for ring in (inner, outer) for point in ring]
    sides = [(1, 2), (2, 3), (3, 0)]
    quads = [(k + a, k + b, k + 4 + b, k + 4 + a) for k in (0, 8) for a, b in sides]
    quads += [(k + a, k + b, k + 8 + b, k + 8 + a) for k in (0, 4) for a, b in sides]
    return {
        "vertices": vertices,
        "faces": triangles(quads),
    }


def towards_wall(motion: str = "planar", **more: Any) -> WorldHarness:
    """The Strider at 1 m/s towards a wall at x = 3."""
    wall = {"mesh": box((3.0, -2.0, -1.0), (4.0, 2.0, 1.0)), **more}
    vessel = {
        **vessel_settings([0.0, 0.0], velocity_body=[1.0, 0.0, 0.0], motion=motion),
        "crash_speed": 0.5,
    }
    trial = WorldHarness({"usv": vessel}, obstacles={"wall": wall})
    trial["usv.thrust"] = 1.0
    return trial


@pytest.mark.parametrize("collision", ["convex", "concave"])
def test_a_wall_stops_a_vessel(collision: str, caplog: pytest.LogCaptureFixture) -> None:
    """The bow touches 0.49 m ahead of the centre of mass; at rest the wall carries the thrust."""
    trial = towards_wall(collision=collision)
    while not trial["usv.contact.touching"] and trial.steps < 500:
        trial.step()
    assert trial["usv.position.x"] == pytest.approx(3.0 - 0.979 / 2, abs=0.02)
    assert trial.step(600)["usv.position.x"] == pytest.approx(3.0 - 0.979 / 2, abs=0.02)
    assert trial["usv.contact.force"] == pytest.approx(1.0, rel=0.02)
    assert trial["usv.crashed"]
    assert "collision with wall at" in caplog.text


@pytest.mark.parametrize(("collision", "passes"), [("concave", True), ("convex", False)])
def test_an_opening_exists_for_triangles_only(collision: str, passes: bool) -> None:
    """A quadcopter thrown through the middle of an arch; its convex hull has no opening."""
    vehicle = {**quadcopter_settings([0.0, 0.0, 1.0]), "velocity_body": [8.0, 0.0, 3.0]}
    trial = WorldHarness(
        {"uav": vehicle}, obstacles={"arch": {"mesh": arch(), "collision": collision}}
    ).step(60)
    assert (trial["uav.position.x"] > 4.0) == passes
    assert trial["uav.crashed"] != passes


def test_parts_without_common_corners_are_separate() -> None:
    (obstacle,) = obstacles_of(
        {
            "obstacles": {
                "harbour": {"mesh": HARBOUR, "position": [1, 2, 3], "yaw": np.pi / 2, "scale": 2}
            }
        }
    )
    assert [len(part) for part in obstacle.parts] == [12] * 6
    assert obstacle.triangles.max(axis=(0, 1)) == pytest.approx(
        [1 + 2 * 6.4, 2 + 2 * 10.6, 3 + 2 * 0.9]
    )


@pytest.mark.parametrize("collision", ["convex", "concave"])
@pytest.mark.parametrize("steps", [255, 300])
def test_states_at_a_wall_are_restored_bit_for_bit(steps: int, collision: str) -> None:
    trial = towards_wall("6dof", collision=collision).step(steps)
    state, start = trial.world.get_state(), trial.steps
    first = [trial.step().bytes for _ in range(40)]
    trial.world.set_state(state)
    trial.steps = start
    assert [trial.step().bytes for _ in range(40)] == first


@pytest.mark.parametrize("suffix", ["stl", "obj", "glb"])
def test_mesh_files_give_the_same_run_as_triangles_in_json(suffix: str, tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    mesh = box((3.0, -2.0, -1.0), (4.0, 2.0, 1.0))
    trimesh.Trimesh(mesh["vertices"], mesh["faces"], process=False).export(
        tmp_path / f"wall.{suffix}"
    )
    results = [run_to_wall(tmp_path, given) for given in (f"wall.{suffix}", mesh)]
    assert results[0]["plant.usv.contact.touching"].any()
    assert all(
        (results[0][name] == results[1][name]).all()
        for name in ("plant.usv.position.x", "plant.usv.contact.force")
    )


def run_to_wall(folder: Path, mesh: Any) -> cosim.Result:
    vessel = {"model": "strider", "position": [2.0, 0.0], "velocity_body": [1.0, 0.0, 0.0]}
    world = {
        "python": "cosim:plant_src/world.py:World",
        "arguments": {"vehicles": {"usv": vessel}, "obstacles": {"wall": {"mesh": mesh}}},
    }
    scenario = {"name": "wall", "stop_time": 1.5, "step_size": 0.01, "components": {"plant": world}}
    (folder / "wall_scenario.json").write_text(json.dumps(scenario))
    return cosim.run(folder / "wall_scenario.json")


def test_the_replay_shows_the_mesh_in_the_world() -> None:
    arguments = {
        "vehicles": {"usv": {"model": "strider"}},
        "obstacles": {"harbour": {"mesh": HARBOUR, "colour": [1, 0, 0]}},
    }
    (part,) = world_scene("plant", {"components": {"plant": {"arguments": arguments}}})["fixed"]
    corners = np.reshape(part["size"], (-1, 3)) + part["position"]
    assert part["shape"] == "mesh"
    assert part["colour"] == (1.0, 0.0, 0.0)
    assert corners.min(axis=0) == pytest.approx(np.min(HARBOUR["vertices"], axis=0))


def test_invalid_obstacles_are_refused_together() -> None:
    wrong = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 3]]}
    with pytest.raises(InputError) as caught:
        WorldHarness(
            {"uav": quadcopter_settings([0, 0, 2])},
            obstacles={"a": {"mesh": wrong}, "b": {"size": [1, 1, 1]}},
        )
    texts = [str(problem) for problem in caught.value.problems]
    assert any("obstacles.a.mesh" in text and "faces" in text for text in texts)
    assert any("obstacles.b" in text and '"mesh" is missing' in text for text in texts)


def test_an_obstacle_at_the_place_of_a_vehicle_is_refused() -> None:
    with pytest.raises(InputError, match=r"obstacles\.wall overlaps vehicles\.usv"):
        WorldHarness(
            {"usv": vessel_settings([0, 0])},
            obstacles={"wall": {"mesh": box((-1, -1, -1), (1, 1, 1))}},
        )
