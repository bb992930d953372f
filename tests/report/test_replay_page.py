"""The replay page in a browser. Every test also checks that the page loads nothing and reports no
errors.
"""

from copy import deepcopy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cosim.core.recording import Recording
from cosim.report.diagram import WIDTH
from cosim.report.replay import write_replay
from cosim.report.run_page import write_report
from cosim.results import Result
from plant_src.environment import sea

BODIES = ("plant.uav", "plant.usv")


@pytest.fixture(scope="module")
def shared(open_page, flight_result, tmp_path_factory):
    file = tmp_path_factory.mktemp("replay") / "replay.html"
    write_replay([flight_result], file)
    return open_page(file)


@pytest.fixture
def opened(shared):
    """The replay of the flight at its start, as seen by the camera that it begins with; one page
    for all, since it takes long.
    """
    shared.page.get_by_role("button", name="Orbit", exact=True).click()
    shared.seek(0)
    yield shared
    shared.check()


def column(result, name, time):
    return float(np.interp(time, result.time, result[name]))


def test_bodies_have_their_recorded_positions(opened, flight_result):
    for time in (0.0, 3.21, 9.999, 14.505, 16.0):
        opened.seek(time)
        for number, body in enumerate(BODIES):
            position, orientation = opened.body(number)
            assert position == pytest.approx(
                [column(flight_result, f"{body}.position.{axis}", time) for axis in "xyz"], abs=2e-5
            )
            recorded = [
                column(flight_result, f"{body}.orientation.{part}", time) for part in "wxyz"
            ]
            assert abs(np.dot(orientation, recorded)) == pytest.approx(1.0, abs=1e-5)


