"""A video holds the frames that went into it."""

import sys

import imageio_ffmpeg
import numpy as np
import pytest

from cosim.core.errors import CosimError, InputError
from cosim.core.recording import Recording
from cosim.report.frames import RenderJob, render_frames
from cosim.report.video import write_video
from cosim.results import Result

FRAMES = """
import os

import numpy as np

def frames(result, camera, moments, size):
    for second in moments:
        frame = np.zeros((size[1], size[0], 3), np.uint8)
        frame[:, : size[0] // 2] = 40 + 90 * int(second)  # the left half grows brighter from second to second
        yield frame

def broken(result, camera, moments, size):
    yield from list(frames(result, camera, moments, size))[:3]
    raise ValueError("the lights went out")

def dying(result, camera, moments, size):
    yield from list(frames(result, camera, moments, size))[:1]
    os._exit(3)

def talkative(result, camera, moments, size):
    for frame in frames(result, camera, moments, size):
        print("hello")
        yield frame
"""
RESULT = Result(Recording(np.array([0.0, 2.0]), {}, {}))


@pytest.fixture
def source(tmp_path):
    (tmp_path / "own_frames.py").write_text(FRAMES)
    return f"{tmp_path}/own_frames.py:frames"


def read(path):
    reader = imageio_ffmpeg.read_frames(str(path))
    about = next(reader)
    return about, [np.frombuffer(frame, np.uint8).reshape(about["size"][1], about["size"][0], 3) for frame in reader]


def test_two_seconds_can_be_read_back(tmp_path, source):
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


def test_a_failure_of_a_process_is_raised_here(source):
    with pytest.raises(ValueError, match="the lights went out"):
        collected(source.replace(":frames", ":broken"), 2)


def test_refusals_keep_their_words(source):
    with pytest.raises(InputError, match=r'own_frames\.py" defines no "frame"; did you mean "frames"'):
        collected(source.replace(":frames", ":frame"), 2)


def test_a_process_that_dies_is_noticed(source):
    with pytest.raises(CosimError, match="ended with exit code 3"):
        collected(source.replace(":frames", ":dying"), 2)


def test_libraries_may_print(source):
    assert len(collected(source.replace(":frames", ":talkative"), 2)) == 7


def test_progress_is_told(tmp_path, source):
    told = []
    write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 2, source, lambda *counts: told.append(counts))
    assert told == [(i, 5) for i in range(1, 6)]


def test_a_failure_leaves_no_file(tmp_path, source):
    with pytest.raises(ValueError, match="the lights went out"):
        write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 10, source.replace(":frames", ":broken"))
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["own_frames.py"]


def test_the_missing_extra_is_named(tmp_path, source, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r'need the extra "video": pip install'):
        write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 10, source)
