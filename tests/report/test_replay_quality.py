"""Adaptive picture quality: smooth with software rendering, and fine when nothing moves."""

import pytest

from cosim.report.replay import write_replay

QUALITY = "cosimReplay.view.quality"
AT_REST = "!cosimReplay.view.stale && cosimReplay.view.renderer.getPixelRatio() === 1.5"


@pytest.fixture(scope="module")
def opened(open_page, flight_result, tmp_path_factory):
    file = tmp_path_factory.mktemp("quality") / "replay.html"
    write_replay([flight_result], file)
    return open_page(file)


def rungs(opened, software, frames):
    """The rungs of a new ladder after frames that each took so many milliseconds."""
    return opened(
        f"(() => {{ const quality = new {QUALITY}.constructor({software}); "
        f"return {frames}.map((elapsed) => (quality.took(elapsed), quality.rung)); }})()"
    )


def test_slow_frames_reduce_the_quality_to_the_lowest_level(opened):
    found = rungs(opened, "false", "Array(200).fill(90)")
    assert found[0] == 0
    assert found == sorted(found)
    assert set(found) == set(range(6))


def test_smooth_frames_change_nothing(opened):
    for elapsed in (25, 30, 36):
        assert set(rungs(opened, "false", f"Array(500).fill({elapsed})")) == {0}


def test_a_single_slow_frame_changes_nothing(opened):
    assert set(rungs(opened, "false", "[...Array(20).fill(17), 900, ...Array(20).fill(17)]")) == {0}


def test_without_a_graphics_card_it_starts_at_low_quality_and_increases_it(opened):
    found = rungs(opened, "true", "Array(1000).fill(17)")
    assert found[0] == 3
    assert found[-1] == 0


def test_a_level_that_was_too_slow_is_not_tried_again(opened):
    found = rungs(opened, "true", "[...Array(12).fill(60), ...Array(1000).fill(17)]")
    assert found[11] == 4
    assert set(found[12:]) == {4}


def drawn(opened):
    """Return the number of frames drawn, and the triangles and pixels of the last one."""
    return opened(
        "(({frames, renderer}) => [frames, renderer.info.render.triangles, "
        "renderer.domElement.width])(cosimReplay.view)"
    )


def test_a_moving_picture_is_coarse_and_a_still_one_fine(opened):
    opened.seek(3.0)
    opened.page.click(".play")
    opened.until("cosimReplay.player.time > 4")
    _, few, narrow = drawn(opened)
    opened.page.click(".play")
    opened.until(AT_REST)
    _, many, wide = drawn(opened)
    assert many > 2 * few
    assert wide > 2 * narrow


def test_nothing_is_drawn_while_nothing_changes(opened):
    opened.seek(5.0)
    opened.until(AT_REST)
    frames = drawn(opened)[0]
    opened.page.wait_for_timeout(700)
    assert drawn(opened)[0] == frames
    opened.seek(5.5)
    opened.until(f"cosimReplay.view.frames > {frames}")
