"""The ghost sequence and the frames of a video."""

import numpy as np
import pytest
from mission_recording import TOUCHDOWN, mission_result
from scene_recording import scene_mission

from cosim.core.errors import InputError
from plant_src.scene.figures import ghosts
from plant_src.scene.render import frames

PIXELS = (160, 80)


def times(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def test_ghosts_are_one_second_apart_and_end_at_the_touchdown():
    assert times(ghosts(scene_mission(), pixels=PIXELS)) == [
        f"{TOUCHDOWN - 8 + i:.1f} s" for i in range(9)
    ]


def test_a_window_can_be_chosen():
    figure = ghosts(
        scene_mission(), camera="overview", start=2.0, stop=5.0, interval=1.5, pixels=PIXELS
    )
    assert times(figure) == ["2.0 s", "3.5 s", "5.0 s"]


def test_the_picture_has_its_pixels_and_fits_a_page():
    figure = ghosts(scene_mission(), interval=4.0, pixels=PIXELS)
    assert figure.axes[0].images[0].get_array().shape == (80, 160, 3)
    assert figure.get_size_inches() == pytest.approx((7.16, 3.58))


def test_an_empty_window_is_refused():
    with pytest.raises(InputError, match="nothing to show from 9 s to 5 s"):
        ghosts(scene_mission(), start=9.0, stop=5.0)


def test_a_result_without_a_plant_is_refused():
    with pytest.raises(InputError, match="a plant with vehicles"):
        ghosts(mission_result())


def test_frames_follow_the_mission():
    first, second = frames(scene_mission(), "overview", np.array([2.0, 8.0]), PIXELS)
    assert first.shape == (80, 160, 3)
    assert first.dtype == np.uint8
    assert not np.array_equal(first, second)
