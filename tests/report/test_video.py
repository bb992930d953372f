"""A video holds the frames that went into it."""

import sys

import imageio_ffmpeg
import numpy as np
import pytest

from cosim.errors import InputError
from cosim.recording import Recording
from cosim.report.video import write_video
from cosim.results import Result

FRAMES = """
import numpy as np

def frames(result, camera, rate, size):
    for second in np.arange(0, result.time[-1], 1 / rate):
        frame = np.zeros((size[1], size[0], 3), np.uint8)
        frame[:, : size[0] // 2] = 40 + 90 * int(second)  # the left half grows brighter from second to second
        yield frame

def broken(result, camera, rate, size):
    yield from list(frames(result, camera, rate, size))[:3]
    raise ValueError("the lights went out")
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
    assert len(frames) == 20
    for i in (5, 15):
        assert frames[i][:, 10:70].mean() == pytest.approx(40 + 90 * (i // 10), abs=8)
        assert frames[i][:, 90:].mean() == pytest.approx(0, abs=8)


def test_a_failure_leaves_no_file(tmp_path, source):
    with pytest.raises(ValueError, match="the lights went out"):
        write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 10, source.replace(":frames", ":broken"))
    assert [path.name for path in tmp_path.iterdir() if path.is_file()] == ["own_frames.py"]


def test_the_missing_extra_is_named(tmp_path, source, monkeypatch):
    monkeypatch.setitem(sys.modules, "imageio_ffmpeg", None)
    with pytest.raises(InputError, match=r'need the extra "video": pip install'):
        write_video(RESULT, tmp_path / "run.mp4", "chase", (160, 90), 10, source)
