"""Two commands with the same output: the second is refused, the first is not disturbed."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess

import pytest
from command_folder import CommandFolder, child_processes, wait_until

import cosim
from cosim.core import resources

RUN = ("run", "robust.json", "--no-report", "--output-dir", "out")
FMU = resources.root() / "fmus" / "python" / "vtol.fmu"
IN_USE = (
    r'"{output}" is in use by process {process} on \S+, started at \d{{4}}-\d\d-\d\d '
    r"\d\d:\d\d:\d\d; wait until .*"
)


def refused(done: subprocess.CompletedProcess[str], output: str, process: int) -> bool:
    """The command was refused in one line that names the process which has the output."""
    (line,) = done.stderr.splitlines()
    return done.returncode == 2 and bool(
        re.fullmatch(IN_USE.format(output=output, process=process), line)
    )


@pytest.fixture
def running(workplace: CommandFolder):
    """A run that goes on until it is interrupted."""
    workplace.scenario()
    process = workplace.start(*RUN)
    assert workplace.wait_for_file("started")
    yield process
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)


@pytest.mark.parametrize("isolation", ["run", "none", "fmu"])
def test_a_second_run_into_the_same_folder_is_refused(workplace, running, isolation):
    assert refused(workplace.run(*RUN, "--isolation", isolation), "out", running.pid)
    running.send_signal(signal.SIGINT)
    running.communicate(timeout=30)
    assert running.returncode == 130
    result = cosim.Result.from_csv(workplace.out / "result.csv")
    assert result["ticker.count"].tolist() == list(range(len(result.time)))
    assert workplace.leftovers() == []


def test_a_run_without_supervision_keeps_its_folder_too(workplace):
    workplace.scenario()
    process = workplace.start(*RUN, "--isolation", "none")
    assert workplace.wait_for_file("started")
    assert refused(workplace.run(*RUN), "out", process.pid)
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    assert workplace.leftovers() == []


def test_a_sweep_into_the_folder_of_a_run_is_refused(workplace, running):
    sweep = {
        "name": "s",
        "scenario": "robust.json",
        "factors": [{"name": "t", "set": "/stop_time", "values": [0.1]}],
    }
    (workplace.folder / "sweep.json").write_text(json.dumps(sweep))
    assert refused(workplace.run("sweep", "sweep.json", "--output-dir", "out"), "out", running.pid)
    assert not (workplace.out / "journal.jsonl").exists()


def test_one_file_of_two_simulations(workplace):
    """Other files in the same folder are not locked."""
    words = ("simulate", FMU, "--step-size", "0.01", "--output-file")
    process = workplace.start(*words, "x.csv", "--stop-time", "1e5")
    assert wait_until((workplace.folder / ".x.csv.unfinished/header.json").exists)
    assert refused(workplace.run(*words, "x.csv"), "x.csv", process.pid)
    assert workplace.run(*words, "y.csv").returncode == 0
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=120)  # it writes some million numbers
    assert workplace.leftovers() == []


def test_a_simulation_into_the_folder_of_a_run_is_refused(workplace, running):
    """Whatever the name of its file: result.csv would be replaced."""
    words = ("simulate", FMU, "--step-size", "0.01", "--stop-time", "0.1", "--output-file")
    for name in ("result.csv", "other.csv"):
        assert refused(workplace.run(*words, f"out/{name}"), "out", running.pid)
    running.send_signal(signal.SIGINT)
    running.communicate(timeout=30)
    assert workplace.run(*words, "out/other.csv").returncode == 0
    assert workplace.leftovers() == []


def test_six_runs_into_one_folder_at_once(workplace):
    workplace.scenario(2.0, arguments={"pause": 0.005})
    runs = [workplace.start(*RUN) for _ in range(6)]
    errors = [run.communicate(timeout=60)[1] for run in runs]
    ended = [run.pid for run in runs if run.returncode == 0]
    assert ended
    for run, error in zip(runs, errors, strict=True):
        assert run.returncode in (0, 2), error
        assert not error or any(f"in use by process {process} on" in error for process in ended)
    assert len(cosim.Result.from_csv(workplace.out / "result.csv").time) == 201
    assert workplace.leftovers() == []


@pytest.mark.parametrize("whom", ["both", "supervisor", "child"])
def test_a_killed_run_locks_nothing(workplace, running, whom):
    (child,) = child_processes(running.pid)
    for process in {"both": [running.pid, child], "supervisor": [running.pid], "child": [child]}[
        whom
    ]:
        os.kill(process, signal.SIGKILL)
    running.communicate(timeout=30)
    workplace.scenario(0.1)
    done = workplace.run(*RUN)
    assert done.returncode == 0, done.stderr
    assert len(cosim.Result.from_csv(workplace.out / "result.csv").time) == 11
