"""Server process that forks `cosim` commands: `python -m cosim` without the time for its imports.

Reads one JSON object per line (see `cosim_command.ForkServer.run`) and answers {"code", "seconds",
"processes"}: the exit code as `subprocess` defines it, the wall time, and the ids of processes that
outlived the command. Those are killed; this process is their subreaper. With "observe" the file
"changes" in the working directory lists what the command changed in its process. With "wait": false
the answer is the process id of the command, and {"poll": id} asks for its exit code, null while it
runs.
"""

from __future__ import annotations

import atexit
import ctypes
import gc
import json
import locale
import os
import signal
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path
from typing import Any

from idle_folders import remove_idle_folders
from matplotlib.figure import Figure
from quick_compiler import compile_without_optimization

from cosim.cli import main
from cosim.components.python_import import load_object
from cosim.core import resources
from cosim.engine import ExecutorKind, executor_class, plan_run
from cosim.report.figures import figure_style, figure_to_svg

PRELOADED = (
    "api.single_fmu",
    "components.python_class",
    "components.fmi",
    "components.input_table",
    "components.python_fmu",
    "report.figures",
    "report.run_page",
    "report.run_page",
    "report.tables",
    "results.reference",
    "scenario.nested_systems",
    *(
        f"cli.commands.{name}"
        for name in ("bench_controller", "check", "regress", "run", "simulate", "sweep")
    ),
    "cli.bench_output",
    "cli.messages",
    "components.fmi.isolated",
    "process.sandbox.bubblewrap",
    "process.supervisor",
    "process.supervisor",
    "scenario.plausibility",
    "studies.controller_bench.trials",
)
#: modules that the commands import late, and some that those import by name
OTHERS = (
    "fmpy.fmi2",
    "fmpy.fmi3",
    "rich.console",
    "rich.table",
    "rich._emoji_codes",
    "email.parser",
    "concurrent.futures.thread",
)
OTHERS += (
    "encodings.utf_8_sig",
    "encodings.ascii",
    "encodings.unicode_escape",
    "pydantic.root_model",
    "pydantic.type_adapter",
)
OTHERS += ("jinja2.debug", "pythonfmu.builder", "numpy.ma")
#: classes and functions of shipped scenarios
SHIPPED = ("world.py:World", "kpis.py:waypoints", "figures.py:paths")
PR_SET_CHILD_SUBREAPER = 36


def serve_requests() -> dict[str, Any] | None:
    """Answer requests until the input ends; in a child that is to run a command, return the
    request.
    """
    for line in sys.stdin:
        request = json.loads(line)
        if "poll" in request:
            print(json.dumps(exit_code(request["poll"])), flush=True)
            continue
        began = time.monotonic()
        child = os.fork()
        if child == 0:
            prepare_child(**request)
            return dict(request)
        print(
            json.dumps(judge_child(child, began, request["limit"]) if request["wait"] else child),
            flush=True,
        )
    return None


def judge_child(child: int, began: float, limit: float) -> dict[str, Any]:
    """Wait for a command and return the answer about it."""
    code = wait_for_exit(child, began + limit)
    return {"code": code, "seconds": time.monotonic() - began, "processes": end_orphans()}


def exit_code(child: int) -> int | None:
    """Exit code of the child, None while it runs."""
    ended, status = os.waitpid(child, os.WNOHANG)
    return os.waitstatus_to_exitcode(status) if ended else None


def prepare_child(
    folder: str,
    output: str,
    environment: dict[str, str],
    stdin: str,
    executor: ExecutorKind,
    closed: list[int],
    **_: Any,
) -> None:
    """Make this process like a new one: session, working directory, environment, standard streams,
    executor.
    """
    os.setsid()
    os.chdir(folder)
    os.environ.update(environment)
    tempfile.tempdir = None
    plan_run.executor_class = lambda kind: executor_class(executor if kind == "auto" else kind)
    files = (
        (0, stdin, os.O_RDWR),
        (1, f"{output}/stdout", os.O_WRONLY),
        (2, f"{output}/stderr", os.O_WRONLY),
    )
    for number, name, flags in files:
        file = os.open(name, flags | os.O_CREAT | os.O_TRUNC * (number > 0), 0o666)
        os.dup2(file, number)
        os.close(file)
    for number in closed:  # the interpreter starts with None in place of the stream
        os.close(number)
        setattr(sys, ("stdin", "stdout", "stderr")[number], None)


