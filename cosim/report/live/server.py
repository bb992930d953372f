"""HTTP server of the live page: local requests with the secret token only."""

import json
import socket
import time
from contextlib import suppress
from hmac import compare_digest
from http import HTTPStatus
from http.client import LineTooLong
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from io import BufferedIOBase
from threading import Lock
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..pages import CONTENT_SECURITY_POLICY, embed_json, render_page
from .session import LiveSession

HOST = "127.0.0.1"

#: largest size of a command (bytes)
MAX_COMMAND_LENGTH = 1 << 16

#: largest size of the head of a request (bytes)
MAX_HEAD_LENGTH = 1 << 14

#: connections at the same time; a further one ends the oldest, those without the token first
MAX_CONNECTIONS = 64

#: time that a connection has for its first request with the token (s)
ADMISSION_TIMEOUT = 5.0

#: time without a new request after which an admitted connection is closed (s)
IDLE_TIMEOUT = 60.0

#: wait after a connection could not be accepted, as when no descriptor is free (s)
_ACCEPT_RETRY_INTERVAL = 0.1

#: allows the page to send requests to this server, and to no other
LIVE_CONTENT_SECURITY_POLICY = f"{CONTENT_SECURITY_POLICY}; connect-src 'self'"

_HEADERS = {
    "Content-Security-Policy": (
        f"{LIVE_CONTENT_SECURITY_POLICY}; base-uri 'none'; frame-ancestors 'none'"
    ),
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


class RequestRefusedError(Exception):
    """Request that is answered only with the HTTP status that is the argument of the exception."""


class LiveServer(ThreadingHTTPServer):
    """Server in the supervising process.

    It accepts connections in one thread and handles each request in another.

    It listens as soon as it is created, and serves requests once `session` is set.

    Args:
        port: The port; 0 for any free one.
        token: The secret with which all paths begin.
    """

    daemon_threads = True
    request_queue_size = 128
    session: LiveSession

    def __init__(self, port: int, token: str) -> None:
        self.token = token
        #: end of the admission (s, monotonic) of each open connection, oldest first; None for one
        #: that has sent the token
        self._admissions: dict[socket.socket, float | None] = {}
        self._lock = Lock()
        super().__init__((HOST, port), _Handler)
        self.allowed_hosts = {f"{name}:{self.server_port}" for name in (HOST, "localhost")}

    @property
    def url(self) -> str:
        """Address of the page, including the token."""
        return f"http://{HOST}:{self.server_port}/{self.token}/"

    def get_request(self) -> tuple[socket.socket, Any]:
        """Accept a connection, after a pause if the last one could not be accepted."""
        try:
            return super().get_request()
        except OSError:
            time.sleep(_ACCEPT_RETRY_INTERVAL)
            raise

    def process_request(self, request: Any, client_address: Any) -> None:
        """Handle a connection in a thread; end the oldest one if there are too many."""
        with self._lock:
            if len(self._admissions) >= MAX_CONNECTIONS:
                waiting = (
                    connection for connection, end in self._admissions.items() if end is not None
                )
                self._end(next(waiting, next(iter(self._admissions))))
            self._admissions[request] = time.monotonic() + ADMISSION_TIMEOUT
        super().process_request(request, client_address)

    def admit(self, connection: socket.socket) -> None:
        """Keep a connection that has sent the token."""
        with self._lock:
            if connection in self._admissions:
                self._admissions[connection] = None

    def service_actions(self) -> None:
        """End the connections that have not sent the token in time.

        Called twenty times per second.
        """
        now = time.monotonic()
        with self._lock:
            for connection in [
                connection
                for connection, end in self._admissions.items()
                if end is not None and end < now
            ]:
                self._end(connection)

    def _end(self, connection: socket.socket) -> None:
        """End a connection; its thread reads the end of the data and closes it."""
        del self._admissions[connection]
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection whose thread has ended."""
        with self._lock:
            self._admissions.pop(request, None)
        super().shutdown_request(request)

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore errors of requests, such as a closed browser."""


class _HeadReader:
    """Reader of a connection that limits each request's head to `MAX_HEAD_LENGTH` bytes."""

    def __init__(self, file: BufferedIOBase) -> None:
        self._file, self._remaining = file, 0
        self.read, self.close = file.read, file.close

    def begin_request(self) -> None:
        """Start to count anew."""
        self._remaining = MAX_HEAD_LENGTH

    def readline(self, size: int) -> bytes:
        """Return a line; raise LineTooLong when the limit is reached."""
        line = self._file.readline(min(size, self._remaining + 1))
        self._remaining -= len(line)
        if self._remaining < 0:
            raise LineTooLong("the head of the request")
        return line


class _Handler(BaseHTTPRequestHandler):
    """Handler of one request, in a separate thread."""

    server: LiveServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "cosim", ""
    timeout = IDLE_TIMEOUT

    def setup(self) -> None:
        super().setup()
        self.rfile: Any = _HeadReader(self.rfile)

    def handle_one_request(self) -> None:
        self.rfile.begin_request()
        super().handle_one_request()

    def do_GET(self) -> None:
        self._respond({"": self._send_page, "rows": self._send_rows})

    def do_POST(self) -> None:
        self._respond({"command": self._run_command})

    def log_message(self, format: str, *args: Any) -> None:
        """Print nothing: the terminal shows the output of the run."""

    def _respond(self, resources: dict[str, Any]) -> None:
        try:
            resource = self._authorized_resource()
            if resource not in resources:
                raise RequestRefusedError(HTTPStatus.NOT_FOUND)
            resources[resource]()
        except RequestRefusedError as refusal:
            self.close_connection = True
            self._send(refusal.args[0], "text/plain", refusal.args[0].phrase.encode())

    def _authorized_resource(self) -> str:
        """Return the requested resource.

        Refuse requests from other hosts, without the token, or from other pages.
        """
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0] not in self.server.allowed_hosts:
            raise RequestRefusedError(HTTPStatus.FORBIDDEN)
        token, _, resource = urlsplit(self.path).path.removeprefix("/").partition("/")
        if not compare_digest(token.encode(), self.server.token.encode()):
            raise RequestRefusedError(HTTPStatus.FORBIDDEN)
        self.server.admit(self.connection)
        expected = [f"http://{hosts[0]}"]
        if origins != expected and (origins or self.command == "POST"):
            raise RequestRefusedError(HTTPStatus.FORBIDDEN)
        return resource

    def _send_page(self) -> None:
        about = self.server.session.page_data()
        if about is None:
            raise RequestRefusedError(HTTPStatus.GONE)
        data = embed_json({"scene": about.pop("scene"), "live": about})
        texts = {"title": about["name"], "description": about["description"], "failed": False}
        text = render_page("replay.html", **texts, data=data, policy=LIVE_CONTENT_SECURITY_POLICY)
        self._send(HTTPStatus.OK, "text/html; charset=utf-8", text.encode())

    def _send_rows(self) -> None:
        """Send one line of JSON with the state, then the rows as float32; see `RowFeed`."""
        try:
            query = parse_qs(urlsplit(self.path).query)
            first, version = (int(query[name][0]) for name in ("first", "version"))
        except (KeyError, ValueError):
            raise RequestRefusedError(HTTPStatus.BAD_REQUEST) from None
        if first < 0:
            raise RequestRefusedError(HTTPStatus.BAD_REQUEST)
        state, rows = self.server.session.wait_for_rows(first, version)
        self._send(
            HTTPStatus.OK, "application/octet-stream", json.dumps(state).encode() + b"\n" + rows
        )

    def _run_command(self) -> None:
        reply = self.server.session.send_command(self._read_message())
        status = HTTPStatus.BAD_REQUEST if "error" in reply else HTTPStatus.OK
        self._send(status, "application/json", json.dumps(reply).encode())

    def _read_message(self) -> dict[str, Any]:
        if self.headers.get_content_type() != "application/json":
            raise RequestRefusedError(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()) or len(length) > 9:
            raise RequestRefusedError(HTTPStatus.LENGTH_REQUIRED)
        if int(length) > MAX_COMMAND_LENGTH:
            raise RequestRefusedError(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        try:
            message = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, dict) or not all(map(_is_flat, message.values())):
            raise RequestRefusedError(HTTPStatus.BAD_REQUEST)
        return message

    def _send(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        for name, value in {
            **_HEADERS,
            "Content-Type": kind,
            "Content-Length": str(len(body)),
        }.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)


def _is_flat(value: Any) -> bool:
    """Return whether a JSON value is a scalar or a list of scalars."""
    return not any(
        isinstance(part, dict | list) for part in (value if isinstance(value, list) else [value])
    )
