"""Modelica front ends for tests, in processes forked from one that has imported rumoca.

`python frontend_server.py DESCRIPTOR PROGRAM` runs the program `rumoca_process` for each message on
a socket. A message carries the descriptors of the input, output and error files. The answer is the
status of the forked process, as of `os.waitpid`.
"""

from __future__ import annotations

import atexit
import json
import os
import socket
import subprocess
import sys
from functools import cache
from runpy import run_path
from tempfile import TemporaryFile
from typing import Any


@cache
def shared_connection() -> socket.socket:
    """Return a connection to the server of this test process, started at its first use."""
    from cosim.export.modelica.frontend import rumoca_client

    own, other = socket.socketpair()
    command = [sys.executable, "-P", __file__, str(other.fileno()), str(rumoca_client._PROGRAM)]
    environment = {name: value for name, value in os.environ.items() if name != "MODELICAPATH"}
    server = subprocess.Popen(command, pass_fds=[other.fileno()], env=environment)
    other.close()

    def end() -> None:
        own.close()
        server.wait()

    atexit.register(end)
    return own


def run_forked(request: bytes, output: Any, errors: Any) -> str:
    """Run the front end like `rumoca_client._run_process`."""
    from cosim.process.failure_attribution import describe_exit_status

    with TemporaryFile() as file:
        file.write(request)
        file.seek(0)
        connection = shared_connection()
        socket.send_fds(connection, [b"\n"], [file.fileno(), output.fileno(), errors.fileno()])
        return describe_exit_status(int(connection.recv(16)))


def serve(connection: socket.socket, program: str) -> None:
    """Fork a front end for each message."""
    main = run_path(program)["main"]
    sys.modules["IPython"] = None  # type: ignore[assignment]
    import rumoca  # noqa: F401

    while descriptors := socket.recv_fds(connection, 1, 3)[1]:
        child = os.fork()
        if child == 0:
            run_front_end(main, descriptors)
        for descriptor in descriptors:
            os.close(descriptor)
        connection.sendall(str(os.waitpid(child, 0)[1]).encode())


def run_front_end(main: Any, descriptors: list[int]) -> None:
    """Run the front end with these standard streams and end the process."""
    code = 1
    try:
        for target, descriptor in enumerate(descriptors):
            os.dup2(descriptor, target)
        main(json.load(sys.stdin))
        code = 0
    finally:
        os._exit(code)


if __name__ == "__main__":
    serve(socket.socket(fileno=int(sys.argv[1])), sys.argv[2])
