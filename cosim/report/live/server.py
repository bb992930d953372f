"""HTTP server of the live page: local requests with the secret token only."""

from __future__ import annotations

import json
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..pages import CONTENT_SECURITY_POLICY, embed_json, render_page
from .session import LiveSession

HOST = "127.0.0.1"

#: largest size of a command (bytes)
MAX_COMMAND_LENGTH = 1 << 16

#: allows the page to send requests to this server, and to no other
LIVE_CONTENT_SECURITY_POLICY = f"{CONTENT_SECURITY_POLICY}; connect-src 'self'"

_HEADERS = {
    "Content-Security-Policy": f"{LIVE_CONTENT_SECURITY_POLICY}; base-uri 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


class RequestRefusedError(Exception):
    """Request that is answered only with the HTTP status that is the argument of the exception."""


class LiveServer(ThreadingHTTPServer):
    """Server in the supervising process: it accepts connections in one thread and handles each request in another.

    It listens as soon as it is created, and serves requests once `session` is set.

    Args:
        port: The port; 0 for any free one.
        token: The secret with which all paths begin.
    """

    daemon_threads = True
    session: LiveSession

    def __init__(self, port: int, token: str) -> None:
        self.token = token
        super().__init__((HOST, port), _Handler)
        self.allowed_hosts = {f"{name}:{self.server_port}" for name in (HOST, "localhost")}

    @property
    def url(self) -> str:
        """Address of the page, including the token."""
        return f"http://{HOST}:{self.server_port}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore errors of requests, such as a closed browser."""


class _Handler(BaseHTTPRequestHandler):
    """Handler of one request, in a separate thread."""

    server: LiveServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "cosim", ""
    timeout = 60

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
        """Return the requested resource; refuse requests from other hosts, without the token, or from other pages."""
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0] not in self.server.allowed_hosts:
            raise RequestRefusedError(HTTPStatus.FORBIDDEN)
        token, _, resource = urlsplit(self.path).path.removeprefix("/").partition("/")
        if not compare_digest(token.encode(), self.server.token.encode()):
            raise RequestRefusedError(HTTPStatus.FORBIDDEN)
        expected = [f"http://{hosts[0]}"]
        if origins != expected and (origins or self.command == "POST"):
            raise RequestRefusedError(HTTPStatus.FORBIDDEN)
        return resource

    def _send_page(self) -> None:
        about = self.server.session.page_data()
        if about is None:
            raise RequestRefusedError(HTTPStatus.GONE)
        data = embed_json({"scene": about.pop("scene"), "live": about})
        text = render_page(
            "replay.html", title=about["name"], description=about["description"], data=data, policy=LIVE_CONTENT_SECURITY_POLICY
        )
        self._send(HTTPStatus.OK, "text/html; charset=utf-8", text.encode())

    def _send_rows(self) -> None:
        """Send one line of JSON with the state, then the rows as float32 (see `feed`)."""
        try:
            query = parse_qs(urlsplit(self.path).query)
            first, version = (int(query[name][0]) for name in ("first", "version"))
        except (KeyError, ValueError):
            raise RequestRefusedError(HTTPStatus.BAD_REQUEST) from None
        if first < 0:
            raise RequestRefusedError(HTTPStatus.BAD_REQUEST)
        state, rows = self.server.session.wait_for_rows(first, version)
        self._send(HTTPStatus.OK, "application/octet-stream", json.dumps(state).encode() + b"\n" + rows)

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
        if not isinstance(message, dict):
            raise RequestRefusedError(HTTPStatus.BAD_REQUEST)
        return message

    def _send(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)
