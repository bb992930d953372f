"""Fork server for the runs of a study on one machine.

`python -m cosim.studies.execution.fork_server DESCRIPTOR`.

It imports all modules that runs need, loads the scenario once, unpacks its FMUs and calls the
function `warm` of component classes that have one. It never loads a library of an FMU and never
starts a thread. For every file descriptor that it receives, it forks a worker process. A worker
handles one job at a time, each in a separate child process.
"""

import gc
import json
import os
import socket
import sys
import tempfile
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from signal import ITIMER_REAL, SIG_DFL, SIGALRM, SIGKILL, setitimer, signal
from typing import Any

from ...api.execution import RUN_MODULES
from ...components.fmi import FmuFile
from ...core.errors import CosimError
from ...process.limits import detach, thread_count
from ...process.temporary_folders import temporary_run_folder
from ...scenario import load_scenario
from ...scenario.named_functions import find_function_problems, load_function
from .job import READY, Job, StudyContext
from .run import FmuFiles, ReplayRequest, supervised_check, supervised_run


def serve_forks(control: socket.socket) -> None:
    """Receive the study context, preload it, and fork workers.

    End when the connection `control` is closed.
    """
    if not (message := control.recv(1 << 16)):
        return
    request = json.loads(message)
    context = StudyContext(
        Path(request["scenario"]),
        Path(request["root"]),
        request["deadline"],
        tuple(request["fmus"]),
    )
    with temporary_run_folder() as folder:
        tempfile.tempdir = os.environ["TMPDIR"] = folder
        for module in RUN_MODULES:
            import_module(module)
        fmu_files = dict(_preload(context)) if request["preload"] else {}
        gc.freeze()
        control.sendall(b"threads" if request["preload"] and thread_count() > 1 else READY)
        workers: list[int] = []
        try:
            while descriptors := socket.recv_fds(control, 16, 1)[1]:
                workers.append(_fork_worker(control, descriptors[0], context, fmu_files))
                os.close(descriptors[0])
        finally:
            for worker in workers:
                with suppress(ProcessLookupError, ChildProcessError):
                    os.kill(worker, SIGKILL)
                    os.waitpid(worker, 0)


def _preload(context: StudyContext) -> Iterator[tuple[Path, FmuFile]]:
    """Import the Python files that the scenario uses and yield the unpacked FMUs by path.

    The runs report any problems.
    """
    with suppress(CosimError):
        # a file that takes longer than its deadline ends this process
        scenario = load_scenario(context.scenario)
        spec, root = scenario.spec, scenario.root
        for node, name in root.leaves():
            with _ending_after(spec.deadlines.load):
                node.spec.components[name].preload(node.folder)
        with _ending_after(spec.deadlines.load):
            deque(find_function_problems(root, spec, spec, None), maxlen=0)
            for kpi in spec.kpis:
                load_function(kpi.python, root.folder)
    for path in context.fmus:
        with suppress(CosimError):
            file = FmuFile(context.root / path)
            if not file.description.once_per_process:
                file.acquire()
                yield (context.root / path).resolve(), file


@contextmanager
def _ending_after(seconds: float) -> Iterator[None]:
    """End this process if the block takes longer."""
    signal(SIGALRM, SIG_DFL)
    setitimer(ITIMER_REAL, seconds)
    try:
        yield
    finally:
        setitimer(ITIMER_REAL, 0)


def _fork_worker(
    control: socket.socket, descriptor: int, context: StudyContext, fmu_files: FmuFiles
) -> int:
    fork_server = os.getpid()
    child = os.fork()
    if child:
        return child
    try:
        control.close()
        detach(fork_server)
        _redirect_output()
        client = socket.socket(fileno=descriptor)
        client.sendall(f"{os.getpid()}\n".encode())
        with client.makefile("rb") as requests:
            for line in requests:
                answer = _handle_request(json.loads(line), context, fmu_files)
                client.sendall(f"{answer}\n".encode())
    finally:
        os._exit(0)


def _redirect_output() -> None:
    """Redirect standard output and standard error of this process to an unnamed file."""
    with tempfile.TemporaryFile("ab") as file:
        os.dup2(file.fileno(), 1)
        os.dup2(file.fileno(), 2)


def _handle_request(request: dict[str, Any], context: StudyContext, fmu_files: FmuFiles) -> str:
    job = Job(request["key"], request["settings"])
    if not request["check"]:
        replay = ReplayRequest(**request["replay"]) if "replay" in request else None
        return supervised_run(context, job, fmu_files, replay).to_json()
    try:
        problems = supervised_check(context, job, fmu_files)
    except CosimError as error:
        return json.dumps([(str(error), "")])
    return json.dumps([(problem.message, problem.where) for problem in problems])


if __name__ == "__main__":
    with suppress(ConnectionError):  # the pool was closed while this process was preloading
        serve_forks(socket.socket(fileno=int(sys.argv[1])))
