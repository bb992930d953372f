"""Results in notebooks: HTML of a cell, figures of signals, data frames."""

import re
from html import unescape

import pytest
from python_blocks import Gain, scenario

import cosim


@pytest.fixture(scope="module")
def flight():
    return cosim.run("demo1_box", stop_time=0.5)


def test_a_cell_shows_the_kpis_and_the_report_in_a_frame(flight):
    html = flight._repr_html_()
    assert "<td>motors.max_speed</td>" in html
    (frame,) = re.findall(r'<iframe sandbox="allow-scripts" style="[^"]*" srcdoc="([^"]*)">', html)
    page = unescape(frame)
    assert page.startswith("<!DOCTYPE html>") or page.startswith("<!doctype html>")
    assert "<svg" in page
    assert '"bodies"' in page


def test_texts_of_a_result_cannot_become_markup():
    result = cosim.run(scenario(description="<script>alert(1)</script>"))
    assert "<script>alert" not in unescape(result._repr_html_())


def test_a_failed_run_is_shown_with_its_failure():
    with pytest.raises(cosim.ComponentError) as error:
        cosim.run(scenario(events=[{"time": 0.5, "set": {"g.k": -2.0}}]))
    assert "ended early: g: do_step failed at t = 0.5 s" in error.value.result._repr_html_()


def test_signals_are_drawn_by_unit(flight):
    figure = flight.plot("plant.uav.position.*", "usv.thrust")
    assert [axes.get_ylabel() for axes in figure.axes] == ["m", "N"]
    assert [line.get_label() for line in figure.axes[0].lines] == [
        f"plant.uav.position.{axis}" for axis in "xyz"
    ]
    assert figure._repr_svg_().startswith("<?xml")


@pytest.mark.parametrize(
    ("names", "line"),
    [
        (
            ["plant.uav.positon.z"],
            'no signal "plant.uav.positon.z" was recorded; did you mean "plant.uav.position.z"?',
        ),
        ([3], "expected names of signals, found 3"),
        ([], "expected 1 to 12 signals, found 0"),
        (["*"], "expected 1 to 12 signals, found 9"),
    ],
)
def test_what_cannot_be_drawn_is_refused(flight, names, line):
    with pytest.raises(cosim.InputError) as error:
        flight.plot(*names)
    assert str(error.value).startswith(line)


def test_a_data_frame_has_a_column_for_each_signal(flight):
    pytest.importorskip("pandas")
    frame = flight.to_dataframe()
    assert frame.shape == (51, len(flight))
    assert frame.index.name == "time"
    assert (
        frame["plant.uav.position.z"].to_numpy().tobytes()
        == flight["plant.uav.position.z"].tobytes()
    )
    assert frame.attrs["units"]["plant.uav.position.z"] == "m"


def test_without_pandas_the_error_names_the_extra(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(cosim.InputError, match=r"pip install \"fmi-cosim\[dataframe\]\""):
        cosim.run(scenario(Gain)).to_dataframe()
