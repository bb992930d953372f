"""FMUs whose outputs become NaN or infinite, although no component reads them."""

from __future__ import annotations

import json

import pytest
from fault_fmu import STEP_COUNT, scenario

WARNING = "WARNING {} is {} at t = {} s, its first value that is not finite"
TEXT = {"nan": "nan", "infinity": "inf"}
RUN = ("--output-dir", "out", "--no-report")


@pytest.mark.parametrize("executor", ["python", "native"])
@pytest.mark.parametrize("what", TEXT)
def test_a_run_warns_once_with_the_first_time(fmus, runner, tmp_path, version, what, executor):
    file = scenario(tmp_path, fmus(version, f"DoStep 6 {what}"), record={"signals": ["lag.y"]})
    done = runner.cosim(tmp_path, "run", file, *RUN, executor=executor)
    assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1)
    assert done.err.splitlines() == [WARNING.format("lag.y", TEXT[what], 0.06)]
    about = json.loads((tmp_path / "out/run.json").read_text())
    assert (about["non_finite"], about["warnings"]) == ({"lag.y": 0.06}, done.err.splitlines())


@pytest.mark.parametrize("words", [(), ("--output-file", "result.csv")], ids=["values", "file"])
@pytest.mark.parametrize("isolation", ["none", "run", "fmu"])
def test_the_simulation_of_one_fmu_warns(fmus, runner, tmp_path, isolation, words):
    done = runner.cosim(
        tmp_path, "simulate", fmus(2, "DoStep 6 nan"), *words, "--isolation", isolation
    )
    assert done.code == 0
    assert done.err.splitlines() == [WARNING.format("y", "nan", 0.06)]


def test_every_element_of_an_array_has_its_warning(fmus, runner, tmp_path):
    done = runner.simulate(tmp_path, fmus(3, "DoStep 6 nan"))
    assert done.err.splitlines() == [
        WARNING.format(name, "nan", 0.06) for name in ("y", "v[1]", "v[2]", "v[3]")
    ]


def test_the_report_lists_the_warning(fmus, runner, tmp_path, version):
    file = scenario(tmp_path, fmus(version, "DoStep 6 nan"))
    assert runner.cosim(tmp_path, "run", file, "--output-dir", "out").code == 0
    assert (
        f"<li>{WARNING.format('lag.y', 'nan', 0.06)}</li>"
        in (tmp_path / "out/report.html").read_text()
    )


def test_an_initial_output_has_the_start_time(fmus, runner, tmp_path, version):
    done = runner.simulate(tmp_path, fmus(version, "GetReal 3 nan"))
    assert done.code == 0
    assert done.err.splitlines()[0] == WARNING.format("y", "nan", 0)


@pytest.mark.parametrize("order", ["DoStep 6 nan", "DoStep 6 infinity"])
@pytest.mark.parametrize("executor", ["python", "native"])
def test_a_scenario_may_refuse_them(fmus, runner, tmp_path, version, order, executor):
    file = scenario(tmp_path, fmus(version, order), non_finite="fail")
    done = runner.cosim(tmp_path, "run", file, *RUN, executor=executor)
    assert (done.code, len(done.rows)) == (1, 6)
    text = f'the output "y" is {TEXT[order.split()[-1]]}, and is recorded for t = 0.06 s'
    assert done.err.splitlines()[-1] == f"lag: do_step failed at t = 0.05 s: {text}"


def test_a_scenario_may_allow_them(fmus, runner, tmp_path, version):
    file = scenario(tmp_path, fmus(version, "DoStep 6 nan"), non_finite="allow")
    done = runner.cosim(tmp_path, "run", file, *RUN)
    assert (done.code, done.err) == (0, "")


def test_a_signal_that_is_not_recorded_has_no_warning(fmus, runner, tmp_path, version):
    file = scenario(
        tmp_path, fmus(version, "DoStep 6 nan"), non_finite="fail", record={"signals": []}
    )
    done = runner.cosim(tmp_path, "run", file, *RUN)
    assert (done.code, done.err) == (0, "")


@pytest.mark.parametrize(
    ("isolation", "crash"), [("run", "segv"), ("run", "error"), ("fmu", "segv"), ("none", "error")]
)
def test_a_failure_later_does_not_hide_the_warning(
    fmus, runner, tmp_path, version, isolation, crash
):
    """NaN is often the cause of a crash."""
    words = ("--set", f"lag.fault=DoStep 9 {crash}", "--isolation", isolation)
    done = runner.cosim(
        tmp_path, "run", scenario(tmp_path, fmus(version, "DoStep 6 nan")), *RUN, *words
    )
    assert (done.code, len(done.rows)) == (1, 9)
    assert WARNING.format("lag.y", "nan", 0.06) in done.err.splitlines()
    assert json.loads((tmp_path / "out/run.json").read_text())["non_finite"]["lag.y"] == 0.06


def test_a_crash_of_one_fmu_does_not_hide_the_warning(fmus, runner, tmp_path, version):
    done = runner.simulate(
        tmp_path, fmus(version, "DoStep 6 nan"), "--start-value", "fault=DoStep 9 segv"
    )
    assert (done.code, len(done.rows)) == (1, 9)
    assert done.err.splitlines()[0] == WARNING.format("y", "nan", 0.06)


def test_a_crash_brings_no_warning_where_they_are_allowed(fmus, runner, tmp_path, version):
    file = scenario(tmp_path, fmus(version, "DoStep 6 nan"), non_finite="allow")
    done = runner.cosim(tmp_path, "run", file, *RUN, "--set", "lag.fault=DoStep 9 segv")
    assert (done.code, len(done.rows)) == (1, 9)
    assert "WARNING" not in done.err