def test_scrubber_keys_and_plots_change_the_time(opened, flight_result):
    box = opened.page.locator(".scrubber").bounding_box()
    opened.page.mouse.click(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    assert opened.time == pytest.approx(8.0, abs=0.1)
    opened.page.keyboard.press("ArrowRight")
    opened.page.keyboard.press("Shift+ArrowRight")
    assert opened.time == pytest.approx(9.1, abs=0.1)
    over = opened.page.locator(".u-over").first
    over.click(position={"x": over.bounding_box()["width"] / 4, "y": 20})
    assert opened.time == pytest.approx(4.0, abs=0.1)
    assert opened.page.locator(".clock b").inner_text() == f"{opened.time:.2f}"
    altitude = flight_result["plant.uav.position.z"][
        np.searchsorted(flight_result.time, opened.time, side="right") - 1
    ]
    assert opened.page.locator(".plot b").first.inner_text() == f"{altitude:.4g} m"


def test_the_view_from_above_shows_paths_waypoints_and_present_positions(opened, flight_result):
    """The dots move with the time, east to the right and north upwards, by the same scale."""
    dots = (
        "cosimReplay.above.dots.map((dot) => dot.transform.baseVal[0].matrix).map(({e, f}) => [e, "
        "f])"
    )
    before = opened(dots)
    opened.seek(9.5)
    scale, moved = opened("cosimReplay.above.scale"), np.array(opened(dots)) - before
    assert len(moved) == len(BODIES)
    for body, (right, down) in zip(BODIES, moved, strict=True):
        east, north = (
            column(flight_result, f"{body}.position.{axis}", 9.5)
            - flight_result[f"{body}.position.{axis}"][0]
            for axis in "xy"
        )
        assert (right / scale, -down / scale) == pytest.approx((east, north), abs=0.02)
        assert abs(east) > 1
    assert opened.page.locator(".above .path").count() == 2
    assert opened.page.locator(".above .waypoint").count() == 5
    assert opened.page.locator(".above figcaption span").all_inner_texts() == [
        "uav",
        "usv",
        "waypoints",
    ]


def test_a_legend_names_the_lines_on_the_slider_and_the_speed_is_that_of_the_replay(opened):
    assert opened.page.locator(".bar .legend").inner_text().split() == [
        "On",
        "the",
        "slider:",
        "uav",
        "touches",
    ]
    assert opened.page.get_by_label("Replay speed", exact=True).input_value() == "1"


def test_the_space_bar_plays_at_once_whatever_was_clicked(open_page, shared):
    fresh = open_page(Path(shared.url.removeprefix("file://")))
    fresh.page.keyboard.press("Space")
    fresh.until("cosimReplay.player.playing && cosimReplay.player.time > 0")
    fresh.page.get_by_role("button", name="Chase", exact=True).click()
    fresh.page.keyboard.press("Space")
    assert fresh("!cosimReplay.player.playing && cosimReplay.view.cameras.mode === 'chase'")


def scale(opened, axis="x"):
    return opened(
        f"cosimReplay.plots.list.map(({{chart}}) => [chart.scales.{axis}.min, "
        f"chart.scales.{axis}.max])"
    )


def test_plots_are_zoomed_and_panned_by_pointer_and_buttons(opened):
    """Dragging from a quarter to a half of a plot shows this part of the time in all plots."""
    over = opened.page.locator(".u-over").first
    over.scroll_into_view_if_needed()
    box = over.bounding_box()

    def drag(first, last):
        opened.page.mouse.move(box["x"] + first * box["width"], box["y"] + 20)
        opened.page.mouse.down()
        opened.page.mouse.move(box["x"] + last * box["width"], box["y"] + 25, steps=3)
        opened.page.mouse.up()

    drag(0.25, 0.5)
    assert np.array(scale(opened)) == pytest.approx(
        np.tile([4.0, 8.0], (len(scale(opened)), 1)), abs=0.1
    )
    opened.page.keyboard.down("Shift")
    drag(0.75, 0.5)
    opened.page.keyboard.up("Shift")
    assert scale(opened)[0] == pytest.approx([5.0, 9.0], abs=0.15)
    over.dblclick(position={"x": 5, "y": 20})
    assert scale(opened)[-1] == [0, 16]
    opened.seek(8)
    for button, expected in (
        ("Zoom in", [4, 12]),
        ("Later", [6, 14]),
        ("Later", [8, 16]),
        ("Later", [8, 16]),
        ("All", [0, 16]),
    ):
        opened.page.get_by_role("button", name=button, exact=True).click()
        assert scale(opened)[0] == expected


def test_a_change_of_theme_keeps_cursors_and_zoom(opened):
    opened.seek(4)
    opened("cosimReplay.plots.look([2, 10])")
    cursors = "[...document.querySelectorAll('.plot .now')].map((line) => line.style.transform)"
    opened.page.wait_for_timeout(50)
    before = opened(cursors)
    opened.page.locator("[data-toggle-theme]").click()
    opened.page.wait_for_timeout(50)
    assert opened(cursors) == before
    assert scale(opened)[0] == [2, 10]
    opened.page.locator("[data-toggle-theme]").click()
    opened("cosimReplay.plots.look(null)")


def test_axes_have_units_and_angles_have_no_jumps(open_page, tmp_path):
    time = np.linspace(0, 20, 401)
    turned = np.pi - 0.9 * time
    columns = {"yaw": np.arctan2(np.sin(turned), np.cos(turned)), "rest": np.zeros(401)}
    result = Result(
        Recording(time, columns, {"yaw": "rad", "rest": "m"}), metadata={"name": "turns"}
    )
    write_replay([result], tmp_path / "turns.html")
    opened = open_page(tmp_path / "turns.html")
    charts = "cosimReplay.plots.list.map(({chart}) => chart.axes.map((axis) => axis.label))"
    assert ["time (s)", "rad"] in opened(charts)
    opened.seek(20)
    assert float(
        opened.page.locator(".plot b").first.inner_text().removesuffix(" rad")
    ) == pytest.approx(turned[-1], abs=0.01)
    low, _ = scale(opened, "y")[0]
    assert low < turned[-1]


def test_it_plays_at_its_speed_to_the_end_and_restarts(opened):
    opened.page.select_option(".speed", "8")
    opened.seek(12.0)
    opened.page.click(".play")
    opened.until("!cosimReplay.player.playing")
    assert opened.time == 16.0
    opened.page.click(".play")
    opened.until("cosimReplay.player.time > 0 && cosimReplay.player.time < 16")
    opened.page.click(".play")
    assert opened("!cosimReplay.player.playing")


def test_cameras_show_their_targets(opened):
    camera = "cosimReplay.view.cameras.camera"
    opened.page.get_by_role("button", name="uav", exact=True).click()
    distances = []
    for time in (2.0, 9.0):
        opened.seek(time)
        distances.append(
            opened(f"{camera}.position.distanceTo(cosimReplay.view.actors[0].object.position)")
        )
    assert distances[0] == pytest.approx(distances[1], abs=1e-6)
    opened.page.get_by_role("button", name="Deck", exact=True).click()
    vessel = "cosimReplay.view.actors[1].object"
    on_board = f"{vessel}.worldToLocal({camera}.position.clone()).toArray()"
    assert opened(on_board) == pytest.approx([-2.6, 0.0, 1.5], abs=1e-4)
    opened.page.get_by_role("button", name="Top", exact=True).click()
    assert opened(f"{camera}.getWorldDirection({camera}.position.clone()).z") < -0.999


def test_trails_end_at_the_bodies_and_follow_their_paths(opened, flight_result):
    for number, body in enumerate(BODIES):
        trail = f"cosimReplay.view.actors[{number}].trail"
        drawn = np.array(opened(f"{trail}.points.map((point) => point.toArray())"))
        assert 10 < len(drawn) < 300
        recorded = np.column_stack([flight_result[f"{body}.position.{axis}"] for axis in "xyz"])
        assert np.linalg.norm(recorded - nearest(drawn, recorded), axis=1).max() < 0.005
        lengths = []
        for time in (4.0, 4.1, 8.0, 16.0):
            opened.seek(time)
            lengths.append(opened(f"{trail}.past.geometry.instanceCount"))
            ends = f"{trail}.past.geometry.attributes.instanceEnd"
            end = [opened(f"{ends}.get{axis}({lengths[-1] - 1})") for axis in "XYZ"]
            assert end == pytest.approx(opened.body(number)[0], abs=1e-6)
        assert lengths == sorted(lengths)
        assert lengths[-1] == len(drawn) - 1


def nearest(path, places):
    """The points of a path of straight pieces that are nearest to some places."""
    starts, steps = path[:-1], np.diff(path, axis=0)
    along = np.einsum("psi,si->ps", places[:, None] - starts, steps) / np.maximum(
        np.sum(steps**2, axis=1), 1e-12
    )
    feet = starts + np.clip(along, 0, 1)[..., None] * steps
    return feet[
        np.arange(len(places)), np.argmin(np.linalg.norm(feet - places[:, None], axis=2), axis=1)
    ]


def test_ghosts_can_be_switched_on(opened):
    opened.seek(8.0)
    opened.page.get_by_role("button", name="Ghosts").click()
    assert opened("cosimReplay.view.actors[0].ghosts.mesh.visible")
    assert opened("cosimReplay.view.actors[0].ghosts.mesh.count") == 9  # one a second
    opened.page.get_by_role("button", name="Ghosts").click()


def test_something_is_drawn(opened):
    """The deck is grey, the water beside the vessel blue, and the shore behind it green."""
    opened.page.click("text=usv")
    colours = opened(
        """() => { const {view} = cosimReplay, gl = view.renderer.getContext();
        const pixel = new Uint8Array(4);
        const centre = view.actors[1].object.position.clone().setZ(0.27);
        const {x, y} = centre.project(view.cameras.camera);
        view.show("trails", false);
        view.renderer.render(view.scene, view.cameras.camera);
        view.show("trails", true);
        const {drawingBufferWidth: width, drawingBufferHeight: height} = gl;
        return [[0.5 + 0.5 * x, 0.5 + 0.5 * y], [0.97, 0.4], [0.03, 0.9]].map(([right, up]) => {
          gl.readPixels(width * right, height * up, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
          return [...pixel.slice(0, 3)]; }); }"""
    )
    deck, water, trees = np.array(colours, float)
    assert np.ptp(deck) < 30
    assert water[2] > water[0] + 30
    assert trees[1] > max(trees[0], trees[2]) + 10


def test_the_vehicles_are_large_at_the_start_and_stay_in_the_picture(opened):
    """The camera of the start follows all vehicles; the vessel is at least a tenth as wide as the
    picture.
    """
    opened.page.get_by_role("button", name="Group", exact=True).click()
    camera = "cosimReplay.view.cameras.camera"
    project = (
        f"({{object: {{position}}}}) => position.clone().project({camera}).toArray().slice(0, 2)"
    )
    width = f"2 * Math.tan({camera}.fov * Math.PI / 360) * {camera}.aspect"
    vessel = "cosimReplay.view.actors[1]"
    for time in (0.0, 4.0, 8.0, 16.0):
        opened.seek(time)
        assert np.abs(opened(f"cosimReplay.view.actors.map({project})")).max() < 0.95
        assert (
            opened(
                f"2 * {vessel}.reach / ({vessel}.position.distanceTo({camera}.position) * {width})"
            )
            > 0.1
        )


ENVIRONMENT = {
    "seed": 5,
    "waves": {"spectrum": "jonswap", "significant_height": 0.3, "peak_period": 3.0, "spreading": 2},
}


@pytest.fixture(scope="module")
def compared(open_page, flight_result, tmp_path_factory):
    """The flight as if on a rough sea, and over it the same one metre higher."""
    scenario = deepcopy(flight_result.metadata["scenario"])
    scenario["components"]["plant"]["arguments"]["environment"] = ENVIRONMENT
    rough = replace(flight_result, metadata={**flight_result.metadata, "scenario": scenario})
    moved = {
        **flight_result.recording.columns,
        "plant.uav.position.z": flight_result["plant.uav.position.z"] + 1.0,
    }
    higher = replace(flight_result, recording=replace(flight_result.recording, columns=moved))
    file = tmp_path_factory.mktemp("compared") / "two.html"
    write_replay([rough, higher], file)
    return open_page(file)


def test_a_second_run_is_shown_with_the_first(compared):
    compared.seek(5.0)
    first, second = compared.body(0)[0], compared.body(2)[0]
    assert np.subtract(second, first) == pytest.approx([0, 0, 1], abs=1e-5)
    one, two = compared.page.locator(".plot b").first.inner_text().removesuffix(" m").split(" | ")
    assert float(two) == pytest.approx(float(one) + 1, abs=2e-3)


def test_the_water_has_the_waves_of_the_run(compared):
    for x, y, time in ((0.0, 0.0, 0.0), (3.0, -2.0, 7.5), (-4.0, 5.0, 16.0)):
        compared.seek(time)
        assert compared(f"cosimReplay.view.water.height({x}, {y})") == pytest.approx(
            sea(ENVIRONMENT).elevation(x, y, time), abs=1e-6
        )


NUMBERS = {
    "tiny": (0.0, 3e-4, ["0", "0.0001", "0.0002", "0.0003"]),
    "near": (999_950.0, 1_000_050.0, ["999950", "1000000", "1000050"]),
    "huge": (-3.7e15, 3.7e15, ["-2.5e+15", "0", "2.5e+15"]),
    "usual": (-4.0, 4.0, ["-2.5", "0", "2.5"]),
}


def test_tick_labels_are_complete_and_without_a_unit_there_is_no_label(open_page, tmp_path):
    time = np.linspace(0, 5, 101)
    columns = {
        name: low + (high - low) * np.sin(time) ** 2 for name, (low, high, _) in NUMBERS.items()
    }
    write_replay(
        [Result(Recording(time, columns, {}), metadata={"name": "numbers"})],
        tmp_path / "numbers.html",
    )
    opened = open_page(tmp_path / "numbers.html")
    for name, (_, _, texts) in NUMBERS.items():
        opened(f"cosimReplay.plots.add(['{name}'])")
        chart = "cosimReplay.plots.list.at(-1).chart"
        opened.until(f"{chart}.axes[1]._values?.length > 0")
        assert opened(f"[{chart}.axes[1]._values, {chart}.axes[1].label]") == [texts, ""]
        widths = opened(
            f"{chart}.axes[1]._values.map((text) => {chart}.ctx.measureText(text).width)"
        )
        assert opened(f"{chart}.axes[1]._size") > max(widths) + 5


def test_the_diagram_of_one_component_is_as_large_as_its_texts(open_page, flight_result, tmp_path):
    box = {"name": "alone", "origin": "alone.fmu", "inputs": 0, "outputs": 1, "period": None}
    system = {"components": [box], "stages": [["alone"]], "connections": []}
    write_report(
        replace(flight_result, metadata={"name": "alone", "system": system}),
        [],
        [],
        tmp_path / "report.html",
    )
    rectangle = open_page(tmp_path / "report.html").page.locator(".diagram .box").bounding_box()
    assert rectangle["width"] == pytest.approx(WIDTH, abs=2)


def test_the_report_of_a_failed_run_opens_before_the_failure(open_page, flight_result, tmp_path):
    write_report(
        replace(flight_result, metadata={"failure": "usv: stopped"}),
        [],
        [],
        tmp_path / "report.html",
    )
    opened = open_page(tmp_path / "report.html")
    assert opened.time == 14
    assert [mark.get_attribute("title") for mark in opened.page.locator(".spans b").all()] == [
        "failure at 16.00 s"
    ]


def test_the_report_escapes_texts_of_the_scenario(open_page, flight_result, tmp_path):
    evil = (
        "</script><script>window.caught = true</script><img src=x onerror='window.caught = true'>"
    )
    result = replace(
        flight_result,
        metadata={"scenario": {"description": evil}, "name": evil, "warnings": [evil]},
    )
    write_report(result, [], [], tmp_path / "report.html")
    opened = open_page(tmp_path / "report.html")
    assert opened("window.caught === undefined")
    assert opened.page.locator("h1").inner_text() == evil
    assert opened.page.locator(".warnings li").inner_text() == evil


def test_a_result_without_a_scene_shows_its_signals(open_page, flight_result, tmp_path):
    write_replay([replace(flight_result, metadata={"name": "numbers"})], tmp_path / "numbers.html")
    opened = open_page(tmp_path / "numbers.html")
    assert opened.page.locator("canvas[aria-label='3-D replay']").count() == 0
    assert opened.page.locator(".plot").count() == 6
    opened.page.locator(".add input").fill("plant.usv.position.*")
    opened.page.keyboard.press("Enter")
    assert opened.page.locator(".plot").nth(6).locator("figcaption span").count() == 3


@pytest.fixture(scope="module")
def fallen(open_page, flight_result, tmp_path_factory):
    """The replay of the flight of which the quadcopter falls through the sea, from t = 10 s on."""
    time, columns = flight_result.time, dict(flight_result.recording.columns)
    late = time >= 10
    columns["plant.uav.position.z"] = np.where(
        late, -4664.0 * (time - 10) / (time[-1] - 10), columns["plant.uav.position.z"]
    )
    columns["plant.uav.ditched"] = late
    fall = replace(flight_result, recording=replace(flight_result.recording, columns=columns))
    file = tmp_path_factory.mktemp("fall") / "replay.html"
    write_replay([fall], file)
    return open_page(file)


def test_a_failure_is_a_mark_on_the_slider_in_the_plots_and_in_the_scene(fallen):
    assert [mark.get_attribute("title") for mark in fallen.page.locator(".spans b").all()] == [
        "uav ditched at 10.00 s"
    ]
    line = fallen.page.locator(".plot").first.locator(".mark")
    assert line.get_attribute("title") == "uav ditched at 10.00 s"
    assert line.evaluate("(element) => element.offsetWidth") <= 2  # pixels: a straight line
    crosses = (
        "cosimReplay.view.actors.flatMap((actor) => actor.crosses.map((cross) => "
        "cross.object.visible))"
    )
    fallen.seek(9.9)
    assert fallen(crosses) == [False]
    fallen.seek(10.1)
    assert fallen(crosses) == [True]


def test_the_camera_shows_the_mission_whatever_falls(fallen, opened):
    assert fallen("cosimReplay.view.cameras.size") == pytest.approx(
        opened("cosimReplay.view.cameras.size"), rel=0.3
    )