def wait_for_exit(child: int, limit: float) -> int:
    """Exit code of the child, which is killed when it has not ended by the limit."""
    while (code := exit_code(child)) is None:
        if time.monotonic() > limit:
            os.kill(child, signal.SIGKILL)
        time.sleep(0.005)
    return code


def children() -> list[int]:
    return [
        int(word) for word in Path(f"/proc/self/task/{os.getpid()}/children").read_text().split()
    ]


def end_orphans(grace: float = 1.0) -> list[int]:
    """Ids of processes that are still there `grace` s after the command; they are ended, generation
    after generation.
    """
    left, latest = [], time.monotonic() + grace
    while found := children():
        for process in found:
            if os.waitpid(process, os.WNOHANG) == (0, 0) and time.monotonic() > latest:
                os.kill(process, signal.SIGKILL)
                os.waitpid(process, 0)
                left.append(process)
        time.sleep(0.005)
    return left


def run_and_exit(request: dict[str, Any]) -> None:
    """Run the command and end like an interpreter, but for taking its modules apart, which takes
    longer than the command.
    """
    code = 0
    try:
        if request["observe"]:
            run_observed(request["arguments"])
        else:
            main(request["arguments"])
    except SystemExit as ended:
        code = ended.code if isinstance(ended.code, int) else 1
    atexit._run_exitfuncs()
    for stream in filter(None, (sys.stdout, sys.stderr)):
        stream.flush()
    os._exit(code)


def process_state() -> dict[str, Any]:
    """Return the process state that no FMU may change."""
    own = ctypes.CDLL(None)
    own.getenv.restype = own.setlocale.restype = ctypes.c_char_p
    mask = os.umask(0)
    os.umask(mask)
    return {
        "folder": str(Path.cwd()),
        "umask": mask,
        "locale": str(own.setlocale(locale.LC_ALL, None)),
        "environment": [str(own.getenv(name)) for name in (b"HOME", b"PATH")],
        "signals": [
            str(signal.getsignal(number))
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGCHLD)
        ],
        "ignored": [
            line
            for line in Path("/proc/self/status").read_text().splitlines()
            if line.startswith("SigIgn")
        ],
        "rounding": [own.fegetround(), own.fegetexcept()],
        "flush to zero": 1e-310 * float("0.5") == 0.0,
        "descriptors": sorted(path.name for path in Path("/proc/self/fd").iterdir()),
        "threads": len(list(Path("/proc/self/task").iterdir())),
    }


def run_observed(arguments: list[str]) -> None:
    """The command as `python -m cosim` runs it, and a report of what it changed."""
    before, report = process_state(), Path("changes").absolute()
    try:
        main(arguments)
    finally:
        remove_idle_folders()
        after = process_state()
        report.write_text(
            "\n".join(
                f"{name}: {before[name]} -> {after[name]}"
                for name in before
                if before[name] != after[name]
            )
        )


if __name__ == "__main__":
    compile_without_optimization()
    if "--without-orphans" not in sys.argv:
        ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    for module in PRELOADED:
        import_module(f"cosim.{module}")
    for module in OTHERS:
        import_module(module)
    for reference in SHIPPED:
        load_object(reference, resources.root() / "plant_src")
    with figure_style():  # fills caches of matplotlib
        figure = Figure()
        figure.subplots().set_title("0")
    figure_to_svg(figure)
    gc.freeze()
    request = serve_requests()
    if request:
        run_and_exit(request)
