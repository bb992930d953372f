"""Supervision of a child process whose standard streams are closed."""

from __future__ import annotations

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
