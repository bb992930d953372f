"""Killed sweeps and workers: finished runs are kept, no run is made twice, no process is left
behind.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time

import pytest
from lag_project import descendants, is_alive

pytestmark = pytest.mark.slow

RUNS = 14
#: runs of about a tenth of a second
SWEEP = {
    "factors": [
        {"name": "start", "set": "lag.y_start", "values": [1 + run / 10 for run in range(RUNS)]}
    ],
    "settings": {"/stop_time": 100, "/record/interval": 1},
}


@pytest.fixture
def sweep_process(lag):
    """Process of a running sweep that has finished a run."""
    process = lag.start_command("sweep", lag.write(**SWEEP), "--workers", 2)
    wait_until(lambda: lag.records())
    yield process
    process.kill()
    process.communicate()


def wait_until(condition, seconds=60.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def assert_completed(lag):
    """Continue a sweep that was ended, and assert that it is complete and that no run was made
    twice.
    """
    done = lag.run_command("sweep", "sweep.json", "--workers", 2)
    keys = [record["key"] for record in lag.records()]
    assert (done.code, len(keys), len(set(keys))) == (0, RUNS, RUNS), done.err
    assert len({row["end.value"] for row in lag.table()}) == RUNS


def test_a_killed_sweep_is_continued_by_the_next_call(lag, sweep_process):
    processes = descendants(sweep_process.pid)
    sweep_process.kill()
    sweep_process.wait()
    before = lag.records()
    assert 1 <= len(before) < RUNS
    wait_until(lambda: not any(map(is_alive, processes)))
    assert_completed(lag)
    assert lag.records()[: len(before)] == before


@pytest.mark.long
def test_killed_workers_and_fork_servers_are_replaced(lag, sweep_process):
    fork_server = descendants(sweep_process.pid)[0]
    worker = descendants(fork_server)[0]
    for victim in (worker, fork_server):
        made = len(lag.records())
        os.kill(victim, signal.SIGKILL)
        wait_until(lambda made=made: len(lag.records()) > made)
    _, err = sweep_process.communicate(timeout=60)
    assert (sweep_process.returncode, len(lag.records())) == (0, RUNS), err
    assert not any("failure" in record for record in lag.records())


@pytest.mark.parametrize("whom", ["worker", "fork server", "both"])
def test_stopped_workers_and_fork_servers_are_replaced(lag, monkeypatch, whom):
    """No run is lost or made twice; the time limit of a stopped process is shortened here."""
    monkeypatch.setattr("cosim.studies.execution.worker_pool.STOP_TIMEOUT", 0.2)
    monkeypatch.setattr("cosim.studies.execution.worker_pool._STOP_CHECK_INTERVAL", 0.1)
    others = set(descendants(os.getpid()))
    sweep = threading.Thread(
        target=lag.run_command, args=("sweep", lag.write(**SWEEP), "--workers", 1)
    )
    sweep.start()
    wait_until(lambda: lag.records())
    fork_server, worker = [
        process for process in descendants(os.getpid()) if process not in others
    ][:2]
    for victim in {"worker": [worker], "fork server": [fork_server], "both": [fork_server, worker]}[
        whom
    ]:
        os.kill(victim, signal.SIGSTOP)
    sweep.join(60)
    assert not sweep.is_alive()
    assert (lag.last_result.code, len(lag.records())) == (0, RUNS), lag.last_result.err
    assert not any("failure" in record for record in lag.records())
    wait_until(lambda: not any(map(is_alive, (fork_server, worker))), 10)


@pytest.mark.long
def test_an_interrupted_sweep_keeps_its_finished_runs(lag, sweep_process):
    processes = descendants(sweep_process.pid)
    sweep_process.send_signal(signal.SIGINT)
    out, err = sweep_process.communicate(timeout=60)
    assert sweep_process.returncode == 130, err
    assert len(lag.table()) == len(lag.records())
    assert f"{len(lag.records())} of {RUNS} runs" in out
    wait_until(lambda: not any(map(is_alive, processes)), 10)
    assert_completed(lag)


@pytest.mark.parametrize(
    "request_",
    [
        b"",
        json.dumps(
            {"scenario": "", "root": "", "fmus": [], "deadline": None, "preload": False}
        ).encode(),
    ],
)
def test_a_fork_server_ends_without_output_when_its_sweep_was_interrupted(request_):
    own, other = socket.socketpair()
    with own, other:
        command = [sys.executable, "-m", "cosim.studies.execution.fork_server", str(other.fileno())]
        process = subprocess.Popen(command, pass_fds=[other.fileno()], stderr=subprocess.PIPE)
        own.sendall(request_)
    assert (process.communicate()[1], process.returncode) == (b"", 0)
