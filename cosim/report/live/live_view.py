"""The live view of a run: the HTTP server of its page and the pipe to the simulation process."""

import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from pathlib import Path
from secrets import token_urlsafe
from threading import Thread

import click

from ...core.errors import InputError
from ...process.journal import Journal
from .server import HOST, LiveServer
from .session import LiveSession

#: time that an open page has at the end to fetch the last rows (s)
FINAL_FETCH_TIMEOUT = 2.0


class LiveView:
    """Live view, created before the simulation process is forked.

    Both processes have their end of the pipe.

    The main thread of the supervising process calls `serve`; the simulation process calls
    `open_in_child`.

    Args:
        port: The port of the server on this machine; 0 for any free one.
        wait: Begin the simulation when a page has been opened.

    Raises:
        InputError: The port is not available.
    """

    def __init__(self, port: int, wait: bool = False) -> None:
        try:
            self._server = LiveServer(port, token_urlsafe(24))
        except OSError as error:
            raise InputError(f"--view cannot listen on {HOST}:{port}: {error.strerror}") from None
        self._wait = wait
        self._parent_end, self._child_end = Pipe()

    @property
    def url(self) -> str:
        """Address of the page, including its secret token."""
        return self._server.url

    def open_in_child(self) -> Connection:
        """Return the end of the pipe for the simulation process.

        The sockets of the supervising process are closed.
        """
        self._server.socket.close()
        self._parent_end.close()
        return self._child_end

    @contextmanager
    def serve(self, journal: Journal) -> Iterator[None]:
        """Serve the page from threads of the supervising process during this block.

        At the end of the block an open page gets time to fetch the last rows.

        Args:
            journal: The journal that the simulation process shares with the supervising process.
        """
        self._child_end.close()
        session = self._server.session = LiveSession(self._parent_end, journal, self._wait)
        thread = Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        try:
            yield
        finally:
            session.mark_ended()
            until = time.monotonic() + FINAL_FETCH_TIMEOUT
            while (
                time.monotonic() - session.last_viewed < FINAL_FETCH_TIMEOUT
                and not session.fully_viewed
                and time.monotonic() < until
            ):
                time.sleep(0.02)
            self._server.shutdown()
            self._server.server_close()


def has_display() -> bool:
    """Return True if standard output is a terminal of a machine with a display."""
    return sys.stdout.isatty() and (
        sys.platform == "darwin" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys())
    )


def open_browser(url: str, folder: Path) -> None:
    """Open the page in the browser.

    The address is passed in a file in `folder` that only this user can read, because every user can
    read the arguments of a process. The browser is started by an intermediate process that exits at
    once, because the children of a supervising process are ended with it.
    """
    file = folder / "open.html"
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as target:
        target.write(
            f'<!doctype html><meta http-equiv="refresh" content="0; url={url}"><title>cosim</title>'
        )
    child = os.fork()
    if child == 0:
        try:
            os.setsid()
            click.launch(str(file))
        finally:
            os._exit(0)
    os.waitpid(child, 0)
