"""Completion of words in real shells on a terminal."""

import os
import pty
import select
import shutil
import sys
import time

import pytest

pytestmark = pytest.mark.slow

SETUPS = {
    "bash": (
        ["bash", "--norc", "--noprofile", "-i"],
        'eval "$(_COSIM_COMPLETE=bash_source cosim)"',
    ),
    "zsh": (
        ["zsh", "-f", "-i"],
        'autoload -Uz compinit; compinit -D -u; eval "$(_COSIM_COMPLETE=zsh_source cosim)"',
    ),
}


class Terminal:
    """A shell on a pseudo terminal."""

    def __init__(self, shell, folder):
        words, setup = SETUPS[shell]
        program = folder / "bin/cosim"
        program.parent.mkdir()
        program.write_text(f'#!/bin/sh\nexec {sys.executable} -m cosim "$@"\n')
        program.chmod(0o755)
        process, self._descriptor = pty.fork()
        if process == 0:
            os.chdir(folder)
            os.environ |= {
                "PATH": f"{program.parent}:{os.environ['PATH']}",
                "TERM": "dumb",
                "PS1": "> ",
                "HISTFILE": "",
            }
            os.execvp(words[0], words)  # noqa: S606
        self._process = process
        self.send(f"{setup}; echo rea''dy\n")
        self.wait_for("ready")

    def send(self, text):
        """Type a text."""
        os.write(self._descriptor, text.encode())

    def wait_for(self, text, seconds=60):
        """Read until a text appears."""
        shown, end = "", time.monotonic() + seconds
        while text not in shown:
            assert time.monotonic() < end, shown
            if select.select([self._descriptor], [], [], 1)[0]:
                shown += os.read(self._descriptor, 4096).decode(errors="replace")

    def close(self):
        """End the shell."""
        os.close(self._descriptor)
        os.waitpid(self._process, 0)


@pytest.fixture(params=list(SETUPS))
def terminal(request, tmp_path):
    if not shutil.which(request.param):
        pytest.skip(f"needs {request.param}")
    (tmp_path / "my_mission.json").touch()
    terminal = Terminal(request.param, tmp_path)
    yield terminal
    terminal.close()


def test_commands_scenarios_roles_and_files_are_completed(terminal):
    terminal.send("cosim reg\t")
    terminal.wait_for("regress")
    terminal.send("demo1_wi\t")
    terminal.wait_for("demo1_wind")
    terminal.send("my_mi\t")
    terminal.wait_for("my_mission.json")
    terminal.send("\x15cosim bench-controller x.fmu --role uav_mi\t")
    terminal.wait_for("uav_mixer")
    terminal.send("\x15cosim sweep demo1_l\t")
    terminal.wait_for("demo1_landing")
