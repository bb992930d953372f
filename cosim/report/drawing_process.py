"""Drawing of the figures of a run in processes of their own, prepared while the simulation runs."""

from __future__ import annotations

import os
import pickle
import signal
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import IO, Any, NamedTuple, NoReturn

from ..core.errors import ComponentError
from ..core.recording import Recording
from ..process.failure_attribution import describe_exit_status
from ..process.journal import set_current_journal
from ..process.run_files.folder import recover_recording
from ..results import Result
from .figures import draw_nothing, draw_picture

#: name, function and keyword arguments of a figure
Figure = tuple[str, Callable[..., Any], Mapping[str, Any]]


class _Request(NamedTuple):
    """Result without its recording, folder and number of the recorded rows, and folder of the figures."""

    result: Result
    run_folder: Path
    rows: int
    folder: Path


class DrawingProcess:
    """Process that imports matplotlib and the figure functions during a simulation, and draws the figures after it.

    Create it before any FMU is loaded: then it holds no foreign code of the simulation. It draws each figure in a process of its
    own. Leaving its context ends it.

    Args:
        load_figures: Imports the figure functions; called in the process.
    """

    def __init__(self, load_figures: Callable[[], Iterable[Figure]]):
        requests, answers = os.pipe(), os.pipe()
        sys.stdout.flush()
        sys.stderr.flush()
        self._process = os.fork()
        if self._process == 0:
            os.close(requests[1])
            os.close(answers[0])
            _run_process(load_figures, os.fdopen(requests[0], "rb"), os.fdopen(answers[1], "wb"))
        os.close(requests[0])
        os.close(answers[1])
        self._requests, self._answers = os.fdopen(requests[1], "wb"), os.fdopen(answers[0], "rb")

    def __enter__(self) -> DrawingProcess:
        return self

    def __exit__(self, *_: object) -> None:
        for file in (self._requests, self._answers):
            with suppress(OSError):
                file.close()
        with suppress(ProcessLookupError, ChildProcessError):
            os.kill(self._process, signal.SIGKILL)
            os.waitpid(self._process, 0)

    def start(self, result: Result, run_folder: Path, folder: Path) -> None:
        """Begin to draw the figures of a result.

        Args:
            result: The result.
            run_folder: Folder with its recorded rows, until `wait_until_read` has returned.
            folder: Folder of the figures.
        """
        request = _Request(replace(result, recording=Recording.empty()), run_folder, len(result.time), folder)
        with suppress(OSError):  # the process has ended: there will be no answer
            pickle.dump(request, self._requests)
            self._requests.flush()

    def wait_until_read(self) -> None:
        """Wait until the process has opened the recorded rows."""
        self._answer()

    def pictures(self) -> Iterator[tuple[str, str]]:
        """Wait for the figures, and yield name and SVG text of each.

        Raises:
            InputError: A figure function cannot be imported, or the result lacks a signal that it needs.
            ComponentError: A figure function failed, or its process crashed.
        """
        for name in self._answer():
            yield name, self._answer()

    def _answer(self) -> Any:
        try:
            answer = pickle.load(self._answers)  # noqa: S301  # from this process's own child
        except (OSError, EOFError):
            raise ComponentError("figures", "drawing", "the process that draws them has ended") from None
        if isinstance(answer, BaseException):
            raise answer
        return answer


def _run_process(load_figures: Callable[[], Iterable[Figure]], requests: IO[bytes], answers: IO[bytes]) -> NoReturn:
    """Serve one request in this process, which was just forked, and end the process."""
    try:
        set_current_journal(None)
        signal.signal(signal.SIGINT, signal.SIG_IGN)  # the simulation process reports an interrupt
        figures = _load(load_figures)
        with suppress(EOFError):  # the simulation failed
            request: _Request = pickle.load(requests)  # noqa: S301  # from this process's own parent
            _serve(request, figures, answers)
    finally:
        os._exit(0)


def _load(load_figures: Callable[[], Iterable[Figure]]) -> Sequence[Figure] | Exception:
    """Import the figure functions and what drawing needs; return the error if a function has one."""
    try:
        figures = list(load_figures())
    except Exception as error:
        return error
    if figures:
        draw_nothing()
    return figures


def _serve(request: _Request, figures: Sequence[Figure] | Exception, answers: IO[bytes]) -> None:
    result = replace(request.result, recording=recover_recording(request.run_folder, request.rows))
    _send(answers, None)
    if isinstance(figures, Exception):
        _send(answers, figures)
        return
    _send(answers, [name for name, _, _ in figures])
    drawings = [_fork_drawing(result, figure, request.folder) for figure in figures]
    for figure, (process, reader) in zip(figures, drawings, strict=True):
        with os.fdopen(reader, "rb") as file:
            answer = file.read()
        _, status = os.waitpid(process, 0)
        answers.write(answer or pickle.dumps(_crash(figure, status)))
        answers.flush()


def _crash(figure: Figure, status: int) -> ComponentError:
    name, function, _ = figure
    return ComponentError(f'figure "{name}"', function.__name__, describe_exit_status(status))


def _fork_drawing(result: Result, figure: Figure, folder: Path) -> tuple[int, int]:
    """Draw a figure in a process of its own; return its id and the descriptor of the pipe with its answer."""
    reader, writer = os.pipe()
    process = os.fork()
    if process:
        os.close(writer)
        return process, reader
    try:
        with os.fdopen(writer, "wb") as answers:
            _send(answers, _draw(result, figure, folder))
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(0)


def _draw(result: Result, figure: Figure, folder: Path) -> str | BaseException:
    """Draw a figure to a PNG file and return its SVG text, or the error."""
    try:
        return draw_picture(result, *figure, folder)
    except Exception as error:
        return error


def _send(answers: IO[bytes], answer: object) -> None:
    pickle.dump(answer, answers)
    answers.flush()
