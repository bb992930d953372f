"""Supervision of child processes that close their streams or call exit()."""

from __future__ import annotations

import ctypes
import subprocess
import sys

import pytest

#: prints how often the supervisor looked at a child that writes, closes descriptors and waits
PROGRAM = """
import os, sys, time
from cosim.process import supervisor

looks = []
check = supervisor._Supervisor._check_deadline
supervisor._Supervisor._check_deadline = lambda self: looks.append(0) or check(self)

def entry():
    os.write(1, b"last words")
    for descriptor in map(int, sys.argv[1:]):
        os.close(descriptor)
    time.sleep(6 * supervisor.POLL_INTERVAL)
    return 7

assert supervisor.run_supervised(entry).exit_code == 7
print(len(looks))
"""


@pytest.mark.parametrize("descriptors", ["12", "012", "1", ""])
def test_a_child_that_closed_its_output_is_looked_at_as_rarely_as_any(descriptors):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *descriptors], capture_output=True, text=True, check=True
    )
    assert int(done.stdout) < 20
    assert done.stderr == "last words"


#: the importer's exit handler, as one of a library whose threads a forked process lacks, crashes
INHERITED = """
import ctypes, os
from cosim.components.fmi.isolated.worker_process import WorkerLostError, WorkerProcess
from cosim.process.journal import JOURNAL_SIZE, Journal
from cosim.process.supervisor import run_supervised

library = ctypes.CDLL(None)
library.on_exit(library.abort, None)

def leave(*_):
    library.printf(b"last words\\n")  # stays in the buffer of the C library
    library.exit(7)

ended = run_supervised(leave)
print(ended.exit_code, ended.failure, flush=True)
worker = WorkerProcess("a", Journal(bytearray(JOURNAL_SIZE)), leave)
try:
    worker.request(b"{}\\n", 10.0)
except WorkerLostError as error:
    print(error, flush=True)
worker.stop()
os._exit(0)
"""


@pytest.mark.skipif(not hasattr(ctypes.CDLL(None), "on_exit"), reason="no on_exit")
def test_exit_in_foreign_code_runs_no_inherited_handlers():
    done = subprocess.run(
        [sys.executable, "-c", INHERITED], capture_output=True, text=True, check=True
    )
    assert done.stdout.splitlines() == [
        "1 cosim: the run failed: it ended the process with exit code 7, while no component was "
        "being called",
        "it ended the process with exit code 7",
    ]
    assert done.stderr == "last words\n" * 2
