"""Whatever is killed: finished runs are kept, nothing is run twice, nothing is left behind."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time

import pytest
from lag_project import descendants, is_alive

RUNS = 14
#: runs of about a tenth of a second
SWEEP = {
    "factors": [{"name": "start", "set": "lag.y_start", "values": [1 + run / 10 for run in range(RUNS)]}],
    "settings": {"/stop_time": 100, "/record/interval": 1},
}


@pytest.fixture
def going(lag):
    """The sweep, going on, with a run finished."""
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
    """Go on with a sweep that was ended: it is whole, and nothing was made twice."""
    done = lag.run_command("sweep", "sweep.json", "--workers", 2)
    keys = [record["key"] for record in lag.records()]
    assert (done.code, len(keys), len(set(keys))) == (0, RUNS, RUNS), done.err
    assert len({row["end.value"] for row in lag.table()}) == RUNS


def test_a_killed_sweep_goes_on_where_it_was(lag, going):
    below = descendants(going.pid)
    going.kill()
    going.wait()
    before = lag.records()
    assert 1 <= len(before) < RUNS
    wait_until(lambda: not any(map(is_alive, below)))
    assert_completed(lag)
    assert lag.records()[: len(before)] == before


@pytest.mark.long
def test_processes_of_a_sweep_are_replaced_when_they_are_killed(lag, going):
    template = descendants(going.pid)[0]
    lane = descendants(template)[0]
    for victim in (lane, template):
        made = len(lag.records())
        os.kill(victim, signal.SIGKILL)
        wait_until(lambda made=made: len(lag.records()) > made)
    _, err = going.communicate(timeout=60)
    assert (going.returncode, len(lag.records())) == (0, RUNS), err
    assert not any("failure" in record for record in lag.records())


@pytest.mark.long
def test_an_interrupt_keeps_what_is_finished(lag, going):
    below = descendants(going.pid)
    going.send_signal(signal.SIGINT)
    out, err = going.communicate(timeout=60)
    assert going.returncode == 130, err
    assert len(lag.table()) == len(lag.records())
    assert f"{len(lag.records())} of {RUNS} runs" in out
    wait_until(lambda: not any(map(is_alive, below)), 10)
    assert_completed(lag)


@pytest.mark.parametrize(
    "request_", [b"", json.dumps({"scenario": "", "root": "", "fmus": [], "deadline": None, "cold": True}).encode()]
)
def test_a_template_whose_sweep_was_interrupted_ends_quietly(request_):
    own, other = socket.socketpair()
    with own, other:
        command = [sys.executable, "-m", "cosim.studies.execution.fork_server", str(other.fileno())]
        process = subprocess.Popen(command, pass_fds=[other.fileno()], stderr=subprocess.PIPE)
        own.sendall(request_)
    assert (process.communicate()[1], process.returncode) == (b"", 0)
