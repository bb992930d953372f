"""Figure files: reproducible bytes, a common style, and errors that name the figure."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

from cosim.core.errors import ComponentError, InputError
from cosim.core.recording import Recording
from cosim.report.figures import STYLE, draw_figure, draw_figures, save_figure
from cosim.results import Result

TIME = np.arange(200) / 100
BOTH = (".png", ".svg")
RESULT = Result(Recording(TIME, {"x": np.sin(TIME)}, {"x": "m"}))
PNG = b"\x89PNG\r\n\x1a\n"


def curve(result, signal):
    figure = Figure()
    axes = figure.add_subplot(xlabel="t / s", ylabel=signal)
    axes.plot(result.time, result[signal], "--", label=signal)
    axes.legend()
    return figure


def test_each_figure_is_a_png_and_an_svg(tmp_path):
    files = draw_figures(RESULT, [("curve", curve, {"signal": "x"})], tmp_path / "run", BOTH)
    assert [file.name for file in files] == ["curve.png", "curve.svg"]
    assert sorted((tmp_path / "run").iterdir()) == files
    assert files[0].read_bytes().startswith(PNG)
    assert files[1].read_text().startswith("<?xml")


FRESH = """
import hashlib, json, pathlib, sys
sys.path.insert(0, {tests!r})
import matplotlib
matplotlib.rcParams.update({{"lines.linewidth": 7, "axes.facecolor": "red", "savefig.dpi": 30}})
from test_figure_files import RESULT, curve
from cosim.report.figures import draw_figures
files = draw_figures(RESULT, [("curve", curve, {{"signal": "x"}})], {folder!r}, (".png", ".svg"))
print(json.dumps([hashlib.sha256(file.read_bytes()).hexdigest() for file in files]))
print("matplotlib.pyplot" in sys.modules)
"""


def test_another_process_with_other_settings_writes_the_same_bytes_without_pyplot(tmp_path):
    here = draw_figures(RESULT, [("curve", curve, {"signal": "x"})], tmp_path / "here", BOTH)
    script = FRESH.format(tests=str(Path(__file__).parent), folder=str(tmp_path / "there"))
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    hashes, pyplot = run.stdout.split("\n")[:2]
    assert json.loads(hashes) == [hashlib.sha256(file.read_bytes()).hexdigest() for file in here]
    assert pyplot == "False"


def test_files_contain_neither_date_nor_version(tmp_path):
    png, svg = draw_figures(RESULT, [("curve", curve, {"signal": "x"})], tmp_path, BOTH)
    assert b"Software" not in png.read_bytes()
    assert "<dc:date>" not in svg.read_text()
    assert matplotlib.__version__ not in svg.read_text()


def test_the_style_is_restored_after_drawing():
    before = dict(matplotlib.rcParams)
    figure = draw_figure(RESULT, "curve", curve, {"signal": "x"})
    assert figure.axes[0].xaxis.label.get_size() == STYLE["axes.labelsize"]
    assert figure.axes[0].lines[0].get_color().upper() in ("0072B2", "#0072B2")
    assert dict(matplotlib.rcParams) == before


def long_labels(_result, **figure_arguments):
    """A figure whose labels need more space than matplotlib's fixed margins."""
    figure = Figure(**figure_arguments)
    axes = figure.add_subplot(xlabel="t / s", ylabel="horizontal\nerror / m")
    axes.plot([0, 1], [1e-6, 1e-5])
    axes.yaxis.set_major_formatter("{x:.7f}")
    figure.colorbar(axes.imshow([[0, 1]], aspect="auto"), ax=axes, label="share")
    return figure


def test_labels_are_inside_of_a_figure_without_a_layout():
    figure = draw_figure(RESULT, "curve", long_labels, {})
    box, (width, height) = figure.get_tightbbox(), figure.get_size_inches()
    assert max(-box.x0, -box.y0, box.x1 - width, box.y1 - height) <= 0


@pytest.mark.filterwarnings("error")
def test_margins_of_a_figure_without_layout_remain():
    def wide(result):
        figure = long_labels(result, layout="none")
        figure.subplots_adjust(left=0.4)
        return figure

    assert draw_figure(RESULT, "wide", wide, {}).axes[0].get_position().x0 == pytest.approx(0.4)


@pytest.mark.filterwarnings("error")
def test_axes_at_a_position_of_their_own_keep_it():
    def picture(_result):
        figure = Figure()
        figure.add_axes((0.0, 0.0, 1.0, 1.0)).set_axis_off()
        return figure

    assert draw_figure(RESULT, "picture", picture, {}).axes[0].get_position().bounds == (
        0.0,
        0.0,
        1.0,
        1.0,
    )


def test_a_failing_figure_is_named():
    def broken(_result):
        raise ValueError("no such thing")

    with pytest.raises(
        ComponentError,
        match=(
            r'^figure "paths": broken failed: ValueError: no such thing '
            r"\(test_figure_files.py:[0-9]+\)$"
        ),
    ):
        draw_figure(RESULT, "paths", broken, {})


def test_wrong_arguments_are_refused():
    with pytest.raises(InputError, match=r'figure "curve": .*; did you mean "signal"\?'):
        draw_figure(RESULT, "curve", curve, {"signals": "x"})


def test_a_function_that_returns_no_figure_is_refused():
    with pytest.raises(
        ComponentError,
        match=r'figure "curve": .* returned NoneType, expected a matplotlib.figure.Figure',
    ):
        draw_figure(RESULT, "curve", lambda _result: None, {})


def test_a_failed_write_leaves_the_former_file(tmp_path):
    path = tmp_path / "curve.png"
    path.write_bytes(b"former")
    figure = draw_figure(RESULT, "curve", curve, {"signal": "x"})
    figure.axes[0].lines[0].set_linestyle((0, (1.0, -1.0, 0.0, 0.0)))
    with pytest.raises(ValueError, match="non-negative"):
        save_figure(figure, path)
    assert path.read_bytes() == b"former"
    assert list(tmp_path.iterdir()) == [path]


def test_matplotlib_is_imported_late():
    code = (
        "import sys, cosim.report.figures, cosim.report.tables; print({'matplotlib', 'rich'} & "
        "set(sys.modules))"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stdout == "set()\n"
