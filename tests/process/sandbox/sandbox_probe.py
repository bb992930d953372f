"""Component that tries forbidden operations and prints their outcome."""

import json
import os
import socket
from pathlib import Path

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


def attempt(act):
    try:
        return act()
    except OSError as error:
        return type(error).__name__


class SandboxProbe(Fmi2Slave):
    """Targets of the forbidden operations: files `private` and `own`, `port`, `process`."""

    def __init__(self, private, own, port, process, **arguments):
        super().__init__(**arguments)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))
        here = Path(__file__)
        self.attempts = {
            "write beside its source": lambda: here.with_name("mine.txt").write_text("mine"),
            "write to the system": lambda: Path("/usr/lib/mine.txt").write_text("mine"),
            "write to its own folder": lambda: Path(own).write_text("mine"),
            "read a private file": lambda: Path(private).read_text(),
            "connect": lambda: socket.create_connection(("127.0.0.1", port), 2) and "connected",
            "send": lambda: socket.socket(type=socket.SOCK_DGRAM).sendto(
                b"out", ("127.0.0.1", port)
            ),
            "signal": lambda: os.kill(process, 0),
            "see processes": lambda: max(
                int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()
            ),
        }

    def exit_initialization_mode(self):
        print(json.dumps({what: attempt(act) for what, act in self.attempts.items()}))

    def do_step(self, current_time, step_size):  # noqa: ARG002  signature of Fmi2Slave
        return True
