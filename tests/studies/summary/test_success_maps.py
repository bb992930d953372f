"""Success maps: cells from known runs, figures, and invalid maps."""

import json
import math
import re
from itertools import combinations

import pytest
from matplotlib import colormaps
from matplotlib.colors import to_hex
from matplotlib.patches import Rectangle
from matplotlib.text import Text

from cosim.core.errors import InputError
from cosim.report.figures import figure_style, figure_to_svg
from cosim.studies.execution.job import Record
from cosim.studies.summary.statistics import wilson_interval
from cosim.studies.summary.success_map import success_maps
from cosim.studies.summary.success_map_figure import draw_map
from cosim.studies.sweep import Sweep, SweepRow

SPEED = {"name": "speed", "set": "usv.speed_command", "values": [0.5, 1.0]}
CONTROLLER = {"name": "controller", "levels": {"old": {}, "new": {"uav.vtol.landing_time": 8.0}}}
SEEDS = {"set": "/components/plant/arguments/environment/seed", "count": 3}
LIMIT = {"kpi": "landing.lateral_error", "max": 0.1}


def sweep_of(folder, **more):
    content = {
        "name": "s",
        "scenario": "demo1_box",
        "factors": [CONTROLLER, SPEED],
        "seeds": SEEDS,
        "success": [LIMIT],
    }
    content = {**content, "maps": [{"x": "speed", "y": "controller"}], **more}
    (folder / "s.json").write_text(json.dumps(content))
    return Sweep.from_file(folder / "s.json")


def rows(sweep, errors):
    """Yield runs with these lateral errors; None is a run that crashed."""
    for run, error in errors.items():
        record = Record(
            str(run),
            {} if error is None else {"landing.lateral_error": error},
            "crashed" if error is None else "",
        )
        yield SweepRow(run, sweep.design[run], record, error is not None and error <= 0.1)


#: lateral errors of the runs of (old, 0.5), (old, 1.0) and (new, 0.5); those of (new, 1.0) are
#: missing
ERRORS = {0: 0.03, 1: 0.01, 2: 0.02, 3: 0.05, 4: 0.3, 5: None, 6: 0.2, 7: 0.2, 8: 0.4}


@pytest.fixture
def success_map(tmp_path):
    sweep = sweep_of(tmp_path)
    (found,) = success_maps(sweep, rows(sweep, ERRORS))
    return found


def test_success_rates_are_those_of_the_runs_of_a_cell(success_map):
    shares = {
        (*cell.labels.values(),): (cell.passed, len(cell.runs))
        for cell in success_map.cells.values()
    }
    assert shares == {
        ("old", 0.5): (3, 3),
        ("old", 1.0): (1, 3),
        ("new", 0.5): (0, 3),
        ("new", 1.0): (0, 0),
    }
    assert math.isnan(success_map.cell(None, None, "new", 1.0).success_rate)


def test_the_first_unsuccessful_run_represents_a_cell(success_map):
    cell = success_map.cell(None, None, "old", 1.0)
    assert (cell.representative_run.number, cell.selection_reason) == (
        4,
        "the first unsuccessful run",
    )


def test_the_median_run_represents_a_cell_with_only_successes(success_map):
    cell = success_map.cell(None, None, "old", 0.5)
    assert (cell.representative_run.number, cell.selection_reason) == (
        2,
        "the median of landing.lateral_error",
    )


def test_a_cell_without_runs_has_no_representative_run(success_map):
    assert success_map.cell(None, None, "new", 1.0).representative_run is None


def test_panels_show_the_levels_of_further_factors(tmp_path):
    sweep = sweep_of(
        tmp_path,
        maps=[{"x": "speed", "y": "seed", "columns": "controller"}, {"x": "seed", "y": "speed"}],
    )
    panels, flat = success_maps(sweep, rows(sweep, ERRORS))
    assert [each.name for each in (panels, flat)] == ["success_map_1", "success_map_2"]
    assert panels.axis_labels("seed") == [1, 2, 3]
    assert [run.number for run in panels.cell(None, "old", 2, 1.0).runs] == [4]
    assert [run.number for run in flat.cell(None, None, 0.5, 3).runs] == [2, 8]


def test_a_shared_run_counts_once_in_intervals(tmp_path):
    twice = {"one": {"uav.vtol.landing_time": 8.0}, "other": {"uav.vtol.landing_time": 8.0}}
    more = {"name": "more", "levels": twice}
    factors = [SPEED, CONTROLLER | {"levels": {"old": {}}}, more]
    sweep = sweep_of(tmp_path, factors=factors, seeds=None)
    (found,) = success_maps(sweep, rows(sweep, {0: 0.01, 1: 0.01}))
    cell = found.cell(None, None, "old", 0.5)
    assert (cell.success_rate, cell.interval) == (1.0, wilson_interval(1, 1))


def test_levels_that_are_none_or_equal_in_python_have_separate_cells(tmp_path):
    speeds = SPEED | {"set": "/components/usv/period", "values": [None, 1, 1.0]}
    sweep = sweep_of(tmp_path, factors=[CONTROLLER, speeds], seeds=None)
    (found,) = success_maps(sweep, rows(sweep, dict(enumerate([0.1, 0.2, 0.3]))))
    cells = [found.cell(None, None, "old", x) for x in found.axis_labels("speed")]
    for number, cell in enumerate(cells):
        assert [run.number for run in cell.runs] == [number]
    draw_map(found)


