"""Reading a results folder: the result and the figures of its scenario."""

import json

import numpy as np
import pytest

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.report.runs import load_figures, read_run
from cosim.results import Result, write_run

FIGURE = """
from matplotlib.figure import Figure

def curve(result, signal):
    figure = Figure()
    figure.add_subplot(xlabel="t / s", ylabel="x / m").plot(result.time, result[signal], label="x")
    return figure
"""


def write(folder, **metadata):
    """A run of a scenario in `folder`/scenario with one figure; returns the run's folder."""
    (folder / "scenario").mkdir()
    (folder / "scenario/own_figures.py").write_text(FIGURE)
    spec = {"name": "curve", "python": "own_figures.py:curve", "arguments": {"signal": "a.x"}}
    about = {
        "name": "small",
        "scenario": {"figures": [spec]},
        "scenario_file": str(folder / "scenario/small.json"),
        **metadata,
    }
    time = np.arange(3) / 2
    result = Result(
        Recording(time, {"a.x": time**2}, {"a.x": "m"}),
        {"end.x": 1.0},
        {"loop_seconds": 0.25},
        about,
    )
    write_run(result, folder / "run")
    return folder / "run"


def test_a_written_result_is_read_back(tmp_path):
    result = read_run(write(tmp_path))
    assert result["a.x"].tolist() == [0.0, 0.25, 1.0]
    assert result.kpis == {"end.x": 1.0}
    assert result.timing == {"loop_seconds": 0.25}
    assert result.metadata["name"] == "small"


def test_figure_functions_are_found_relative_to_the_scenario(tmp_path):
    result = read_run(write(tmp_path))
    ((name, function, arguments),) = load_figures(result)
    assert name == "curve"
    assert function(result, **arguments).axes[0].lines[0].get_ydata().tolist() == [0.0, 0.25, 1.0]


def test_a_run_without_figures_has_none(tmp_path):
    assert load_figures(read_run(write(tmp_path, scenario={}))) == []


def test_a_folder_without_a_run_is_refused(tmp_path):
    with pytest.raises(
        InputError, match=r"run\.json: No such file.*expected a folder that `cosim run` wrote"
    ):
        read_run(tmp_path)


def test_a_run_with_an_invalid_file_is_refused(tmp_path):
    run = write(tmp_path)
    (run / "run.json").write_text("{")
    with pytest.raises(InputError, match=r"run\.json is not valid JSON"):
        read_run(run)


@pytest.mark.parametrize("name", ["run.json", "kpis.json"])
@pytest.mark.parametrize("text", ["[" * 100_000, "[1]", "3", "\x00", '{"a": ' + "1" * 5000 + "}"])
def test_a_file_that_is_no_object_is_refused(tmp_path, name, text):
    run = write(tmp_path)
    (run / name).write_text(text)
    with pytest.raises(
        InputError, match=rf"{name} is not valid JSON: .*; expected a file that `cosim run` wrote"
    ):
        read_run(run)


@pytest.mark.parametrize("value", ["text", {"b": 1}, [1], 10**400])
def test_a_kpi_that_is_no_number_is_refused_with_its_line(tmp_path, value):
    run = write(tmp_path)
    (run / "kpis.json").write_text(json.dumps({"good": 1.5, "bad": value}, indent=2))
    with pytest.raises(
        InputError, match=r"kpis\.json:3:3: \$\.bad: expected a number, true, false or null; found"
    ):
        read_run(run)


DIAGRAM = {
    "components": [{"name": "a", "origin": "a.fmu", "inputs": 0, "outputs": 1, "period": None}],
    "connections": [],
}


@pytest.mark.parametrize(
    ("about", "place"),
    [
        ({"name": 3}, "name"),
        ({"timing": {"loop_seconds": "long"}}, "timing.loop_seconds"),
        ({"units": {"a.x": 1}}, r"units\[\"a\.x\"\]"),
        ({"scenario": []}, "scenario"),
        ({"scenario": {"checks": ["x"]}}, r"scenario\.checks\[0\]"),
        ({"scenario": {"checks": [{"max": 1}]}}, r"scenario\.checks\[0\]\.kpi"),
        (
            {"scenario": {"figures": [{"name": "a", "python": 1}]}},
            r"scenario\.figures\[0\]\.python",
        ),
        ({"scenario": {"components": {"a": 1}}}, r"scenario\.components\.a"),
        ({"system": {}}, "system"),
        ({"system": {**DIAGRAM, "stages": [["b"]]}}, "system"),
        (
            {"system": {**DIAGRAM, "stages": [["a"]], "connections": [["a.x"]]}},
            r"system\.connections\[0\]",
        ),
        ({"terminated_by": {"component": "a"}}, r"terminated_by\.time"),
        ({"real_time": {"steps": 1}}, r"real_time\.late_steps"),
        ({"warnings": [1]}, r"warnings\[0\]"),
    ],
)
def test_a_value_of_another_type_is_refused_with_its_line(tmp_path, about, place):
    run = write(tmp_path)
    former = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps({**former, **about}))
    with pytest.raises(InputError, match=rf"run\.json:1:\d+: \$\.{place}: ") as refusal:
        read_run(run)
    assert len(refusal.value.problems) >= 1


def test_a_run_with_an_unknown_scenario_file_is_refused(tmp_path):
    run = write(tmp_path)
    about = json.loads((run / "run.json").read_text())
    del about["scenario_file"]
    (run / "run.json").write_text(json.dumps(about))
    with pytest.raises(InputError, match="run the scenario again"):
        load_figures(read_run(run))


def test_a_run_with_a_missing_figure_file_is_refused(tmp_path):
    result = read_run(write(tmp_path))
    (tmp_path / "scenario/own_figures.py").unlink()
    with pytest.raises(InputError, match=r'"own_figures\.py" does not exist'):
        load_figures(result)
