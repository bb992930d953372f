"""Commands in forked processes have the exit codes and messages of commands in new processes."""

import json
import os
import subprocess
import sys

import pytest

pytestmark = pytest.mark.skipif(not hasattr(os, "fork"), reason="cannot fork")

PROGRAM = """
import json, os, signal, sys
from pathlib import Path
from cosim.cli.forked_commands import forked_commands
from cosim.studies.regression import run_in_new_process

def children():
    words = Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    return [int(word) for word in words]

commands = json.loads(sys.argv[1])
with forked_commands(2) as run:
    forked = [run(words) for words in commands]
    for child in children():
        os.kill(child, signal.SIGKILL)
    replaced = run(commands[0])
new = [run_in_new_process(words) for words in commands]
def outcomes(runs):
    return [(done.returncode, done.stderr) for done in runs]

print(json.dumps([outcomes(forked), outcomes(new), outcomes([replaced]), children()]))
"""

BLOCK = """
import os, sys

class Block:
    def __init__(self, name):
        print(sys.argv[1:], sys.path[0], sys.stdin.read(), os.getcwd(), file=sys.stderr)

    def ports(self):
        raise ValueError("no ports")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_codes_and_messages_are_those_of_new_processes(tmp_path):
    (tmp_path / "block.py").write_text(BLOCK)
    scenario = {
        "name": "s",
        "stop_time": 1,
        "step_size": 0.5,
        "components": {"a": {"python": "block.py:Block"}},
    }
    (tmp_path / "s.json").write_text(json.dumps(scenario))
    commands = [
        ["run", "s.json", "--no-report", "--output-dir", "out"],
        ["run", "t.json"],
        ["runn"],
        ["list", "roles"],
    ]
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, json.dumps(commands)],
        cwd=tmp_path,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=True,
    )
    forked, new, replaced, children = json.loads(done.stdout)
    assert forked == new
    assert [code for code, _ in new] == [2, 2, 2, 0]
    assert replaced == forked[:1]
    assert children == []
