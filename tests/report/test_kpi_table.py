"""The table of KPIs and checks at the end of a run."""

import io
import math

import pytest

from cosim.report.tables import format_number, print_kpis
from cosim.results.checks import evaluate_checks

KPIS = {
    "landing.lateral_error": 0.0868369,
    "landing.landed_at_end": True,
    "waypoints.time[1]": math.nan,
    "landing.bounces": 2,
}
UNITS = {"landing.lateral_error": "m", "waypoints.time[1]": "s"}


def printed(*arguments, encoding="utf-8"):
    file = io.TextIOWrapper(io.BytesIO(), encoding=encoding)
    print_kpis(*arguments, file=file)
    file.flush()
    return file.buffer.getvalue().decode(encoding)


def row(text, name):
    (line,) = [line for line in text.splitlines() if line.startswith(name)]
    return line.split()[1:]


def test_values_have_their_units():
    text = printed(KPIS, [], UNITS)
    assert row(text, "landing.lateral_error") == ["0.08684", "m"]
    assert row(text, "landing.landed_at_end") == ["yes"]
    assert row(text, "waypoints.time[1]") == ["-", "s"]
    assert row(text, "landing.bounces") == ["2"]


def test_checks_are_in_the_row_of_their_kpi():
    checks = [
        {"kpi": "landing.lateral_error", "max": 0.1},
        {"kpi": "landing.landed_at_end", "equals": False},
    ]
    text = printed(KPIS, evaluate_checks(KPIS, checks), UNITS)
    assert row(text, "landing.lateral_error") == ["0.08684", "m", "max", "0.1", "✓"]
    assert row(text, "landing.landed_at_end") == ["yes", "equals", "false", "✗", "failed"]
    assert row(text, "landing.bounces") == ["2"]


def test_two_checks_of_one_kpi_have_a_line_each():
    checks = [{"kpi": "landing.bounces", "max": 3}, {"kpi": "landing.bounces", "min": 3}]
    lines = printed(KPIS, evaluate_checks(KPIS, checks)).splitlines()
    (place,) = [i for i, line in enumerate(lines) if line.startswith("landing.bounces")]
    assert lines[place].split()[2:] == ["max", "3", "✓"]
    assert lines[place + 1].split() == ["min", "3", "✗", "failed"]


def test_output_to_a_file_has_no_colours_and_complete_names():
    name = "landing." + "very_" * 30 + "long_name"
    text = printed({name: 1.0})
    assert name in text
    assert "\x1b" not in text


def test_an_ascii_terminal_shows_words_instead_of_marks():
    text = printed(
        KPIS, evaluate_checks(KPIS, [{"kpi": "landing.bounces", "max": 3}]), encoding="ascii"
    )
    assert text.isascii()
    assert "ok" in text


@pytest.mark.parametrize(("no_color", "coloured"), [("", True), ("1", False)])
def test_no_color_is_respected(monkeypatch, no_color, coloured):
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("NO_COLOR", no_color)
    text = printed(KPIS, evaluate_checks(KPIS, [{"kpi": "landing.bounces", "max": 3}]))
    assert ("\x1b[32m" in text) is coloured


def test_without_kpis_there_is_no_table():
    assert printed({}) == ""


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.1234567, "0.1235"),
        (12345.678, "1.235e+04"),
        (1e-9, "1e-09"),
        (False, "no"),
        (7, "7"),
        (math.inf, "inf"),
    ],
)
def test_numbers_have_four_significant_digits(value, text):
    assert format_number(value) == text
