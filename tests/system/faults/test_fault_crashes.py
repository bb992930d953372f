"""FMUs that crash, end the process, hang or leave something behind: a supervised run survives,
names them, keeps the rows.
"""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from itertools import product

import pytest
from command_runner import CommandResult
from fault_fmu import STEP_COUNT, function_name, scenario

from cosim.engine import native_available as native_available
from cosim.results import Result

ALL = STEP_COUNT + 1
#: a hang is found within its deadline and half a second; the process around it takes its time, too
DEADLINES, SLACK = {"load": 0.5, "initialization": 0.5, "step": 0.5, "end": 0.5}, 3.0


@dataclass(frozen=True)
class Case:
    """An order, words of the message ({f}: the C function), exit code, and the kept rows."""

    order: str
    words: str = ""
    code: int = 1
    rows: int = 6


def table(*cases: Case) -> pytest.MarkDecorator:
    """Each case with one of the FMI versions in turn; with the other one in long runs."""
    chosen = []
    for n, case in enumerate(cases):
        for version in (2, 3):
            marks = [] if version == 2 + n % 2 else [pytest.mark.long]
            chosen.append(pytest.param(case, version, marks=marks, id=f"FMI{version} {case.order}"))
    return pytest.mark.parametrize(("case", "version"), chosen)


def check(done: CommandResult, case: Case, version: int) -> None:
    assert done.code == case.code, done.err
    assert len(done.rows) == case.rows, done.err
    assert case.words.format(f=function_name(version, case.order.split()[0])) in done.err
    assert "Traceback" not in done.err
    assert [name for name in done.temporary_files if name.startswith("cosim-")] == []
    assert (done.processes, done.changes) == ([], [])


FAILED = "lag: {f} failed"
T5 = FAILED + " at t = 0.05 s: "
SIGNAL, EXIT, LATE = (
    "the process was ended by signal ",
    "it ended the process with exit code ",
    "did not return within 0.5 s",
)

CRASHES = table(
    Case("DoStep 6 segv", T5 + SIGNAL + "11 (SIGSEGV"),
    Case("DoStep 6 bus", T5 + SIGNAL + "7 (SIGBUS"),
    Case("DoStep 6 divide", T5 + SIGNAL + "8 (SIGFPE"),
    Case("DoStep 6 illegal", T5 + SIGNAL + "4 (SIGILL"),
    Case("DoStep 6 deep", T5 + SIGNAL + "11 (SIGSEGV"),
    Case("DoStep 6 abort", T5 + SIGNAL + "6 (SIGABRT"),
    Case("DoStep 6 free_twice", T5 + SIGNAL + "6 (SIGABRT"),
    Case("DoStep 6 kill", T5 + SIGNAL + "9 (SIGKILL"),
    Case("DoStep 6 exit_0", T5 + EXIT + "0"),
    Case("DoStep 6 exit_3", T5 + EXIT + "3"),
    Case("DoStep 6 exit_at_once", T5 + EXIT + "0"),
    Case("GetReal 9 segv", T5 + SIGNAL),
    Case("DoStep @0.02 segv", FAILED + " at t = 0.02 s: " + SIGNAL + "11 (SIGSEGV", rows=3),
    Case("load 1 segv", SIGNAL + "11 (SIGSEGV", rows=0),
    Case("load 1 exit_0", EXIT + "0", rows=0),
    Case("Instantiate 1 segv", FAILED, rows=0),
    Case("Instantiate 1 exit_0", FAILED, rows=0),
    Case("EnterInitializationMode 1 segv", FAILED, rows=0),
    Case("ExitInitializationMode 1 abort", FAILED, rows=0),
    Case("GetReal 1 exit_0", "lag: ", rows=0),
    Case("Terminate 1 segv", "{f}", code=0, rows=ALL),
    Case("Terminate 1 exit_0", "{f}", code=0, rows=ALL),
    Case("FreeInstance 1 segv", "{f}", code=0, rows=ALL),
    Case("FreeInstance 1 exit_0", "{f}", code=0, rows=ALL),
    Case("unload 1 segv", "lag: unloading the binary failed: " + SIGNAL, code=0, rows=ALL),
)


