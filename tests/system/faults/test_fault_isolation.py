"""FMUs in separate processes: nothing that one of them does reaches the importer, which has no
supervisor here.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from command_runner import CommandResult, CommandRunner
from fault_fmu import STEP_COUNT, FaultFmus, lag_output, scenario
from fmi_call_rules import calls, violations
from test_fault_crashes import (
    ALL,
    CRASHES,
    DEADLINES,
    EXIT,
    FAILED,
    LATE,
    SIGNAL,
    SLACK,
    T5,
    Case,
    check,
    table,
)

from cosim.process.sandbox import find_available_sandboxes

ROOT = Path(__file__).parents[3]
needs_sandbox = pytest.mark.skipif(
    not find_available_sandboxes().confines_fmus, reason="this system cannot confine FMUs"
)
needs_bubblewrap = pytest.mark.skipif(
    not find_available_sandboxes().bubblewrap, reason="no bubblewrap that works"
)


def run(
    runner: CommandRunner, folder: Path, components: dict[str, Any], *words: str, **more: Any
) -> CommandResult:
    """A run without supervisor whose components are in separate processes."""
    conditions = {name: more.pop(name) for name in ("limit", "stdin", "executor") if name in more}
    apart = {name: {"fmu": str(fmu), "isolation": "fmu"} for name, fmu in components.items()}
    file = scenario(folder, next(iter(components.values())), components=apart, **more)
    words = ("run", str(file), "--output-dir", "out", "--no-report", "--isolation", "none", *words)
    return runner.cosim(folder, *words, **conditions)


@CRASHES
def test_a_crash_is_named_and_the_importer_goes_on(fmus, runner, tmp_path, case, version):
    check(run(runner, tmp_path, {"lag": fmus(version, case.order)}), case, version)


@table(
    Case("DoStep 6 loop", T5 + LATE),
    Case("DoStep 6 sleep", T5 + LATE),
    Case("EnterInitializationMode 1 loop", FAILED, rows=0),
    Case("Instantiate 1 sleep", FAILED, rows=0),
    Case("load 1 loop", LATE, rows=0),
    Case("Terminate 1 loop", "{f}", code=0, rows=ALL),
    Case("FreeInstance 1 loop", "{f}", code=0, rows=ALL),
)
def test_a_hang_ends_at_its_deadline(fmus, runner, tmp_path, case, version):
    done = run(runner, tmp_path, {"lag": fmus(version, case.order)}, deadlines=DEADLINES, limit=20)
    check(done, case, version)
    assert done.seconds < 0.5 + 0.5 + SLACK


@table(
    Case("DoStep 6 change_folder", code=0, rows=ALL),
    Case("DoStep 6 change_environment", code=0, rows=ALL),
    Case("DoStep 6 ignore_interrupts", code=0, rows=ALL),
    Case("DoStep 6 round_up", "lag: {f} changed the floating-point mode", code=0, rows=ALL),
    Case("DoStep 6 flush_to_zero", "lag: {f} changed the floating-point mode", code=0, rows=ALL),
    Case("DoStep 6 fp_traps", "lag: {f} changed the floating-point mode", code=0, rows=ALL),
    Case("DoStep 6 thread", code=0, rows=ALL),
    Case("DoStep 6 close_output", code=0, rows=ALL),
    Case("DoStep 6 log_thread", code=0, rows=ALL),
    Case("DoStep 6 flood_stdout", code=0, rows=ALL),
    Case("DoStep 6 flood_stderr", code=0, rows=ALL),
    Case("DoStep 6 read_stdin", code=0, rows=ALL),
    Case("DoStep 6 fork", code=0, rows=ALL),
    Case("DoStep 6 close_all", code=0, rows=ALL),
)
def test_what_an_fmu_does_to_its_process_stays_there(fmus, runner, tmp_path, case, version):
    done = run(runner, tmp_path, {"lag": fmus(version, case.order)}, deadlines={"step": 3.0})
    check(done, case, version)
    assert len(done.err) < 100_000


def test_memory_is_limited(fmus, runner, tmp_path, version):
    """2 GiB; the order is to take as much as there is."""
    done = run(runner, tmp_path, {"lag": fmus(version, "DoStep 6 memory")}, limit=30)
    (line,) = fmus.lines("memory")
    assert 1024 < int(line.split()[1]) <= 2048
    assert len(done.rows) in (6, ALL)


def test_open_files_are_limited(fmus, runner, tmp_path, version):
    run(runner, tmp_path, {"lag": fmus(version, "DoStep 6 open_files")})
    (line,) = fmus.lines("files")
    assert 50 < int(line.split()[1]) < 256


def test_a_daemon_ends_with_the_supervised_run(fmus, runner, tmp_path, version):
    done = run(runner, tmp_path, {"lag": fmus(version, "DoStep 6 daemon")}, "--isolation", "fmu")
    assert fmus.lines("child")
    assert (done.processes, len(done.rows)) == ([], ALL)


def test_the_others_end_in_order(fmus, runner, tmp_path, version):
    """One of three instances crashes; the others are freed, and all rows before are those of a good
    run.
    """
    components = dict.fromkeys(("first", "second", "third"), fmus(version))
    done = run(runner, tmp_path, components, "--set", "second.fault=DoStep 6 segv")
    assert done.code == 1
    assert f"second: fmi{version}DoStep failed at t = 0.05 s: {SIGNAL}11" in done.err
    assert [row["first.y"] for row in done.rows] == [lag_output(n) for n in range(6)]
    assert {who for who, what in calls(fmus.lines()) if what == "FreeInstance"} == {
        "first",
        "third",
    }
    assert (done.processes, done.changes, done.temporary_files) == ([], [], [])


@pytest.mark.parametrize(
    "order",
    ["GetReal 9 discard", "DoStep 3 error", "DoStep 3 fatal", "EnterInitializationMode 1 fatal"],
)
def test_nothing_forbidden_follows_a_bad_status(fmus, runner, tmp_path, version, order):
    function, _, status = order.split()
    names = {"GetReal": "GetFloat64"} if version == 3 else {}
    done = run(runner, tmp_path, {"lag": fmus(version, order)})
    assert done.code == 1
    assert f"lag: fmi{version}{names.get(function, function)} failed at t = " in done.err
    assert (
        f"status {['warning', 'discard', 'error', 'fatal'].index(status) + 1} ({status})"
        in done.err
    )
    assert violations(fmus.lines()) == []


def test_fatal_of_one_instance_is_the_end_of_all_instances(fmus, runner, tmp_path, version):
    """So the standard wants it: those in other processes, too."""
    components = dict.fromkeys(("lag", "twin"), fmus(version))
    assert run(runner, tmp_path, components, "--set", "lag.fault=DoStep 3 fatal").code == 1
    assert violations(fmus.lines()) == []


def test_messages_are_cut_and_counted(fmus, runner, tmp_path, version):
    done = run(runner, tmp_path, {"lag": fmus(version, "DoStep 1 log_20000")})
    assert (done.code, len(done.rows)) == (0, ALL), done.err[-1000:]
    assert 100 < done.err.count("again") < 10_000
    assert "messages of components were not shown" in done.err


@pytest.mark.parametrize(
    ("what", "words"), [("exit_0", EXIT), ("error", "status 3"), ("negative", "status -1")]
)
def test_the_other_executor_does_the_same(fmus, runner, tmp_path, version, what, words):
    done = run(runner, tmp_path, {"lag": fmus(version, f"DoStep 6 {what}")}, executor="python")
    assert f"lag: fmi{version}DoStep failed at t = 0.05 s: {words}" in done.err
    assert (done.code, len(done.rows)) == (1, 6)


def test_one_fmu_alone(fmus, runner, tmp_path, version):
    done = runner.simulate(tmp_path, fmus(version, "DoStep 6 segv"), "--isolation", "fmu")
    assert (done.code, len(done.rows)) == (1, 6), done.err
    assert f"fmi{version}DoStep failed at t = 0.05 s: {SIGNAL}11" in done.err


@dataclass(frozen=True)
class Loud(FaultFmus):
    """FMUs that record their calls where a sandbox lets them: on what they print."""

    @property
    def calls(self) -> Path:
        return Path("/dev/stderr")


@needs_sandbox
class TestSandbox:
    @pytest.fixture
    def confined(self, fmus, runner, tmp_path, version):
        """Runs an FMU with an order, with or without sandbox."""
        loud = Loud(fmus.libraries, fmus.folder)
        return lambda order, *words: run(runner, tmp_path, {"lag": loud(version, order)}, *words)

    def test_a_good_fmu_notices_nothing(self, confined):
        done = confined("- 1 error", "--sandbox")
        assert (done.code, len(done.rows)) == (0, STEP_COUNT + 1), done.err
        assert [row["lag.y"] for row in done.rows] == [lag_output(n) for n in range(STEP_COUNT + 1)]

    @pytest.mark.parametrize(
        ("words", "written"), [((), True), (("--sandbox",), False)], ids=["free", "sandbox"]
    )
    def test_it_writes_to_no_folder_of_others(self, confined, tmp_path, words, written):
        done = confined("DoStep 6 write_here", *words)
        assert f"file fault_was_here {int(written)}" in done.err
        assert (tmp_path / "fault_was_here").exists() is written
        assert len(done.rows) == ALL

    def test_it_writes_to_its_temporary_folder_which_goes_with_it(self, confined):
        done = confined("DoStep 6 write_temporary", "--sandbox")
        assert "fault_was_here 1" in done.err
        assert (done.code, done.temporary_files) == (0, [])

    def test_a_folder_in_pythonpath_with_other_files_is_refused(self, fmus, tmp_path):
        (tmp_path / "diary.txt").touch()
        command = [sys.executable, "-m", "cosim", "simulate", fmus(2), "--sandbox"]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(tmp_path)])}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert (done.returncode, done.stderr.count("\n")) == (2, 1), done.stderr
        assert f'"{tmp_path}" in PYTHONPATH holds "diary.txt"' in done.stderr

    @needs_bubblewrap
    @pytest.mark.parametrize(
        ("version", "order", "words"),
        [
            (2, "DoStep 6 write_here", "file fault_was_here 0"),
            (3, "DoStep 6 write_temporary", "fault_was_here 1"),
            (2, "DoStep 6 tcp", "connect -1 Bad file descriptor"),
            (3, "DoStep 6 udp", "connect -1 Bad file descriptor"),
            (2, "DoStep 6 daemon", "child -1"),
            (3, "DoStep 6 processes", "process [1-9] child of [1-9]\n"),
        ],
        indirect=["version"],
    )
    def test_strictly_it_has_neither_files_nor_network_nor_other_processes(
        self, confined, tmp_path, order, words
    ):
        done = confined(order, "--sandbox", "strict", "--isolation", "run")
        assert re.search(words, done.err)
        assert (done.code, len(done.rows), done.processes, done.temporary_files) == (0, ALL, [], [])
        assert not (tmp_path / "fault_was_here").exists()

    @needs_bubblewrap
    def test_strictly_a_crash_is_named_and_the_rows_are_kept(self, confined, version):
        done = confined("DoStep 6 segv", "--sandbox", "strict", "--isolation", "run")
        assert f"lag: fmi{version}DoStep failed at t = 0.05 s: {SIGNAL}11" in done.err
        assert (done.code, len(done.rows), done.processes, done.temporary_files) == (1, 6, [], [])


ANSWERS = [
    "[" * 100_000 + "\n",
    "\n\n",
    '{"value": ["a", false, false]}\n',
    '{"component_error": ["other", "f", "r", "x"]}\n',
]
ANSWERS += [
    '{"input_error": 3}\n',
    '{"log": ["x", "y"]}\n',
    '{"log": 3}\n{"value": 1}\n',
    "\xff\n",
    "unfinished",
]


@pytest.mark.parametrize("moment", ["DoStep 6", "Instantiate 1"])
@pytest.mark.parametrize("answer", ANSWERS, ids=range(len(ANSWERS)))
def test_an_fmu_that_answers_for_its_worker_process_is_named(
    fmus, runner, tmp_path, answer, moment
):
    components = {
        "lag": {"fmu": str(fmus(2, f"{moment} answer"))},
        "other": {"fmu": str(fmus(2, name="other"))},
    }
    file = scenario(tmp_path, fmus.folder, components=components)
    words = ("run", file, "--output-dir", "out", "--no-report", "--isolation", "fmu")
    done = runner.cosim(tmp_path, *words, environment={"FAULT_ANSWER": answer}, limit=20)
    assert done.code == 1, done.err
    assert done.err.splitlines()[-1].startswith("lag: "), done.err
    assert done.err.endswith(": its worker process sent an invalid answer\n")
    assert len(done.rows) >= (6 if moment == "DoStep 6" else 0)
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])
