"""Serves the page of a run that is going on, to who knows its token and sits at this machine."""

from __future__ import annotations

import json
from hmac import compare_digest
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any
from urllib.parse import parse_qs, urlsplit

from ..pages import POLICY, embedded, render
from .session import Session

ADDRESS = "127.0.0.1"

#: a command is no longer than this (bytes)
LONGEST_COMMAND = 1 << 16

#: the page may ask this server, and nobody else anything
LIVE_POLICY = f"{POLICY}; connect-src 'self'"

_HEADERS = {
    "Content-Security-Policy": f"{LIVE_POLICY}; base-uri 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


class Refused(Exception):
    """A request that is not answered, with the status that says why."""


class Server(ThreadingHTTPServer):
    """Listens from the beginning, serves `session` once it is there; paths begin with the token. `port` 0 is any free one."""

    daemon_threads = True
    session: Session

    def __init__(self, port: int, token: str):
        self.token = token
        super().__init__((ADDRESS, port), _Handler)
        self.hosts = {f"{name}:{self.server_port}" for name in (ADDRESS, "localhost")}

    @property
    def url(self) -> str:
        return f"http://{ADDRESS}:{self.server_port}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away is no error; nothing else is told about a request either."""


class _Handler(BaseHTTPRequestHandler):
    server: Server
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "cosim", ""
    timeout = 60

    def do_GET(self) -> None:
        self._answer({"": self._page, "rows": self._rows})

    def do_POST(self) -> None:
        self._answer({"command": self._command})

    def log_message(self, format: str, *args: Any) -> None:
        """The terminal belongs to the run."""

    def _answer(self, resources: dict[str, Any]) -> None:
        try:
            resource = self._checked()
            if resource not in resources:
                raise Refused(HTTPStatus.NOT_FOUND)
            resources[resource]()
        except Refused as refused:
            self.close_connection = True
            self._send(refused.args[0], "text/plain", refused.args[0].phrase.encode())

    def _checked(self) -> str:
        """The resource that is asked for: by who sits here and knows the token; commands come from the page itself."""
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0] not in self.server.hosts:
            raise Refused(HTTPStatus.FORBIDDEN)
        token, _, resource = urlsplit(self.path).path.removeprefix("/").partition("/")
        if not compare_digest(token.encode(), self.server.token.encode()):
            raise Refused(HTTPStatus.FORBIDDEN)
        expected = [f"http://{hosts[0]}"]
        if origins != expected and (origins or self.command == "POST"):
            raise Refused(HTTPStatus.FORBIDDEN)
        return resource

    def _page(self) -> None:
        about = self.server.session.about()
        if about is None:
            raise Refused(HTTPStatus.GONE)
        data = embedded({"scene": about.pop("scene"), "live": about})
        text = render("replay.html", title=about["name"], description=about["description"], data=data, policy=LIVE_POLICY)
        self._send(HTTPStatus.OK, "text/html; charset=utf-8", text.encode())

    def _rows(self) -> None:
        """One line of JSON, then float32 (see `feed`)."""
        try:
            query = parse_qs(urlsplit(self.path).query)
            first, version = (int(query[name][0]) for name in ("first", "version"))
        except (KeyError, ValueError):
            raise Refused(HTTPStatus.BAD_REQUEST) from None
        if first < 0:
            raise Refused(HTTPStatus.BAD_REQUEST)
        state, rows = self.server.session.news(first, version)
        self._send(HTTPStatus.OK, "application/octet-stream", json.dumps(state).encode() + b"\n" + rows)

    def _command(self) -> None:
        answer = self.server.session.command(self._message())
        status = HTTPStatus.BAD_REQUEST if "error" in answer else HTTPStatus.OK
        self._send(status, "application/json", json.dumps(answer).encode())

    def _message(self) -> dict[str, Any]:
        if self.headers.get_content_type() != "application/json":
            raise Refused(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()) or len(length) > 9:
            raise Refused(HTTPStatus.LENGTH_REQUIRED)
        if int(length) > LONGEST_COMMAND:
            raise Refused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        try:
            message = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, dict):
            raise Refused(HTTPStatus.BAD_REQUEST)
        return message

    def _send(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)
