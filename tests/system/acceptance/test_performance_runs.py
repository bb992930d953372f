"""The six timing runs of section 6.3 of the paper, and its figure 18."""

import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

import cosim
from cosim.cli.commands.finished_runs import plot
from cosim.cli.commands.run import command as run

NAMES = [f"performance_{n}" for n in range(1, 7)]


@pytest.fixture(scope="module")
def results():
    return {name: cosim.run(name) for name in NAMES}


@pytest.mark.parametrize("n", [1, 3, 5])
def test_the_runs_of_a_pair_are_the_same(results, n):
    first, second = results[f"performance_{n}"], results[f"performance_{n + 1}"]
    for name in first:
        assert np.array_equal(first[name], second[name]), name


def test_the_last_pair_is_demo1(results):
    demo1 = cosim.run("demo1_box", stop_time=35)
    for name in demo1:
        assert np.array_equal(
            results["performance_5"][f"demo1.{name}"], demo1[name], equal_nan=True
        ), name


def test_the_first_pairs_differ_in_duration_and_do_not_land(results):
    short, long = results["performance_1"], results["performance_3"]
    assert (short.time[-1], long.time[-1]) == (15.0, 35.0)
    assert set(np.unique(long["demo1.uav.mode"])) == {1, 2, 3}
    for name in short:
        assert np.array_equal(short[name], long[name][:1501]), name


def test_figure_18_has_six_bars(tmp_path):
    for name in NAMES:
        done = CliRunner().invoke(
            run, [name, "--stop-time", "2", "--no-report", "--output-dir", str(tmp_path / name)]
        )
        assert (tmp_path / name / "run.json").is_file(), done.output
    CliRunner().invoke(
        plot,
        [*(str(tmp_path / name) for name in NAMES), "--timings", "--format", "png"],
        catch_exceptions=False,
    )
    with (tmp_path / "timings.csv").open(newline="") as file:
        heights = [float(row[-1]) for row in list(csv.reader(file))[1:]]
    loops = [
        json.loads((tmp_path / name / "run.json").read_text())["timing"]["loop_seconds"]
        for name in NAMES
    ]
    assert heights[:6] == pytest.approx([2.0 / loop for loop in loops])
    assert (tmp_path / "timings.png").stat().st_size > 0
