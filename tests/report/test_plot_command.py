"""The command `cosim plot`."""

import csv
import json
from pathlib import Path

from click.testing import CliRunner
from test_run_folders import write

from cosim.cli.commands.finished_runs import plot as command
from cosim.core.errors import InputError


def plot(*arguments):
    return CliRunner().invoke(command, list(map(str, arguments)))


def names(folder):
    return sorted(path.name for path in Path(folder).iterdir())


def test_figures_are_written_beside_the_result_with_their_data(tmp_path):
    run = write(tmp_path)
    done = plot(run)
    assert done.exit_code == 0, done.output
    assert names(run) == [
        "curve.csv",
        "curve.png",
        "curve.svg",
        "kpis.json",
        "result.csv",
        "run.json",
    ]
    assert done.output.split() == [str(run / f"curve.{suffix}") for suffix in ("png", "svg", "csv")]
    with (run / "curve.csv").open(newline="") as file:
        assert list(csv.reader(file)) == [["panel", "curve", "t / s", "value"]] + [
            ["x / m", "x", *map(str, point)] for point in ((0.0, 0.0), (0.5, 0.25), (1.0, 1.0))
        ]


def test_format_and_folder_can_be_chosen(tmp_path):
    plot(write(tmp_path), "--format", "svg", "--output-dir", tmp_path / "plotted")
    assert names(tmp_path / "plotted") == ["curve.csv", "curve.svg"]


def test_several_runs_have_a_folder_each_and_one_comparison(tmp_path):
    runs = []
    for name in ("first", "second"):
        (tmp_path / name).mkdir()
        runs.append(write(tmp_path / name).rename(tmp_path / name / f"{name}_run"))
    done = plot(*runs, "--timings", "--format", "png", "--output-dir", tmp_path / "plotted")
    assert done.exit_code == 0, done.output
    assert names(tmp_path / "plotted") == ["first_run", "second_run", "timings.csv", "timings.png"]
    heights = [
        row.rpartition(",")[2]
        for row in (tmp_path / "plotted/timings.csv").read_text().splitlines()[1:]
    ]
    assert heights == ["4.0", "4.0"]


def test_an_invalid_run_is_refused_before_any_figure_is_drawn(tmp_path):
    run = write(tmp_path)
    done = plot(run, tmp_path / "missing")
    assert isinstance(done.exception, InputError)
    assert "curve.png" not in names(run)


def test_run_json_contains_the_path_of_the_scenario(tmp_path):
    import cosim
    from cosim.results import write_run

    block = Path(__file__).parents[1] / "scenario/pythonfmu_blocks.py"
    scenario = {
        "name": "small",
        "stop_time": 1,
        "step_size": 1,
        "components": {"a": {"python": f"{block}:Gain"}},
    }
    (tmp_path / "small.json").write_text(json.dumps(scenario))
    write_run(cosim.run(tmp_path / "small.json"), tmp_path / "run")
    assert json.loads((tmp_path / "run/run.json").read_text())["scenario_file"] == str(
        tmp_path / "small.json"
    )
