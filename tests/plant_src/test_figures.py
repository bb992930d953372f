"""Figures of a mission, checked by reading the data back from the drawn lines."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from mission_recording import TOUCHDOWN, mission_result, with_signals

from cosim.report.figures import draw_figure
from plant_src.figures import TIME_AFTER_TOUCHDOWN, landing, paths, tracking_error

DECK = {"vehicle": "plant.uav", "deck": "plant.usv.deck"}
LANDING = {
    **DECK,
    "altitude_reference": "uav.vtol.altitude_reference",
    "mode": "uav.vtol.mode",
    "phases": ["idle", "take-off", "follow", "approach", "descend", "landed"],
    "limit": 0.1,
}


def drawn(axes):
    """The labelled lines: label -> (x, y)."""
    return {
        line.get_label(): line.get_data()
        for line in axes.lines
        if not line.get_label().startswith("_")
    }


def not_landed():
    return mission_result(
        plant__uav__contact__vessel=np.zeros_like(mission_result().time, dtype=bool)
    )


def test_paths_are_the_recorded_positions():
    result = mission_result()
    lines = drawn(paths(result, **DECK).axes[0])
    for label, vehicle in (("vessel", "plant.usv"), ("quadcopter", "plant.uav")):
        assert np.array_equal(
            lines[label], [result[f"{vehicle}.position.x"], result[f"{vehicle}.position.y"]]
        )


def test_waypoints_have_circles_of_acceptance_and_numbers():
    axes = paths(
        mission_result(),
        **DECK,
        waypoint_x=[5.0, 10.0],
        waypoint_y=[1.0, -1.0],
        acceptance_radius=0.5,
    ).axes[0]
    circles = [(patch.center, patch.radius) for patch in axes.patches if isinstance(patch, Circle)]
    assert circles == [((5.0, 1.0), 0.5), ((10.0, -1.0), 0.5)]
    assert [text.get_text() for text in axes.texts] == ["1", "2"]


def test_platforms_stand_where_the_plant_has_them():
    platforms = {"start": {"size": [5.0, 4.0, 0.05], "position": [-6.975, 2.85, 0.45]}}
    axes = paths(mission_result(), **DECK, platforms=platforms).axes[0]
    (rectangle,) = [patch for patch in axes.patches if isinstance(patch, Rectangle)]
    assert rectangle.get_bbox().bounds == pytest.approx((-9.475, 0.85, 5.0, 4.0))
    assert [text.get_text() for text in axes.texts] == ["start"]


def test_touchdown_is_marked_on_the_path():
    x, y = drawn(paths(mission_result(), **DECK).axes[0])["touchdown"]
    assert (x[0], y[0]) == pytest.approx((TOUCHDOWN + 0.03, 0.04))


@pytest.mark.parametrize("figure", [paths, landing])
def test_without_a_landing_there_is_no_mark(figure):
    assert all("touchdown" not in drawn(axes) for axes in figure(not_landed(), **DECK).axes)


def test_both_axes_have_the_same_scale():
    figure = paths(
        mission_result(),
        **DECK,
        waypoint_x=[0.0, 0.0],
        waypoint_y=[-3.0, 14.0],
        acceptance_radius=0.5,
    )
    axes = figure.axes[0]
    figure.draw_without_rendering()
    (x_first, x_last), (y_first, y_last), box = (
        axes.get_xlim(),
        axes.get_ylim(),
        axes.get_window_extent(),
    )
    assert box.width / (x_last - x_first) == pytest.approx(box.height / (y_last - y_first))
    assert y_last - y_first > 17


def test_altitudes_are_the_recorded_ones_until_shortly_after_touchdown():
    result = mission_result()
    axes, lines = landing(result, **LANDING).axes[0], drawn(landing(result, **LANDING).axes[0])
    rows = result.time <= TOUCHDOWN + TIME_AFTER_TOUCHDOWN + 1e-9
    for label, signal in (
        ("quadcopter", "plant.uav.position.z"),
        ("deck", "plant.usv.deck.position.z"),
        ("reference", "uav.vtol.altitude_reference"),
    ):
        assert np.array_equal(lines[label], [result.time[rows], result[signal][rows]])
    assert axes.get_xlim() == (0.0, TOUCHDOWN + TIME_AFTER_TOUCHDOWN)


def test_the_error_is_the_distance_from_the_deck():
    time, error = (
        landing(mission_result(offset=(0.06, 0.08)), **LANDING).axes[1].lines[0].get_data()
    )
    assert error[time >= 9.0] == pytest.approx(0.1)
    assert error[0] == pytest.approx(np.hypot(5.0, 1.0))


def test_touchdown_is_marked_in_both_panels():
    above, below = landing(mission_result(), **LANDING).axes
    time, altitude = drawn(above)["touchdown"]
    assert (time[0], altitude[0]) == pytest.approx((TOUCHDOWN, 0.325))
    for axes in (above, below):
        assert [TOUCHDOWN, TOUCHDOWN] in [list(line.get_xdata()) for line in axes.lines]


def test_phases_are_shaded_and_named_once_each():
    above, below = landing(mission_result(), **LANDING).axes
    assert [text.get_text() for text in above.texts] == [
        "idle",
        "take-off",
        "follow",
        "approach",
        "descend",
        "landed",
    ]
    for axes in (above, below):
        assert [span.get_x() for span in axes.patches] == pytest.approx([0, 1, 3, 6, 9, 12])
        assert [span.get_width() for span in axes.patches] == pytest.approx([1, 2, 3, 3, 3, 4])


def test_a_phase_too_short_for_its_name_has_none():
    time = mission_result().time
    mode = np.where(time < 5, 3, np.where(time < 5.05, 5, 3)).astype(np.int32)
    above = landing(mission_result(uav__vtol__mode=mode), **LANDING).axes[0]
    assert [text.get_text() for text in above.texts] == ["follow", "follow"]
    assert len(above.patches) == 3


def test_a_mode_without_a_name_shows_its_number():
    above = landing(mission_result(), **{**LANDING, "phases": ["idle"]}).axes[0]
    assert [text.get_text() for text in above.texts] == ["idle", "2", "3", "4", "5", "6"]


def test_a_window_can_be_chosen():
    figure = landing(mission_result(), **LANDING, start=8.0, stop=13.0)
    time, _ = drawn(figure.axes[0])["quadcopter"]
    assert (time[0], time[-1]) == (8.0, 13.0)


def test_a_vehicle_has_one_colour_in_all_figures():
    colours = []
    for figure in (paths, landing):
        lines = figure(mission_result(), **DECK).axes[0].lines
        colours.append({line.get_label(): line.get_color() for line in lines})
    assert (
        colours[0]["quadcopter"]
        == colours[1]["quadcopter"]
        != colours[0]["vessel"]
        == colours[1]["deck"]
    )


@pytest.mark.parametrize("figure", [paths, landing])
def test_axes_carry_units_and_the_figure_fits_a_column(figure):
    picture = figure(mission_result(), **DECK)
    assert isinstance(picture, Figure)
    assert picture.get_size_inches()[0] == 3.5
    assert all(axes.get_ylabel().endswith("/ m") for axes in picture.axes)
    assert picture.axes[-1].get_xlabel() in ("x / m", "t / s")


def short_phases(result):
    """Modes of which two are too short for a horizontal name."""
    return np.select([result.time < 8, result.time < 8.7, result.time < 9.4], [3, 4, 5], 4).astype(
        np.int32
    )


def test_all_texts_are_inside_of_the_figure():
    result = mission_result(offset=(6e-4, 8e-4))
    result = with_signals(result, uav__vtol__mode=short_phases(result))
    far = with_signals(
        result, **{f"plant__{name}__position__y": 1000 * result.time for name in ("uav", "usv")}
    )
    turns = {"vehicle": "plant.uav", "target": "plant.usv.deck", **TURNS, "limit": 0.1255}
    for function, recorded, arguments in (
        (landing, result, {**LANDING, "limit": 0.1255}),
        (tracking_error, result, turns),
        (
            paths,
            result,
            {**DECK, "waypoint_x": [5.0], "waypoint_y": [0.0], "acceptance_radius": 0.5},
        ),
        (paths, far, DECK),
    ):
        figure = draw_figure(recorded, function.__name__, function, arguments)
        box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
        assert max(-box.x0, -box.y0, box.x1 - width, box.y1 - height) <= 0, function


TURNS = {"waypoint_x": [4.0, 9.0, 30.0], "waypoint_y": [0.0, 0.0, 0.0], "acceptance_radius": 0.5}


def turns(figure):
    return [line.get_xdata()[0] for line in figure.axes[0].lines if line.get_linestyle() == ":"]


def test_the_tracking_error_is_the_horizontal_distance():
    figure = tracking_error(mission_result(offset=(0.06, 0.08)), "plant.uav", "plant.usv.deck")
    time, error = figure.axes[0].lines[0].get_data()
    assert error[0] == pytest.approx(np.hypot(5.0, 1.0))
    assert error[time >= 9.0] == pytest.approx(0.1)


def test_turns_are_marked_when_the_vessel_enters_their_circles():
    figure = tracking_error(mission_result(), "plant.uav", "plant.usv.deck", **TURNS)
    assert turns(figure) == pytest.approx([3.5, 8.5])
    assert [text.get_text() for text in figure.axes[0].texts] == ["turn 1", "turn 2"]


def test_turns_before_the_window_are_not_marked():
    figure = tracking_error(mission_result(), "plant.uav", "plant.usv.deck", **TURNS, start=5.0)
    assert turns(figure) == pytest.approx([8.5])
    assert figure.axes[0].lines[0].get_xdata()[0] == 5.0
