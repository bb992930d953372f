"""MCAP files, read by the reference implementations of MCAP and protobuf."""

from __future__ import annotations

import json
import math
import sys

import numpy as np
import pytest
from cosim_command import run_cosim

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import Result, mcap_files
from cosim.results.mcap_files import find_poses, write_mcap

mcap_reader = pytest.importorskip("mcap.reader")
protobuf = pytest.importorskip("mcap_protobuf.decoder")

ROWS = 25
SCENE = {
    "bodies": [
        {
            "name": "plant.uav",
            "parts": [
                {
                    "shape": "box",
                    "size": (0.3, 0.2, 0.1),
                    "position": (1.0, 2.0, 3.0),
                    "colour": (0.1, 0.2, 0.3),
                    "opacity": 0.5,
                },
                {
                    "shape": "cone",
                    "size": (0.1, 0.2, 0.4),
                    "position": (0, 0, 0),
                    "colour": (1, 1, 1),
                },
                {"shape": "sphere", "size": (0.1,), "position": (0, 0, 0), "colour": (1, 1, 1)},
            ],
        }
    ],
    "fixed": [
        {
            "shape": "cylinder",
            "size": (0.5, 2.0),
            "position": (0, 0, 1),
            "orientation": (0, 0, 0.6, 0.8),
            "colour": (1, 0, 0),
        }
    ],
    "markers": [{"position": (4.0, 5.0, 0.0), "radius": 0.5, "label": "1"}],
}


def recording(start=0.0):
    time = start + np.arange(ROWS) / 100
    angle = time - start
    columns = {
        **{
            f"plant.uav.position.{axis}": time * factor
            for axis, factor in zip("xyz", (1.0, 2.0, 3.0), strict=True)
        },
        "plant.uav.orientation.w": np.cos(angle / 2),
        "plant.uav.orientation.x": 0 * time,
        "plant.uav.orientation.y": 0 * time,
        "plant.uav.orientation.z": np.sin(angle / 2),
        "plant.deck.position.x": time,
        "uav.rotor_speed[1]": 100 * time,
        "uav.rotor_speed[2]": 200 * time,
        "uav.mode": np.arange(ROWS, dtype=np.int32),
        "uav.mode.name": np.array(["idle"] * ROWS, object),
        "uav.on": np.arange(ROWS) % 2 == 0,
        "uav.gap": np.where(np.arange(ROWS) == 3, math.nan, 1.0),
        "alone": time,
    }
    units = {
        **dict.fromkeys(columns, ""),
        "plant.uav.position.x": "m",
        "uav.rotor_speed[1]": "rad/s",
    }
    return Recording(time, columns, units)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "run.mcap"
    write_mcap(recording(), path, SCENE, {"name": "demo", "versions": {"cosim": "1"}})
    return path


def messages(path, topic):
    with path.open("rb") as stream:
        reader = mcap_reader.make_reader(stream, decoder_factories=[protobuf.DecoderFactory()])
        return [
            (schema, message, decoded)
            for schema, _, message, decoded in reader.iter_decoded_messages(topics=[topic])
        ]


def json_messages(path, topic):
    with path.open("rb") as stream:
        reader = mcap_reader.make_reader(stream)
        return [
            (schema, message, json.loads(message.data))
            for schema, _, message in reader.iter_messages(topics=[topic])
        ]


def test_poses_are_transforms_from_the_world(file):
    given = recording()
    found = messages(file, "/tf")
    assert [message.log_time for _, message, _ in found] == [
        10_000_000 * row for row in range(ROWS)
    ]
    for row, (schema, _, decoded) in enumerate(found):
        (transform,) = decoded.transforms
        assert (schema.name, transform.parent_frame_id, transform.child_frame_id) == (
            "foxglove.FrameTransforms",
            "world",
            "plant.uav",
        )
        assert transform.timestamp.ToNanoseconds() == 10_000_000 * row
        place = [getattr(transform.translation, axis) for axis in "xyz"]
        turn = [getattr(transform.rotation, axis) for axis in "wxyz"]
        assert place == [given.columns[f"plant.uav.position.{axis}"][row] for axis in "xyz"]
        assert turn == [given.columns[f"plant.uav.orientation.{axis}"][row] for axis in "wxyz"]


def test_a_position_without_orientation_is_no_pose():
    assert find_poses(recording()) == ["plant.uav"]


def test_signals_are_nested_by_their_names(file):
    given = recording()
    found = json_messages(file, "/signals/uav")
    assert len(found) == ROWS
    for row, (_, message, values) in enumerate(found):
        assert message.log_time == 10_000_000 * row
        assert values == {
            "rotor_speed": [
                given.columns["uav.rotor_speed[1]"][row],
                given.columns["uav.rotor_speed[2]"][row],
            ],
            "mode": {"value": row, "name": "idle"},
            "on": row % 2 == 0,
            "gap": None if row == 3 else 1.0,
        }
    assert json_messages(file, "/signals/alone")[7][2] == {"value": 0.07}
    assert json_messages(file, "/signals/plant")[7][2]["deck"]["position"] == {"x": 0.07}


