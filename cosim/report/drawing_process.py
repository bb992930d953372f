"""Drawing of the figures of a run in separate processes, prepared while the simulation runs."""

from __future__ import annotations

import json
import os
import signal
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any, NoReturn

from ..core.errors import ComponentError
from ..process.failure_attribution import describe_exit_status
from ..process.journal import set_current_journal
from ..process.run_files import recover_recording
from ..results import Kpis, Result
from ..results.checks import CheckOutcome
from .figures import draw_figure, draw_nothing, save_figure

#: name, function and keyword arguments of a figure
Figure = tuple[str, Callable[..., Any], Mapping[str, Any]]

#: exit code of the process of a figure that raised an exception
_EXCEPTION = 1


class DrawingProcess:
    """Process that imports matplotlib and the figure functions during a simulation, and draws the figures after it.

    Create it before any FMU is loaded, so that it contains no code of FMUs. It draws each figure in a separate process. It ends
    when its context is left.

    Args:
        load_figures: Imports the figure functions; called in the process.
    """

    def __init__(self, load_figures: Callable[[], Iterable[Figure]]):
        requests, answers = os.pipe(), os.pipe()
        self._pictures = TemporaryDirectory(prefix="figures-")
        self._statuses: dict[str, int] | None = None
        sys.stdout.flush()
        sys.stderr.flush()
        self._process = os.fork()
        if self._process == 0:
            os.close(requests[1])
            os.close(answers[0])
            _run_process(
                load_figures, os.fdopen(requests[0], "rb"), os.fdopen(answers[1], "wb", buffering=0)
            )
        os.close(requests[0])
        os.close(answers[1])
        self._requests, self._answers = os.fdopen(requests[1], "wb"), os.fdopen(answers[0], "rb")

    def __enter__(self) -> DrawingProcess:
        return self

    def __exit__(self, *_: object) -> None:
        with suppress(ProcessLookupError, ChildProcessError):
            os.kill(self._process, signal.SIGKILL)
            os.waitpid(self._process, 0)
        for file in (self._requests, self._answers):
            with suppress(OSError):
                file.close()
        self._pictures.cleanup()

    def start(self, result: Result, run_folder: Path, folder: Path) -> None:
        """Begin to draw the figures of a result.

        Args:
            result: The result.
            run_folder: Folder with its recorded rows, until `wait_until_read` has returned.
            folder: Folder of the PNG files.
        """
        content = {
            "kpis": result.kpis,
            "timing": result.timing,
            "metadata": result.metadata,
            "checks": result.checks,
        }
        request = {
            "run_folder": str(run_folder),
            "rows": len(result.time),
            "folder": str(folder),
            "result": content,
        }
        with suppress(OSError):  # the process has ended
            self._requests.write(
                json.dumps({**request, "pictures": self._pictures.name}, default=str).encode()
                + b"\n"
            )
            self._requests.flush()

    def wait_until_read(self) -> None:
        """Wait until the process has opened the recorded rows."""
        self._answers.readline()

    def picture(self, name: str, function: str) -> str | None:
        """Wait until all figures are drawn, and return one as SVG text.

        None if drawing it raised an exception.

        Args:
            name: Name of the figure.
            function: Name of its function, for the message.

        Raises:
            ComponentError: The process that drew the figure has ended early.
        """
        if self._statuses is None:
            self._statuses = json.loads(self._answers.readline() or b"{}")
        status, file = self._statuses.get(name), Path(self._pictures.name, f"{name}.svg")
        if status is None or (os.WIFEXITED(status) and os.WEXITSTATUS(status) == _EXCEPTION):
            return None
        if not file.is_file():
            raise ComponentError(f'figure "{name}"', function, describe_exit_status(status))
        return file.read_text(encoding="utf-8")


def _run_process(
    load_figures: Callable[[], Iterable[Figure]], requests: IO[bytes], answers: IO[bytes]
) -> NoReturn:
    """Serve one request in this process, which was just forked, and end the process."""
    try:
        set_current_journal(None)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the simulation process reports an interrupt
        figures = _load(load_figures)
        if line := requests.readline():  # else the simulation failed
            _serve(json.loads(line), figures, answers)
    finally:
        os._exit(0)


def _load(load_figures: Callable[[], Iterable[Figure]]) -> Sequence[Figure]:
    """Import the figure functions and matplotlib.

    After a failure, the simulation process draws and reports the error.
    """
    with suppress(Exception):
        if figures := list(load_figures()):
            draw_nothing()
            return figures
    return []


def _serve(request: Mapping[str, Any], figures: Sequence[Figure], answers: IO[bytes]) -> None:
    content, recording = (
        request["result"],
        recover_recording(Path(request["run_folder"]), request["rows"]),
    )
    checks = [CheckOutcome(*outcome) for outcome in content["checks"]]
    result = Result(
        recording, Kpis(content["kpis"]), content["timing"], content["metadata"], checks
    )
    answers.write(b"\n")
    folders = Path(request["folder"]), Path(request["pictures"])
    functions = {name: function for name, function, _ in figures}
    specs = result.metadata["scenario"].get(
        "figures", ()
    )  # with the arguments that the run has resolved
    resolved = [
        (spec["name"], functions[spec["name"]], spec.get("arguments", {}))
        for spec in specs
        if spec["name"] in functions
    ]
    processes = {figure[0]: _fork_drawing(result, figure, *folders) for figure in resolved}
    statuses = {name: os.waitpid(process, 0)[1] for name, process in processes.items()}
    answers.write(json.dumps(statuses).encode() + b"\n")


def _fork_drawing(result: Result, figure: Figure, folder: Path, pictures: Path) -> int:
    """Draw a figure to NAME.png and NAME.svg in a separate process; return the process id."""
    process = os.fork()
    if process:
        return process
    code = _EXCEPTION
    try:
        name, function, arguments = figure
        drawn = draw_figure(result, name, function, arguments)
        save_figure(drawn, folder / f"{name}.png")
        save_figure(drawn, pictures / f"{name}.svg")
        sys.stdout.flush()
        sys.stderr.flush()
        code = 0
    finally:
        os._exit(code)
