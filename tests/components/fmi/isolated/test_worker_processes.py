"""Worker processes: start, answers, end, and separation from the importer process."""

from __future__ import annotations

import mmap
import os
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from systems import endpoint, make_system, run_system

from cosim.components.fmi import FmuFile, Isolation, create_component
from cosim.components.fmi.isolated.pipe_messages import (
    SPIN_COUNT,
    STEP_COMMAND,
    STEP_DONE,
    SpinningPoller,
    decode_line,
    encode_line,
    read_line,
    write_line,
)
from cosim.components.fmi.isolated.shared_memory import SharedMemoryBlock
from cosim.components.fmi.isolated.worker_process import WorkerLostError, WorkerProcess
from cosim.core.component import Ports, Variable
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.process.journal import CHANGE_COUNT

DESCRIPTORS = Path("/proc/self/fd")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


def block(values: int = 1) -> SharedMemoryBlock:
    variables = [Variable(f"x{i}") for i in range(values)]
    return SharedMemoryBlock(
        Ports(variables, {np.dtype(np.float64): np.zeros(values)}), Ports([], {})
    )


@pytest.fixture
def worker():
    """Function that starts a worker process which answers each command with the result of a
    function.
    """
    started = []

    def start(
        answer: Callable[[bytes], bytes], shared: SharedMemoryBlock | None = None
    ) -> WorkerProcess:
        def serve(commands: int, answers: int) -> None:
            poller = SpinningPoller([commands])
            while line := read_line(commands, poller):
                write_line(answers, answer(line))

        started.append(WorkerProcess("w", (shared or block()).journal, serve))
        return started[-1]

    yield start
    for process in started:
        process.stop()


@pytest.fixture
def children() -> Callable[[], list[str]]:
    """Function that lists the processes that this one has started since the fixture was set up."""

    def now() -> list[str]:
        return Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()

    before = set(now())
    return lambda: [process for process in now() if process not in before]


def test_messages_of_any_size_are_transferred_completely(worker):
    echo = worker(lambda line: line)
    for size in (0, 1, 70_000, 1_000_000):
        message = ["x" * size, 0.1, float("inf"), 2**63, b"\x00\xff", None, "\N{SNOWMAN}\n"]
        assert decode_line(echo.request(encode_line(message), 5.0)) == message


def test_an_empty_line_is_transferred(worker):
    assert worker(lambda line: line).request(STEP_COMMAND, 5.0) == STEP_DONE


def test_unsuccessful_spinning_is_skipped_ever_longer(monkeypatch):
    """A successful poll resets the number of waits without spinning."""
    reader, writer = os.pipe()
    poll, polls = select.poll(), []
    counted = SimpleNamespace(register=poll.register, unregister=poll.unregister)
    counted.poll = lambda milliseconds: (
        polls.append(milliseconds == 0),
        poll.poll(min(milliseconds, 1)),
    )[1]
    monkeypatch.setattr(select, "poll", lambda: counted)
    poller = SpinningPoller([reader])

    def count_polls() -> int:
        polls.clear()
        poller.wait(60_000)
        return sum(polls)

    assert [count_polls() for _ in range(8)] == [SPIN_COUNT, 0, SPIN_COUNT, 0, 0, SPIN_COUNT, 0, 0]
    os.write(writer, STEP_COMMAND)
    assert [count_polls() for _ in range(5)] == [0, 0, 1, 1, 1]
    os.read(reader, 1)
    assert [count_polls() for _ in range(4)] == [SPIN_COUNT, 0, SPIN_COUNT, 0]
    os.close(writer)
    os.close(reader)


def test_a_process_that_does_not_answer_is_reported_at_its_deadline(worker):
    began = time.monotonic()
    with pytest.raises(WorkerLostError, match=r"did not return within 0\.2 s"):
        worker(lambda _: time.sleep(60)).request(STEP_COMMAND, 0.2)
    assert 0.2 < time.monotonic() - began < 0.7


def test_the_deadline_applies_to_each_call_in_the_journal(worker):
    shared = block()

    def ten_calls(line: bytes) -> bytes:
        for _ in range(10):
            time.sleep(0.12)
            shared.journal[CHANGE_COUNT] += 1
        return line

    assert worker(ten_calls, shared).request(STEP_COMMAND, 1.0) == STEP_DONE


def test_the_exit_code_of_a_process_is_reported(worker):
    process = worker(lambda _: os._exit(3))
    with pytest.raises(WorkerLostError, match="it ended the process with exit code 3"):
        process.request(STEP_COMMAND, 5.0)
    with pytest.raises(WorkerLostError):
        process.request(STEP_COMMAND, 5.0)


def test_a_process_that_ended_between_two_commands_is_reported(children, worker):
    process = worker(lambda line: line)
    (child,) = children()
    os.kill(int(child), signal.SIGKILL)
    with pytest.raises(WorkerLostError, match="signal 9"):
        process.request(STEP_COMMAND, 5.0)


