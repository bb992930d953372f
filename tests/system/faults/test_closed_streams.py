"""Commands and programs whose standard streams are closed: the usual results and exit codes."""

from __future__ import annotations

import subprocess
import sys

import pytest
from fault_fmu import STEP_COUNT, lag_output, scenario

import cosim

#: closed streams in the words of a shell
ALL_CLOSED = "<&- >&- 2>&-"


def run_shell(command, folder):
    return subprocess.run(
        ["/bin/sh", "-c", command], cwd=folder, capture_output=True, text=True, check=False
    )


def test_a_program(fmus):
    """Started by a shell; the other tests close the streams of a forked process."""
    path = scenario(fmus.folder, fmus(2), record={"signals": ["lag.y"]})
    done = run_shell(
        f"{sys.executable} -m cosim run {path} --no-report --output-dir out {ALL_CLOSED}",
        fmus.folder,
    )
    assert done.returncode == 0, done.stderr
    assert len(cosim.Result.from_csv(fmus.folder / "out/result.csv").time) == STEP_COUNT + 1


@pytest.mark.parametrize("closed", [(2,), (0, 1), (0, 1, 2)])
def test_run(fmus, runner, closed):
    """Output of the FMU reaches no file of the run."""
    path = scenario(fmus.folder, fmus(2, "DoStep 6 flood_stdout"), record={"signals": ["lag.y"]})
    done = runner.cosim(
        fmus.folder, "run", path, "--no-report", "--output-dir", "out", closed=closed, observe=False
    )
    assert done.code == 0, done.err
    result = cosim.Result.from_csv(fmus.folder / "out/result.csv")
    assert [len(result.time), result["lag.y"][-1]] == [STEP_COUNT + 1, lag_output(STEP_COUNT)]


@pytest.mark.parametrize("isolation", ["none", "fmu"])
def test_run_with_another_isolation(fmus, runner, isolation):
    words = (
        "run",
        scenario(fmus.folder, fmus(3)),
        "--no-report",
        "--isolation",
        isolation,
        "--output-dir",
        "out",
    )
    assert runner.cosim(fmus.folder, *words, closed=(0, 1, 2), observe=False).code == 0
    assert len(cosim.Result.from_csv(fmus.folder / "out/result.csv").time) == STEP_COUNT + 1


@pytest.mark.parametrize(("order", "code"), [("DoStep 6 segv", 1), ("DoStep 6 error", 1), ("", 2)])
def test_exit_codes_stay(fmus, runner, order, code):
    path = scenario(fmus.folder, fmus(2, order), **({} if order else {"stop_time": -1}))
    words = ("run", path, "--no-report", "--output-dir", "out")
    assert runner.cosim(fmus.folder, *words, closed=(0, 1, 2), observe=False).code == code


@pytest.mark.parametrize("command", ["check fault.json", "simulate lag.fmu", "--version"])
def test_other_commands(fmus, runner, command):
    scenario(fmus.folder, fmus(2))
    assert runner.cosim(fmus.folder, *command.split(), closed=(1, 2), observe=False).code == 0


@pytest.mark.parametrize("isolation", ["none", "fmu"])
def test_a_program_that_closed_its_streams(fmus, isolation):
    path = scenario(fmus.folder, fmus(2), record={"signals": ["lag.y"]})
    program = (
        f"import cosim; assert cosim.run('{path}', isolation='{isolation}')['lag.y'][-1] == "
        f"{lag_output(STEP_COUNT)!r}"
    )
    assert run_shell(f'{sys.executable} -c "{program}" <&- >&- 2>&-', fmus.folder).returncode == 0


@pytest.mark.parametrize(
    ("command", "code"), [("check fault.json", 1), ("check missing.json", 2), ("--help", 1)]
)
def test_a_full_disk_behind_the_streams(fmus, command, code):
    """One line and an exit code of the table; Python alone would end with 120 and a traceback."""
    scenario(fmus.folder, fmus(2))
    done = run_shell(f"{sys.executable} -m cosim {command} > /dev/full", fmus.folder)
    assert (done.returncode, len(done.stderr.splitlines())) == (code, 1)
    assert (
        run_shell(
            f"{sys.executable} -m cosim {command} > /dev/full 2> /dev/full", fmus.folder
        ).returncode
        == code
    )


def test_a_full_disk_behind_standard_error_ends_no_run(fmus):
    path = scenario(fmus.folder, fmus(2, "DoStep 6 flush_to_zero"))
    assert (
        run_shell(
            f"{sys.executable} -m cosim run {path} --no-report --output-dir out 2> /dev/full",
            fmus.folder,
        ).returncode
        == 0
    )
