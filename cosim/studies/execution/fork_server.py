"""Warm process that forks all runs of a sweep on one machine: `python -m cosim.studies.execution.fork_server DESCRIPTOR`.

It has imported everything, read the scenario once, unpacked its FMUs and let classes of components prepare what they can (by a
function `warm`, where they have one); it has never loaded a binary or started a thread. For every descriptor it is sent it forks
a lane: a process that answers one job after the other, each with a child process of its own.
"""

from __future__ import annotations

import gc
import json
import os
import socket
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from signal import SIGKILL
from typing import Any

from ...components.fmi import FmuFile
from ...components.python_import import load_object
from ...core.errors import CosimError
from ...process.sandbox.limits import detach, thread_count
from ...process.temporary_folders import temporary_run_folder
from ...scenario import load_scenario
from ...scenario.named_functions import function_problem, load_function
from ...scenario.nested_systems import Scenario
from .job import Job, StudyContext
from .run import FmuFiles, ReplayRequest, supervised_check, supervised_run

#: what a run imports on its way
_PRELOADED_MODULES = (
    "fmpy.fmi1",
    "fmpy.fmi2",
    "fmpy.fmi3",
    "cosim.components.fmi.isolated.isolated_fmu",
    "cosim.engine.native_executor",
    "numpy.random",
)


def serve_forks(control: socket.socket) -> None:
    """Fork lanes until whoever started this process is gone."""
    if not (message := control.recv(1 << 16)):
        return
    request = json.loads(message)
    order = StudyContext(Path(request["scenario"]), Path(request["root"]), request["deadline"], tuple(request["fmus"]))
    with temporary_run_folder() as folder:
        tempfile.tempdir = os.environ["TMPDIR"] = folder
        for module in _PRELOADED_MODULES:
            import_module(module)
        prepared = {} if request["cold"] else dict(_preload(order))
        gc.freeze()
        control.sendall(b"warm" if request["cold"] or thread_count() == 1 else b"cold")
        lanes: list[int] = []
        try:
            while descriptors := socket.recv_fds(control, 16, 1)[1]:
                lanes.append(_fork_worker(control, descriptors[0], order, prepared))
                os.close(descriptors[0])
        finally:
            for lane in lanes:
                with suppress(ProcessLookupError, ChildProcessError):
                    os.kill(lane, SIGKILL)
                    os.waitpid(lane, 0)


def _preload(order: StudyContext) -> Iterator[tuple[Path, FmuFile]]:
    """Import what the scenario uses as it stands in its file, unpack all FMUs; what is wrong with them, the runs will say."""
    with suppress(CosimError):
        _preload_components(load_scenario(order.scenario))
    for path in order.fmus:
        with suppress(CosimError):
            file = FmuFile(order.root / path)
            if not file.description.once_per_process:
                file.acquire()
                yield (order.root / path).resolve(), file


def _preload_components(scenario: Scenario) -> None:
    for node, name in scenario.root.leaves():
        reference = node.spec.components[name].python
        if reference and (warm := getattr(load_object(reference, node.folder), "warm", None)):
            warm()
    for kpi in (*scenario.spec.kpis, *scenario.spec.figures):
        function_problem(kpi, scenario.root.folder)
    for kpi in scenario.spec.kpis:
        load_function(kpi.python, scenario.root.folder)


def _fork_worker(control: socket.socket, descriptor: int, order: StudyContext, prepared: FmuFiles) -> int:
    template = os.getpid()
    child = os.fork()
    if child:
        return child
    try:
        control.close()
        detach(template)
        _redirect_output()
        _serve_requests(socket.socket(fileno=descriptor), order, prepared)
    finally:
        os._exit(0)


def _redirect_output() -> None:
    """What is printed here goes to a file without a name."""
    with tempfile.TemporaryFile("ab") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)


def _serve_requests(client: socket.socket, order: StudyContext, prepared: FmuFiles) -> None:
    with client.makefile("rb") as requests:
        for line in requests:
            client.sendall((_handle_request(json.loads(line), order, prepared) + "\n").encode())


def _handle_request(request: dict[str, Any], order: StudyContext, prepared: FmuFiles) -> str:
    job = Job(request["key"], request["settings"])
    if not request["check"]:
        replay = ReplayRequest(**request["replay"]) if "replay" in request else None
        return supervised_run(order, job, prepared, replay).to_json()
    try:
        found = supervised_check(order, job, prepared)
    except CosimError as error:
        return json.dumps([(str(error), "")])
    return json.dumps([(problem.message, problem.where) for problem in found])


if __name__ == "__main__":
    with suppress(ConnectionError):  # it was interrupted while this process warmed up
        serve_forks(socket.socket(fileno=int(sys.argv[1])))