def test_the_output_of_a_process_is_forwarded_up_to_a_limit(worker, capfd):
    process = worker(lambda line: os.write(1, b"x" * 1_000_000) and line)
    assert process.request(STEP_COMMAND, 5.0) == STEP_DONE
    process.stop()
    assert capfd.readouterr().err.count("x") == 1 << 16


def test_python_output_is_forwarded_like_c_output(worker, capfd, monkeypatch, tmp_path):
    """The importer's own streams do not matter."""
    with (tmp_path / "stream").open("w") as stream:
        monkeypatch.setattr("sys.stdout", stream)
        process = worker(lambda line: print("hello") or line)
        assert process.request(STEP_COMMAND, 5.0) == STEP_DONE
    process.stop()
    assert capfd.readouterr().err == "hello\n"


def test_an_interrupt_reaches_the_importer_while_it_waits(worker):
    process = worker(lambda _: time.sleep(60))
    before = signal.signal(signal.SIGALRM, signal.default_int_handler)
    signal.setitimer(signal.ITIMER_REAL, 0.1)
    with pytest.raises(KeyboardInterrupt):
        process.request(STEP_COMMAND, 30.0)
    signal.signal(signal.SIGALRM, before)


def test_a_worker_cannot_change_other_shared_memory(worker):
    """The importer shares both mappings; the worker replaces the other one by private memory."""
    own, other = block(), mmap.mmap(-1, 4096)
    (mirror,) = own.inputs.arrays.values()
    other[:4] = b"mine"

    def overwrite(line: bytes) -> bytes:
        own.unshare_other_memory()
        mirror[0], other[:4] = 2.5, b"evil"
        return line

    assert worker(overwrite, own).request(STEP_COMMAND, 5.0) == STEP_DONE
    assert (mirror[0], other[:4]) == (2.5, b"mine")


def test_a_worker_inherits_no_descriptors(worker):
    """Except its own pipes, the standard streams, and the folder that it reads for this test."""

    def list_descriptors(_: bytes) -> bytes:
        paths = [path for path in DESCRIPTORS.iterdir() if int(path.name) > 2]
        return encode_line([str(path.readlink()) if path.exists() else "" for path in paths])

    with tempfile.TemporaryFile() as secret:
        opened = decode_line(worker(list_descriptors).request(b"[]\n", 5.0))
        assert secret.fileno() > 2
    assert {path.partition(":")[0] for path in opened} <= {"pipe", ""}
    assert len(opened) <= 3


def isolated_instances(probe: Path, *names: str) -> dict[str, object]:
    file = FmuFile(probe)
    return {name: create_component(file, name, isolation=Isolation()) for name in names}


def test_many_runs_leave_no_descriptors_files_and_processes(children, probe, tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    run_system(make_system(isolated_instances(probe, "a")), "1/100")  # imports
    descriptors = sorted(DESCRIPTORS.iterdir())
    for fail_time in (1e9, 0.025):
        for _ in range(5):
            built = make_system(
                isolated_instances(probe, "a", "b"),
                "a.y > b.u",
                start_values={"a": {"fail_time": fail_time}},
            )
            outcome = simulate(
                built,
                Settings(
                    exact_fraction(0),
                    exact_fraction("1/10"),
                    exact_fraction("1/100"),
                    {"b.y": endpoint("b.y")},
                ),
            )
            assert (outcome.failure is None) == (fail_time == 1e9)
    assert sorted(DESCRIPTORS.iterdir()) == descriptors
    assert (list(tmp_path.iterdir()), children()) == ([], [])


def test_no_process_is_started_before_instantiate(children, probe):
    for component in isolated_instances(probe, "a", "b").values():
        component.free()
    assert children() == []


IMPORTER = """
import os, sys
sys.path.insert(0, sys.argv[1])
from systems import make_system
from pathlib import Path
from cosim.components.fmi import FmuFile, Isolation, create_component
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.core.time_grid import exact_fraction
def killed(n, count):
    print(Path(f"/proc/self/task/{os.getpid()}/children").read_text(), flush=True)
    os.kill(os.getpid(), 9)
fmu = create_component(FmuFile(Path(sys.argv[2])), "a", isolation=Isolation())
settings = Settings(exact_fraction(0), exact_fraction(1), exact_fraction("1/100"))
simulate(make_system({"a": fmu}), settings, [killed])
"""


def test_a_worker_ends_with_its_importer(probes, tmp_path, monkeypatch):
    monkeypatch.setenv("TMPDIR", str(tmp_path))  # the killed importer leaves its files here
    command = [sys.executable, "-c", IMPORTER, Path(__file__).parents[3] / "support", probes[2]]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    (worker,) = done.stdout.split()
    latest = time.monotonic() + 5
    while Path(f"/proc/{worker}").exists() and time.monotonic() < latest:
        time.sleep(0.01)
    assert not Path(f"/proc/{worker}").exists() or " Z " in Path(f"/proc/{worker}/stat").read_text()
