"""Sweeps of a scenario whose Python file does not return from its import end, and leave no process
of their own.
"""

from __future__ import annotations

import json

import pytest
from cosim_command import run_cosim

pytestmark = pytest.mark.slow

HANGS = "import time\ntime.sleep(3600)\n"
#: the process ends, but another one keeps its connections for some seconds
LEAVES_A_PROCESS = "import os, time\nif os.fork():\n    os._exit(0)\ntime.sleep(8)\nos._exit(0)\n"


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        (HANGS, "did not return within 0.3 s"),
        (LEAVES_A_PROCESS, "it ended the process with exit code 0"),
    ],
    ids=["hangs", "leaves a process"],
)
def test_a_module_that_does_not_return_is_named(source, reason, tmp_path):
    (tmp_path / "slow.py").write_text(source)
    scenario = {
        "name": "s",
        "stop_time": 1,
        "step_size": 0.1,
        "components": {"c": {"python": "slow.py:C"}},
    }
    (tmp_path / "s.json").write_text(json.dumps({**scenario, "deadlines": {"load": 0.3}}))
    levels = {"levels": {str(time): {"/stop_time": time} for time in (1, 2)}}
    sweep = {
        "name": "w",
        "scenario": "s.json",
        "factors": [{"name": "t", **levels}],
        "design": {"kind": "full_factorial"},
    }
    (tmp_path / "w.json").write_text(json.dumps(sweep))
    done = run_cosim("sweep", "w.json", "--workers", "1", cwd=tmp_path)
    place = " (slow.py:2)" if source is HANGS else ""
    assert (done.returncode, done.stderr.splitlines()) == (
        2,
        [f"c: loading the class failed: {reason}{place}"],
    )
