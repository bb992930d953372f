"""Supervised processes that are stopped from outside."""

from __future__ import annotations

import mmap
import os
import signal
import subprocess
import sys
import time
from tempfile import TemporaryFile

import pytest

from cosim.process.journal import JOURNAL_SIZE, Journal, Phase
from cosim.process.process_status import is_stopped
from cosim.process.supervisor import _Supervisor

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")


@pytest.fixture(autouse=True)
def settings(monkeypatch):
    """A short timeout; and no search for orphans, which would end other children of this process,
    such as servers of tests.
    """
    monkeypatch.setattr("cosim.process.supervisor.STOP_TIMEOUT", 0.2)
    monkeypatch.setattr("cosim.process.supervisor.child_processes", list)


def supervise(work, journal: Journal):
    """Run a function in a supervised process and return the outcome."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            os.setpgid(0, 0)
            work()
            journal.enter_phase(Phase.DONE)
        finally:
            os._exit(0)
    os.close(writer)
    with TemporaryFile() as stack:
        return _Supervisor(child, journal, reader, stack.fileno()).wait_for_child()


@pytest.fixture
def journal() -> Journal:
    return Journal(mmap.mmap(-1, JOURNAL_SIZE))


def stop() -> None:
    os.kill(os.getpid(), signal.SIGSTOP)


@pytest.mark.parametrize(
    "phase", [Phase.IDLE, Phase.WAITING, Phase.STEPPING, Phase.CALLING, Phase.RESULTS_WRITTEN]
)
def test_a_stopped_process_is_ended_in_each_phase(journal, phase):
    """Also where no call has a deadline, as while a real-time run waits."""
    began = time.monotonic()

    def work() -> None:
        journal.enter_phase(phase, 1000.0 if phase == Phase.STEPPING else float("inf"))
        stop()

    outcome = supervise(work, journal)
    assert "cosim: the run failed: its process was stopped from outside for 0.2 s" in (
        outcome.warning or str(outcome.failure)
    )
    assert 0.2 < time.monotonic() - began < 3.0


def test_a_process_that_is_continued_in_time_is_not_ended(journal):
    def work() -> None:
        for _ in range(3):
            subprocess.Popen(["/bin/sh", "-c", f"sleep 0.05; kill -CONT {os.getpid()}"])
            stop()

    outcome = supervise(work, journal)
    assert outcome.failure is None
    assert not outcome.warning


def test_a_stopped_process_is_recognized():
    process = subprocess.Popen(["/bin/sleep", "60"])
    assert not is_stopped(process.pid)
    process.send_signal(signal.SIGSTOP)
    os.waitpid(process.pid, os.WUNTRACED)
    assert is_stopped(process.pid)
    process.kill()
    process.wait()
    assert not is_stopped(process.pid)