def squares(figure):
    """Return the colour of each cell of the first panel by its position."""
    patches = [patch for patch in figure.axes[0].patches if isinstance(patch, Rectangle)]
    return {
        (patch.get_x() + 0.5, patch.get_y() + 0.5): to_hex(patch.get_facecolor())
        for patch in patches
    }


def test_colours_show_the_success_rate_and_grey_a_cell_without_runs(success_map):
    colours = squares(draw_map(success_map))
    shades = colormaps["cividis"]
    assert colours == {
        (0, 0): to_hex(shades(1.0)),
        (1, 0): to_hex(shades(1 / 3)),
        (0, 1): to_hex(shades(0.0)),
        (1, 1): "#eeeeee",
    }


def test_cells_show_their_counts_and_confidence_intervals(success_map):
    texts = [text.get_text() for text in draw_map(success_map).axes[0].texts]
    assert texts == ["100 %", "3/3\n44–100 %", "33 %", "1/3\n6–79 %", "0 %", "0/3\n0–56 %"]


def test_small_cells_have_no_text(tmp_path):
    sweep = sweep_of(tmp_path, factors=[CONTROLLER, SPEED | {"values": list(range(60))}])
    (found,) = success_maps(sweep, rows(sweep, dict.fromkeys(range(len(sweep)), 0.01)))
    assert not draw_map(found).axes[0].texts


WORDS = {
    "name": "landing controller",
    "levels": {"inverse kinematics": {}, "incremental nonlinear dynamic inversion": {}},
}
STEPS = SPEED | {"values": [0.0137 * i for i in range(40)]}
MANY = {"name": "sensor", "levels": {f"sensor_number_{i}": {} for i in range(8)}}
WIDE = {"name": "WWWW", "levels": {"MMMM WWWW MMMM WWWW": {}, "iiiiiiiiii WWWWWWWWWWWWWW": {}}}
CROWDED = {
    "long names up": ([WORDS, SPEED], {"x": "speed", "y": "landing controller"}),
    "long names along": ([WORDS, SPEED], {"x": "landing controller", "y": "speed"}),
    "many numbers along": ([WORDS, STEPS], {"x": "speed", "y": "landing controller"}),
    "many numbers up": ([STEPS, MANY], {"x": "sensor", "y": "speed", "columns": "seed"}),
    "long names of columns": (
        [WORDS, SPEED],
        {"x": "speed", "y": "seed", "columns": "landing controller"},
    ),
    "long names of many columns": ([MANY, SPEED], {"x": "speed", "y": "seed", "columns": "sensor"}),
    "long names of rows": (
        [WORDS, SPEED],
        {"x": "speed", "y": "seed", "rows": "landing controller"},
    ),
    "wide letters": (
        [WIDE, SPEED],
        {"x": "speed", "y": "seed", "columns": "WWWW", "titles": {"speed": "WIND " * 10}},
    ),
    "long titles": (
        [WORDS, SPEED],
        {"x": "speed", "y": "landing controller", "titles": {"speed": "speed " * 12}},
    ),
}


@pytest.mark.parametrize("name", CROWDED)
def test_texts_are_inside_the_figure_and_do_not_overlap(tmp_path, name):
    factors, spec = CROWDED[name]
    (found,) = success_maps(sweep_of(tmp_path, factors=factors, maps=[spec]), [])
    with figure_style():
        figure = draw_map(found)
        figure.draw_without_rendering()
        texts = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
        places = {text: text.get_window_extent() for text in texts}
    for text, place in places.items():
        assert all(map(figure.bbox.containsx, (place.x0, place.x1))), text
        assert all(map(figure.bbox.containsy, (place.y0, place.y1))), text
    for (one, place), (other, other_place) in combinations(places.items(), 2):
        assert not place.overlaps(other_place), (one, other)


def test_cells_have_the_same_size_whatever_the_labels(tmp_path):
    for factors, spec in (
        CROWDED[name] for name in ("long names up", "long names along", "long titles")
    ):
        (found,) = success_maps(sweep_of(tmp_path, factors=factors, maps=[spec]), [])
        figure = draw_map(found)
        panel = figure.axes[0].get_position().size * figure.get_size_inches()
        assert panel == pytest.approx([2 * 0.9, 2 * 0.46], abs=0.02)


def test_in_svg_every_cell_with_a_run_is_a_link(success_map):
    text = figure_to_svg(
        draw_map(
            success_map,
            lambda cell: f"run-{cell.representative_run.number}" if cell.representative_run else "",
        )
    )
    assert re.findall('xlink:href="(run[^"]*)"', text) == ["run-2", "run-4", "run-6"]


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (
            {"maps": [{"x": "sped", "y": "controller"}]},
            ['"maps" names no factor with levels "sped"', 'did you mean "speed"?'],
        ),
        (
            {"maps": [{"x": "speed", "y": "speed"}]},
            ["$.maps[0]", 'two axes of a map are called "speed"'],
        ),
        (
            {"factors": [CONTROLLER, SPEED | {"values": [[1, 2]]}]},
            ['"maps" names no factor with levels "speed"'],
        ),
        ({"maps": [{"x": "speed"}]}, ["$.maps[0]", '"y"']),
        (
            {
                "factors": [
                    CONTROLLER,
                    {"name": "speed", "set": "a.b", "range": {"min": 0.0, "max": 1.0}},
                ],
                "design": {"kind": "sobol", "runs": 4},
            },
            ['"maps" names no factor with levels "speed"'],
        ),
    ],
)
def test_maps_of_factors_without_levels_are_refused(tmp_path, content, words):
    with pytest.raises(InputError) as refusal:
        sweep_of(tmp_path, **content)
    for word in words:
        assert word in str(refusal.value)
