"""Time that a process has waited for a processor, which its deadlines do not count."""

import os
import signal
import time
from pathlib import Path

import pytest

from cosim.process.process_status import waiting_time


@pytest.fixture
def busy_processes():
    """Three processes that compute on one processor."""
    processes = []
    for _ in range(3):
        process = os.fork()
        if process == 0:
            os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
            while True:
                pass
        processes.append(process)
    time.sleep(0.1)
    yield processes
    for process in processes:
        os.kill(process, signal.SIGKILL)
        os.waitpid(process, 0)


@pytest.mark.skipif(not Path("/proc/self/schedstat").exists(), reason="the system does not tell it")
def test_processes_that_share_a_processor_wait_for_each_other(busy_processes):
    begin, before = time.monotonic(), [waiting_time(process) for process in busy_processes]
    time.sleep(0.6)
    wall = time.monotonic() - begin
    shares = [
        (waiting_time(process) - waited) / wall
        for process, waited in zip(busy_processes, before, strict=True)
    ]
    assert 1.5 < sum(shares) < 3.1  # 2 on a machine without other load


def test_a_process_that_does_not_exist_has_not_waited():
    assert waiting_time(-1) == 0.0
