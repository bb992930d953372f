"""Videos contain the frames that a component class renders."""

import json
import sys
from dataclasses import replace

import imageio_ffmpeg
import numpy as np
import pytest

from cosim.core import resources
from cosim.core.errors import CosimError, InputError
from cosim.core.recording import Recording
from cosim.report.video import RenderJob, find_frame_source, render_frames, write_video
from cosim.results import Result

FRAMES = """
import os

import numpy as np

class Scene:
    @staticmethod
    def video_frames(result, camera, times, size):
        for second in times:
            frame = np.zeros((size[1], size[0], 3), np.uint8)
            frame[:, : size[0] // 2] = 40 + 90 * int(second)  # brighter each second
            yield frame

class Failing:
    @staticmethod
    def video_frames(*arguments):
        yield from list(Scene.video_frames(*arguments))[:3]
        raise ValueError("the lights went out")

class Dying:
    @staticmethod
    def video_frames(*arguments):
        yield from list(Scene.video_frames(*arguments))[:1]
        os._exit(3)

class Printing:
    @staticmethod
    def video_frames(*arguments):
        for frame in Scene.video_frames(*arguments):
            print("hello")
            yield frame
"""
RESULT = Result(Recording(np.array([0.0, 2.0]), {}, {}))


@pytest.fixture
def source(tmp_path):
    (tmp_path / "own_frames.py").write_text(FRAMES)
    return f"{tmp_path}/own_frames.py:Scene"


def read(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    about = next(reader)
    return about, [
        np.frombuffer(frame, np.uint8).reshape(about["size"][1], about["size"][0], 3)
        for frame in reader
    ]


def test_a_video_of_two_seconds_has_its_frames(tmp_path, source):
    about, frames = read(write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 10, source))
    assert about["size"] == (160, 90)
    assert about["fps"] == 10
    assert len(frames) == 21
    for i in (5, 15):
        assert frames[i][:, 10:70].mean() == pytest.approx(40 + 90 * (i // 10), abs=8)
        assert frames[i][:, 90:].mean() == pytest.approx(0, abs=8)


def collected(source, processes):
    job = RenderJob(source, RESULT, "chase", np.linspace(0.0, 2.0, 7), (16, 8))
    return np.array(list(render_frames(job, processes)))


def test_several_processes_render_the_same_in_the_same_order(source):
    frames = collected(source, 3)
    assert frames.shape == (7, 8, 16, 3)
    assert len(np.unique(frames[:, 0, 0, 0])) == 3
    assert np.array_equal(frames, collected(source, 1))


def test_an_exception_in_a_worker_process_is_raised(source):
    with pytest.raises(ValueError, match="the lights went out"):
        collected(source.replace(":Scene", ":Failing"), 2)


def test_an_input_error_in_a_worker_process_keeps_its_text(source):
    with pytest.raises(
        InputError, match=r'own_frames\.py" defines no "Scenes"; did you mean "Scene"'
    ):
        collected(source.replace(":Scene", ":Scenes"), 2)


def test_a_worker_process_that_ends_early_is_an_error(source):
    with pytest.raises(CosimError, match="ended with exit code 3"):
        collected(source.replace(":Scene", ":Dying"), 2)


def test_text_that_libraries_print_does_not_disturb_the_frames(source):
    assert len(collected(source.replace(":Scene", ":Printing"), 2)) == 7


def test_progress_is_reported_after_every_frame(tmp_path, source):
    progress = []
    write_video(
        RESULT,
        tmp_path / "run.mp4",
        "chase",
        (160, 90),
        2,
        source,
        lambda *counts: progress.append(counts),
    )
    assert progress == [(i, 5) for i in range(1, 6)]


def test_a_failure_leaves_no_file(tmp_path, source):
    with pytest.raises(ValueError, match="the lights went out"):
        write_video(
            RESULT,
            tmp_path / "run.mp4",
            "chase",
            (160, 90),
            10,
            source.replace(":Scene", ":Failing"),
        )
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["own_frames.py"]


def test_a_missing_extra_is_named(tmp_path, source, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r'need the extra "video": pip install'):
        write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 10, source)


def result_of(folder, components):
    return replace(
        RESULT,
        metadata={
            "scenario": {"components": components},
            "scenario_file": f"{folder}/scenario.json",
        },
    )


def test_the_frames_come_from_the_first_component_class_that_renders_them(tmp_path, source):
    (tmp_path / "plain.py").write_text("class Plain:\n    pass\n")
    components = {
        "f": {"fmu": "f.fmu"},
        "p": {"python": "plain.py:Plain"},
        "w": {"python": "own_frames.py:Scene"},
    }
    assert find_frame_source(result_of(tmp_path, components)) == source


def test_a_scenario_without_such_a_component_has_no_video(tmp_path):
    with pytest.raises(
        InputError,
        match=r'no component of the scenario renders a video: .* static method "video_frames"',
    ):
        find_frame_source(result_of(tmp_path, {"f": {"fmu": "f.fmu"}}))


def test_the_world_of_the_plant_renders_frames():
    scenario = resources.root() / "scenarios/demo1_box.json"
    metadata = {"scenario": json.loads(scenario.read_text()), "scenario_file": str(scenario)}
    assert find_frame_source(replace(RESULT, metadata=metadata)).endswith("world.py:World")
