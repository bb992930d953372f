"""FMUs that request the end of the simulation: every command says who did and when."""

from __future__ import annotations

import json

import pytest
from fault_fmu import STEP_COUNT, scenario

import cosim

SENTENCE = "{} requested the end of the simulation at t = {} s"
LAST_VALUE = [{"kpi": "last.value", "max": 1.0}]


@pytest.mark.parametrize("isolation", ["none", "run", "fmu"])
@pytest.mark.parametrize("executor", ["python", "native"])
def test_summary_and_run_file_name_component_and_time(
    fmus, runner, tmp_path, version, executor, isolation
):
    file = scenario(tmp_path, fmus(version, "DoStep 6 terminate"))
    words = ("run", file, "--output-dir", "out", "--no-report", "--isolation", isolation)
    done = runner.cosim(tmp_path, *words, executor=executor)
    assert (done.code, len(done.rows)) == (0, 7), done.err
    assert SENTENCE.format("lag", 0.06) in done.out.splitlines()
    ended = json.loads((tmp_path / "out/run.json").read_text())["terminated_by"]
    assert ended == {"component": "lag", "time": pytest.approx(0.06)}


@pytest.mark.parametrize(
    ("step", "time"), [(1, 0.01), (6, 0.06), (STEP_COUNT, 0.1)], ids=["first", "middle", "last"]
)
def test_the_step_of_the_request_may_be_any(fmus, runner, tmp_path, version, step, time):
    done = runner.run(tmp_path, fmus(version, f"DoStep {step} terminate"))
    assert (done.code, len(done.rows)) == (0, step + 1), done.err
    assert SENTENCE.format("lag", time) in done.out.splitlines()


@pytest.mark.parametrize("words", [(), ("--output-file", "result.csv")], ids=["values", "file"])
def test_the_simulation_of_one_fmu_says_so_too(fmus, runner, tmp_path, version, words):
    done = runner.cosim(tmp_path, "simulate", fmus(version, "DoStep 6 terminate"), *words)
    assert done.code == 0, done.err
    assert done.err.splitlines() == [SENTENCE.format("the FMU", 0.06)]


def test_the_report_names_component_and_time(fmus, runner, tmp_path, version):
    done = runner.cosim(
        tmp_path,
        "run",
        scenario(tmp_path, fmus(version, "DoStep 6 terminate")),
        "--output-dir",
        "out",
    )
    assert done.code == 0, done.err
    page = (tmp_path / "out/report.html").read_text()
    assert "<dt>end</dt><dd>lag requested the end of the simulation at t = 0.06 s</dd>" in page


def test_a_result_in_python_says_so(fmus, tmp_path, version):
    result = cosim.run(scenario(tmp_path, fmus(version, "DoStep 6 terminate")))
    assert result.termination == SENTENCE.format("lag", 0.06)
    assert result.termination in repr(result).splitlines()


def test_a_kpi_that_fails_afterwards_does_not_hide_it(fmus, runner, tmp_path, version):
    """A KPI often fails because the run was too short for it."""
    (tmp_path / "kpi.py").write_text("def late(result):\n    return {'value': result.time[9]}\n")
    file = scenario(
        tmp_path,
        fmus(version, "DoStep 6 terminate"),
        kpis=[{"name": "late", "python": "kpi.py:late"}],
    )
    done = runner.cosim(tmp_path, "run", file, "--output-dir", "out", "--no-report")
    assert done.code == 1
    assert SENTENCE.format("lag", 0.06) in done.out.splitlines()


def test_a_regression_that_passes_says_so(fmus, runner, tmp_path, version):
    kpis = [{"name": "last", "python": "cosim.kpis:final", "arguments": {"signal": "lag.y"}}]
    file = scenario(tmp_path, fmus(version, "DoStep 6 terminate"), kpis=kpis, checks=LAST_VALUE)
    done = runner.cosim(tmp_path, "regress", file)
    assert done.code == 0, done.err
    assert f"1 check; {SENTENCE.format('lag', 0.06)}" in done.out


def test_of_two_fmus_that_request_it_the_first_is_named(fmus, runner, tmp_path, version):
    components = {
        name: {"fmu": str(fmus(version, "DoStep 6 terminate", name))} for name in ("lag", "next")
    }
    done = runner.cosim(
        tmp_path,
        "run",
        scenario(tmp_path, fmus.folder, components=components),
        "--output-dir",
        "out",
        "--no-report",
    )
    assert done.code == 0, done.err
    assert done.out.count("requested the end") == done.out.count(SENTENCE.format("lag", 0.06)) == 1


@pytest.mark.parametrize("executor", ["python", "native"])
def test_a_time_beyond_the_step_does_not_count(fmus, runner, tmp_path, executor):
    """FMI 3.0: lastSuccessfulTime is at most the end of the step that the FMU was asked to make."""
    fmu = fmus(3, "DoStep 6 beyond")
    words = (
        "run",
        scenario(tmp_path, fmu),
        "--output-dir",
        "out",
        "--no-report",
        "--set",
        "lag.fault=DoStep 6 terminate",
    )
    done = runner.cosim(tmp_path, *words, executor=executor)
    assert (done.code, len(done.rows)) == (0, 7), done.err
    assert SENTENCE.format("lag", 0.06) in done.out.splitlines()


def test_a_run_to_its_stop_time_names_nobody(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version))
    assert "requested" not in done.out + done.err
