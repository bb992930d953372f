"""A run that can be looked at: the address of its page, and both ends of the pipe to it."""

from __future__ import annotations

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

#: at the end a page that is open has so long to fetch the last rows (s)
FINAL_FETCH_TIMEOUT = 2.0


class LiveView:
    """Listens on a port of this machine (0: any free one) before the run's process is born, so that its address is known.

    Raises InputError when the port cannot be had.
    """

    def __init__(self, port: int):
        try:
            self._server = LiveServer(port, token_urlsafe(24))
        except OSError as error:
            raise InputError(f"--view cannot listen on {HOST}:{port}: {error.strerror}") from None
        self._parent_end, self._child_end = Pipe()

    @property
    def url(self) -> str:
        return self._server.url

    def open_in_child(self) -> Connection:
        """In the run's process: its end of the pipe. It keeps nothing else of this."""
        self._server.socket.close()
        self._parent_end.close()
        return self._child_end

    @contextmanager
    def serve(self, journal: Journal) -> Iterator[None]:
        """In the supervising process: serve the page until the run has ended and who looks at it has seen the end."""
        self._child_end.close()
        session = self._server.session = LiveSession(self._parent_end, journal)
        session.start()
        thread = Thread(target=self._server.serve_forever, args=(0.05,), daemon=True)
        thread.start()
        try:
            yield
        finally:
            session.mark_ended()
            _wait_for_final_fetch(session)
            self._server.shutdown()
            self._server.server_close()


def _wait_for_final_fetch(session: LiveSession) -> None:
    until = time.monotonic() + FINAL_FETCH_TIMEOUT
    while time.monotonic() - session.last_viewed < FINAL_FETCH_TIMEOUT and not session.fully_viewed and time.monotonic() < until:
        time.sleep(0.02)


def has_display() -> bool:
    """Whether somebody sits here who can be shown a page."""
    return sys.stdout.isatty() and (sys.platform == "darwin" or bool({"DISPLAY", "WAYLAND_DISPLAY"} & os.environ.keys()))


def open_browser(url: str, folder: Path) -> None:
    """Show the page. Its address stands in a file in `folder` that only this user may read, and in no list of processes. The
    browser is started by a process that ends at once: the children of a supervisor end with it."""
    file = folder / "open.html"
    with os.fdopen(os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600), "w") as target:
        target.write(f'<!doctype html><meta http-equiv="refresh" content="0; url={url}"><title>cosim</title>')
    child = os.fork()
    if child == 0:
        try:
            os.setsid()
            click.launch(str(file))
        finally:
            os._exit(0)
    os.waitpid(child, 0)