def test_schemas_name_types_and_units(file):
    uav, plant = (
        json.loads(json_messages(file, f"/signals/{name}")[0][0].data) for name in ("uav", "plant")
    )
    assert uav["properties"]["rotor_speed"] == {
        "type": "array",
        "items": {"type": "number", "description": "rad/s"},
    }
    assert uav["properties"]["mode"]["properties"] == {
        "value": {"type": "integer"},
        "name": {"type": "string"},
    }
    assert uav["properties"]["on"] == {"type": "boolean"}
    assert plant["properties"]["uav"]["properties"]["position"]["properties"]["x"] == {
        "type": "number",
        "description": "m",
    }


def test_the_scene_moves_with_its_bodies(file):
    ((schema, message, update),) = messages(file, "/scene")
    uav, fixed = update.entities
    assert (schema.name, message.log_time) == ("foxglove.SceneUpdate", 0)
    assert (uav.id, uav.frame_id, uav.frame_locked) == ("plant.uav", "plant.uav", True)
    (box,), (cone,), (sphere,) = uav.cubes, uav.cylinders, uav.spheres
    assert (box.size.x, box.size.y, box.size.z, box.color.b, box.color.a) == (
        0.3,
        0.2,
        0.1,
        0.3,
        0.5,
    )
    assert (
        box.pose.position.x,
        box.pose.position.y,
        box.pose.position.z,
        box.pose.orientation.w,
    ) == (1, 2, 3, 1)
    assert (cone.size.x, cone.size.z, cone.bottom_scale, cone.top_scale) == (0.4, 0.4, 0.5, 1.0)
    assert (sphere.size.x, sphere.size.y, sphere.size.z) == (0.2, 0.2, 0.2)
    (cylinder,), (ring,) = fixed.cylinders, fixed.lines
    assert (fixed.frame_id, cylinder.size.x, cylinder.size.z, cylinder.pose.orientation.z) == (
        "world",
        1.0,
        2.0,
        0.6,
    )
    assert (
        ring.pose.position.x,
        {round(math.hypot(point.x, point.y), 12) for point in ring.points},
    ) == (4.0, {0.5})


def test_the_run_is_described(file):
    with file.open("rb") as stream:
        (about,) = mcap_reader.make_reader(stream).iter_metadata()
    assert about.metadata == {"name": '"demo"', "versions": '{"cosim": "1"}'}


def test_the_same_recording_gives_the_same_mcap_file(file, tmp_path):
    with file.open("rb") as stream:
        statistics = mcap_reader.make_reader(stream, validate_crcs=True).get_summary().statistics
    assert (statistics.message_count, statistics.message_end_time) == (1 + 4 * ROWS, 240_000_000)
    write_mcap(
        recording(), tmp_path / "again.mcap", SCENE, {"name": "demo", "versions": {"cosim": "1"}}
    )
    assert (tmp_path / "again.mcap").read_bytes() == file.read_bytes()


def test_runs_that_start_before_zero_are_shifted(tmp_path):
    write_mcap(recording(start=-0.1), tmp_path / "early.mcap")
    assert [message.log_time for _, message, _ in messages(tmp_path / "early.mcap", "/tf")][:2] == [
        0,
        10_000_000,
    ]


def test_chunks_are_joined_without_gaps(tmp_path, monkeypatch):
    monkeypatch.setattr(mcap_files, "ROWS_PER_CHUNK", 10)
    write_mcap(recording(), tmp_path / "r.mcap")
    assert [
        values["mode"]["value"]
        for _, _, values in json_messages(tmp_path / "r.mcap", "/signals/uav")
    ] == list(range(ROWS))


def test_an_empty_recording_gives_an_empty_file(tmp_path):
    Result(Recording(np.empty(0), {}, {})).to_mcap(tmp_path / "empty.mcap", SCENE)
    with (tmp_path / "empty.mcap").open("rb") as stream:
        assert mcap_reader.make_reader(stream).get_summary().statistics.message_count == 0


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    with pytest.raises(InputError, match=r'pip install "fmi-cosim\[mcap\]"'):
        write_mcap(recording(), tmp_path / "r.mcap")


def test_a_run_writes_its_poses_and_its_scene(tmp_path):
    words = (
        "run",
        "demo1_box",
        "--stop-time",
        "0.5",
        "--no-report",
        "--mcap",
        "--output-dir",
        "out",
    )
    done = run_cosim(*words, cwd=tmp_path)
    assert done.returncode == 3, done.stderr  # nothing has landed by then
    file = tmp_path / "out/result.mcap"
    assert {transform.child_frame_id for transform in messages(file, "/tf")[0][2].transforms} == {
        "plant.uav",
        "plant.usv",
    }
    ((_, _, update),) = messages(file, "/scene")
    assert {entity.id for entity in update.entities} == {"plant.uav", "plant.usv", "fixed"}
    assert all(entity.cubes for entity in update.entities)
    height = json_messages(file, "/signals/plant")[-1][2]["uav"]["position"]["z"]
    assert height == Result.from_csv(tmp_path / "out/result.csv")["plant.uav.position.z"][-1]
