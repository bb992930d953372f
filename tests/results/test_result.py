"""Results: access to signals, text representation, files."""

import json
import math
from pathlib import Path

import numpy as np
import pytest

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import Kpis, Result, write_run
from cosim.results.checks import evaluate_all_checks


@pytest.fixture
def result():
    columns = {
        "plant.uav.position.x": np.array([0.0, 1.0]),
        "plant.uav.position.z": np.array([0.5, 2.0]),
        "plant.usv.position.x": np.array([0.0, 0.1]),
        "uav.rotor_speed[1]": np.array([0.0, 340.0]),
        "uav.rotor_speed[10]": np.array([0.0, 341.0]),
    }
    return Result(Recording(np.array([0.0, 0.01]), columns, {"plant.uav.position.x": "m"}))


def test_signals_are_found_by_name(result):
    assert result["plant.uav.position.z"].tolist() == [0.5, 2.0]
    assert result.time.tolist() == [0.0, 0.01]
    assert result.units["plant.uav.position.x"] == "m"
    assert "plant.uav.position.z" in result
    assert len(result) == 5


def test_an_unknown_signal_names_the_nearest(result):
    with pytest.raises(
        InputError,
        match=r'^no signal "plant.uav.positon.z" was.*; did you mean "plant.uav.position.z"\?$',
    ):
        result["plant.uav.positon.z"]


def test_an_unknown_signal_is_a_key_error_too(result):
    with pytest.raises(KeyError):
        result["wind"]
    assert "wind" not in result


def test_the_time_as_signal_is_refused_with_a_hint(result):
    with pytest.raises(InputError, match=r"the time of each row is in `result.time`$"):
        result["time"]


def test_an_unknown_kpi_names_the_nearest_or_all():
    with pytest.raises(
        KeyError, match=r'^no KPI "landing.tme" was computed; did you mean "landing.time"\?$'
    ):
        Kpis({"landing.time": 14.5})["landing.tme"]
    many = Kpis({f"{name}.{i}": 1.0 for name in ("landing", "waypoints") for i in range(8)})
    with pytest.raises(
        KeyError, match=r'^no KPI "speed.value" was computed; valid: landing\.\*, waypoints\.\*$'
    ):
        many["speed.value"]


@pytest.mark.parametrize(
    ("pattern", "places"),
    [
        ("*", [0, 1, 2, 3, 4]),
        ("plant.*.x", [0, 2]),
        ("plant.uav.*", [0, 1]),
        ("uav.rotor_speed[*]", [3, 4]),
        ("uav.rotor_speed[1]", [3]),
        ("*position*", [0, 1, 2]),
        ("position", []),
        ("plant.uav.position.?", []),
    ],
)
def test_a_star_matches_dots_and_brackets(result, pattern, places):
    assert result.signals(pattern) == [list(result)[place] for place in places]


def test_repr_shows_name_size_failure_and_kpis(result):
    assert repr(result) == "Result: 2 rows of 5 signals, 0 s to 0.01 s"
    kpis = {"landing.lateral_error": 0.05, "landing.landed_at_end": True, "landing.bounces": 2}
    about = {
        "name": "demo",
        "failure": "uav: fmi2DoStep failed",
        "kpi_units": {"landing.lateral_error": "m"},
    }
    assert repr(Result(result.recording, kpis, metadata=about)).splitlines() == [
        "demo: 2 rows of 5 signals, 0 s to 0.01 s",
        "ended early: uav: fmi2DoStep failed",
        "  landing.lateral_error  0.05 m",
        "  landing.landed_at_end  True",
        "  landing.bounces        2",
    ]
    checks = evaluate_all_checks(
        kpis,
        [{"kpi": "landing.bounces", "max": 1}, {"kpi": "landing.landed_at_end", "equals": True}],
    )
    units = {"landing.bounces": "m", "landing.landed_at_end": "1"}
    assert repr(
        Result(result.recording, checks=checks, metadata={"kpi_units": units})
    ).splitlines()[1:] == [
        "1 of 2 checks passed:",
        "  landing.bounces is 2 m, expected at most 1 m",
    ]
    assert repr(Result(Recording.empty())) == "Result: 0 rows of 0 signals"


def test_csv_keeps_every_signal(result, tmp_path):
    result.to_csv(tmp_path / "result.csv")
    returned = Result.from_csv(str(tmp_path / "result.csv"))
    assert list(returned) == list(result)
    assert all(np.array_equal(returned[name], result[name]) for name in result)
    assert np.array_equal(returned.time, result.time)


def test_write_run_writes_three_files(result, tmp_path):
    kpis = {
        "landing.lateral_error": 0.05,
        "landing.slide": math.nan,
        "landing.landed_at_end": True,
        "landing.bounces": 2,
    }
    metadata = {
        "name": "demo",
        "seeds": np.array([1, 2]),
        "limit": np.float64(math.inf),
        "scenario": Path("a/b.json"),
    }
    write_run(
        Result(result.recording, kpis, {"loop_seconds": 0.5}, metadata), tmp_path / "runs" / "demo"
    )
    folder = tmp_path / "runs" / "demo"
    assert sorted(path.name for path in folder.iterdir()) == ["kpis.json", "result.csv", "run.json"]
    assert (folder / "kpis.json").read_text() == (
        '{\n  "landing.lateral_error": 0.05,\n  "landing.slide": null,\n'
        '  "landing.landed_at_end": true,\n  "landing.bounces": 2\n}\n'
    )
    run = json.loads((folder / "run.json").read_text())
    assert run.pop("units") == result.recording.units
    assert run == {
        "name": "demo",
        "seeds": [1, 2],
        "limit": None,
        "scenario": "a/b.json",
        "timing": {"loop_seconds": 0.5},
    }