@CRASHES
def test_a_crash_is_named_and_the_rows_are_kept(fmus, runner, tmp_path, case, version):
    check(runner.run(tmp_path, fmus(version, case.order)), case, version)


def test_the_command_itself_survives(fmus, tmp_path, version):
    """The command is started like a user's, with its own imports; the other tests fork a process
    that has done them.
    """
    words = ["simulate", fmus(version, "DoStep 6 segv"), "--output-file", tmp_path / "result.csv"]
    done = subprocess.run(
        [sys.executable, "-m", "cosim", *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1
    assert f"fmi{version}DoStep failed at t = 0.05 s: {SIGNAL}11" in done.stderr
    assert len((tmp_path / "result.csv").read_text().splitlines()) == 7


@table(
    Case("DoStep 6 loop", T5 + LATE),
    Case("DoStep 6 sleep", T5 + LATE),
    Case("EnterInitializationMode 1 loop", FAILED, rows=0),
    Case("Instantiate 1 sleep", FAILED, rows=0),
    Case("load 1 loop", LATE, rows=0),
    Case("Terminate 1 loop", "{f}", code=0, rows=ALL),
    Case("FreeInstance 1 loop", "{f}", code=0, rows=ALL),
)
def test_a_hang_is_found_at_its_deadline(fmus, runner, tmp_path, case, version):
    done = runner.run(tmp_path, fmus(version, case.order), deadlines=DEADLINES, limit=20)
    check(done, case, version)
    assert done.seconds < 0.5 + 0.5 + SLACK


@table(
    Case("DoStep 6 change_folder", code=0, rows=ALL),
    Case("DoStep 6 change_locale", code=0, rows=ALL),
    Case("DoStep 6 change_umask", code=0, rows=ALL),
    Case("DoStep 6 change_environment", code=0, rows=ALL),
    Case("DoStep 6 ignore_interrupts", code=0, rows=ALL),
    Case(
        "DoStep 6 block_signals",
        "lag: changed which signals are blocked of the process",
        code=0,
        rows=ALL,
    ),
    Case("DoStep 6 set_alarm", "lag: changed the timers of the process", code=0, rows=ALL),
    Case("GetReal @0.095 limit_files", "lag: changed the limits of the process", code=0, rows=ALL),
    Case("GetReal @0.095 limit_size", "lag: changed the limits of the process", code=0, rows=ALL),
    Case("DoStep 6 round_up", "lag: the step changed the floating-point mode", code=0, rows=ALL),
    Case(
        "DoStep 6 flush_to_zero", "lag: the step changed the floating-point mode", code=0, rows=ALL
    ),
    Case("DoStep 6 fp_traps", "lag: a step changed the floating-point mode", code=0, rows=ALL),
    Case("DoStep 6 thread", code=0, rows=ALL),
    Case("DoStep 6 close_output", code=0, rows=ALL),
    Case("DoStep 6 flood_stdout", code=0, rows=ALL),
    Case("DoStep 6 memory", "status 3 (error): out of memory"),
    Case("DoStep 6 tcp", code=0, rows=ALL),
)
def test_what_an_fmu_does_to_its_process_does_not_reach_the_importer(
    fmus, runner, tmp_path, case, version
):
    done = runner.run(tmp_path, fmus(version, case.order), deadlines={"step": 3.0})
    check(done, case, version)
    assert (tmp_path / "out/result.csv").stat().st_mode & 0o400


@pytest.mark.parametrize("executor", ["python", "native"])
def test_another_thread_of_an_fmu_may_log(fmus, runner, tmp_path, version, executor):
    if executor == "native" and not native_available():
        pytest.skip("the native executor was not built")
    done = runner.run(
        tmp_path, fmus(version, "DoStep 6 log_thread"), deadlines=DEADLINES, executor=executor
    )
    assert (done.code, len(done.rows)) == (0, ALL), done.err
    assert "INFO lag: from a thread" in done.err


@pytest.mark.parametrize("isolation", ["run", "fmu"])
def test_an_fmu_that_overwrites_what_the_supervisor_reads(
    fmus, runner, tmp_path, version, isolation
):
    """The FMU overwrites the journal in which the child records its present call; the deadline
    still ends the run by name.
    """
    file = scenario(tmp_path, fmus(version, "DoStep 6 overwrite"), deadlines={"step": 3.0})
    done = runner.cosim(
        tmp_path,
        "run",
        file,
        "--output-dir",
        "out",
        "--no-report",
        "--isolation",
        isolation,
        limit=20,
    )
    assert done.code == 1, done.err
    assert "lag: " in done.err
    assert (tmp_path / "out/result.csv").exists()
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


def test_an_fmu_that_takes_all_descriptors_costs_no_rows(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version, "DoStep 6 open_files"))
    assert (done.code, len(done.rows)) == (0, ALL), done.err
    assert (
        "WARNING lag: changed the number of free descriptors (none was left) of the process"
        in done.err
    )
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


TICKER = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real, String

class Ticker(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.count, self.text = 0.0, "step 0"
        self.register_variable(Real("count", causality=Fmi2Causality.output))
        self.register_variable(String("text", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        self.count += 1
        self.text = f"step {self.count:.0f}"
        return True
"""


@pytest.mark.parametrize("isolation", ["run", "fmu", "none"])
@pytest.mark.parametrize("moment", ["DoStep 1", "GetReal 6", "Terminate 1"])
def test_an_fmu_that_empties_all_open_files_costs_no_rows(
    fmus, runner, tmp_path, version, isolation, moment
):
    """A string that changes in each step is recorded beside the numbers."""
    (tmp_path / "ticker.py").write_text(TICKER)
    lag = {"fmu": str(fmus(version, f"{moment} truncate_all"))}
    components = {"lag": lag, "ticker": {"python": "ticker.py:Ticker"}}
    file = scenario(tmp_path, fmus.folder, components=components)
    done = runner.cosim(
        tmp_path, "run", file, "--output-dir", "out", "--no-report", "--isolation", isolation
    )
    assert done.code == 0, done.err
    result = Result.from_csv(tmp_path / "out/result.csv")
    assert result["ticker.count"].tolist() == list(range(ALL))
    assert result["ticker.text"].tolist() == [f"step {n}" for n in range(ALL)]
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


def test_an_fmu_that_closes_all_files_is_named(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version, "DoStep 6 close_all"))
    assert "lag: a call that closed the files of the process failed: " in done.err
    assert (done.code, len(done.rows)) == (1, ALL)
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


@pytest.mark.parametrize("what", ["fork", "daemon"])
def test_no_process_of_an_fmu_outlives_the_run(fmus, runner, tmp_path, version, what):
    done = runner.run(tmp_path, fmus(version, f"DoStep 6 {what}"))
    assert fmus.lines("child")
    assert done.processes == []
    assert len(done.rows) == ALL


NOTICED = "WARNING lag: {f} forked the process; a copy that returns from the call is ended"


FORKS = ["DoStep 6 fork_return", "DoStep 6 fork_silently", "DoStep 6 fork_program"]
OTHER_FORKS = [
    "GetReal 6",
    "Instantiate 1",
    "ExitInitializationMode 1",
    "Terminate 1",
    "FreeInstance 1",
    "DoStep *",
]


@pytest.mark.parametrize(
    ("order", "isolation", "executor"),
    [
        *product(FORKS, ("run", "fmu", "none"), ["native"]),
        *product([f"{moment} fork_return" for moment in OTHER_FORKS], ("run", "fmu"), ["python"]),
    ],
)
def test_a_forked_copy_does_not_continue_the_run(
    fmus, runner, tmp_path, order, isolation, executor
):
    """Calls of a component that another one follows; without supervision a copy ends at the latest
    with the run.
    """
    version = 2 + (isolation == "run")
    noticed = isolation != "none" and "silently" not in order
    components = {
        "lag": {"fmu": str(fmus(version, order))},
        "other": {"fmu": str(fmus(version, name="other"))},
    }
    file = scenario(tmp_path, fmus.folder, components=components)
    words = ("run", file, "--output-dir", "out", "--no-report", "--isolation", isolation)
    done = runner.cosim(tmp_path, *words, executor=executor, limit=20)
    assert (done.code, len(done.rows)) == (0, ALL), done.err
    assert done.out.count("simulated in") == 1
    assert done.err.count("forked") == noticed
    if noticed:
        assert NOTICED.format(f=function_name(version, order.split()[0])) in done.err
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


@pytest.mark.parametrize("isolation", ["run", "none"])
def test_a_copy_that_a_python_component_forks_does_not_continue_the_run(
    runner, tmp_path, isolation
):
    (tmp_path / "ticker.py").write_text(
        TICKER.replace(
            "        return True", "        __import__('os').fork()\n        return True"
        )
    )
    file = scenario(
        tmp_path, tmp_path, components={"ticker": {"python": "ticker.py:Ticker"}}, stop_time=0.03
    )
    done = runner.cosim(
        tmp_path,
        "run",
        file,
        "--output-dir",
        "out",
        "--no-report",
        "--isolation",
        isolation,
        limit=20,
    )
    assert done.code == 0, done.err
    assert len(Result.from_csv(tmp_path / "out/result.csv").time) == 4
    assert done.out.count("simulated in") == 1
    assert ("WARNING ticker: do_step forked the process" in done.err) == (isolation == "run")
    assert (done.temporary_files, done.changes) == ([], [])
    assert (
        done.processes == [] or isolation == "none"
    )  # nobody ends the copies before they have left the run


def test_an_fmu_cannot_read_what_is_typed(fmus, runner, tmp_path, version):
    os.mkfifo(tmp_path / "typed")
    done = runner.run(
        tmp_path, fmus(version, "DoStep 6 read_stdin"), limit=10, stdin=str(tmp_path / "typed")
    )
    assert (done.code, len(done.rows)) == (0, ALL)
    assert fmus.lines("stdin") == ["stdin 0"]


def test_many_messages_are_cut_and_counted(fmus, runner, tmp_path, version):
    """1000 lines a second are passed on, the rest is counted."""
    done = runner.run(tmp_path, fmus(version, "DoStep 1 log_20000"))
    assert (done.code, len(done.rows)) == (0, ALL), done.err[-1000:]
    assert done.err.count("again") < 10_000


@pytest.mark.long
def test_a_flood_of_messages_ends_by_the_deadline_at_the_latest(fmus, runner, tmp_path, version):
    done = runner.run(tmp_path, fmus(version, "DoStep 6 flood_log"), limit=30)
    assert done.code in (0, 1)
    assert len(done.rows) >= 6
    assert len(done.err) < 4_000_000


@pytest.mark.parametrize("what", ["segv", "exit_0", pytest.param("loop", marks=pytest.mark.long)])
def test_one_fmu_alone_is_supervised_too(fmus, runner, tmp_path, version, what):
    done = runner.simulate(tmp_path, fmus(version, f"DoStep 6 {what}"), limit=20)
    assert (done.code, len(done.rows)) == (1, 6), done.err
    assert f"fmi{version}DoStep" in done.err
    assert (done.temporary_files, done.processes, done.changes) == ([], [], [])


def test_the_innocent_are_not_accused(fmus, runner, tmp_path, version):
    """The crashed one of two instances in one stage is named."""
    components = {name: {"fmu": str(fmus(version))} for name in ("first", "second", "third")}
    file = scenario(
        tmp_path, fmus.folder, components=components, algorithm={"stages": [list(components)]}
    )
    words = (
        "run",
        file,
        "--output-dir",
        "out",
        "--no-report",
        "--set",
        "second.fault=DoStep 6 segv",
    )
    done = runner.cosim(tmp_path, *words)
    assert (done.code, len(done.rows)) == (1, 6)
    assert f"second: fmi{version}DoStep failed at t = 0.05 s: {SIGNAL}11" in done.err
    assert "first:" not in done.err
    assert "third:" not in done.err
