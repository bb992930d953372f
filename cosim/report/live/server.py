"""Serves the page of a run that is going on, to who knows its token and sits at this machine."""

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

#: a command is no longer than this (bytes)
MAX_COMMAND_LENGTH = 1 << 16

#: the page may ask this server, and nobody else anything
LIVE_CONTENT_SECURITY_POLICY = f"{CONTENT_SECURITY_POLICY}; connect-src 'self'"

_HEADERS = {
    "Content-Security-Policy": f"{LIVE_CONTENT_SECURITY_POLICY}; base-uri 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Referrer-Policy": "same-origin",
    "X-Content-Type-Options": "nosniff",
}


class RequestRefused(Exception):
    """A request that is not answered, with the status that says why."""


class LiveServer(ThreadingHTTPServer):
    """Listens from the beginning, serves `session` once it is there; paths begin with the token. `port` 0 is any free one."""

    daemon_threads = True
    session: LiveSession

    def __init__(self, port: int, token: str):
        self.token = token
        super().__init__((HOST, port), _Handler)
        self.allowed_hosts = {f"{name}:{self.server_port}" for name in (HOST, "localhost")}

    @property
    def url(self) -> str:
        return f"http://{HOST}:{self.server_port}/{self.token}/"

    def handle_error(self, request: Any, client_address: Any) -> None:
        """A browser that goes away is no error; nothing else is told about a request either."""


class _Handler(BaseHTTPRequestHandler):
    server: LiveServer
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "cosim", ""
    timeout = 60

    def do_GET(self) -> None:
        self._respond({"": self._send_page, "rows": self._send_rows})

    def do_POST(self) -> None:
        self._respond({"command": self._run_command})

    def log_message(self, format: str, *args: Any) -> None:
        """The terminal belongs to the run."""

    def _respond(self, resources: dict[str, Any]) -> None:
        try:
            resource = self._authorized_resource()
            if resource not in resources:
                raise RequestRefused(HTTPStatus.NOT_FOUND)
            resources[resource]()
        except RequestRefused as refused:
            self.close_connection = True
            self._send(refused.args[0], "text/plain", refused.args[0].phrase.encode())

    def _authorized_resource(self) -> str:
        """The resource that is asked for: by who sits here and knows the token; commands come from the page itself."""
        hosts, origins = (self.headers.get_all(name, []) for name in ("Host", "Origin"))
        if len(hosts) != 1 or hosts[0] not in self.server.allowed_hosts:
            raise RequestRefused(HTTPStatus.FORBIDDEN)
        token, _, resource = urlsplit(self.path).path.removeprefix("/").partition("/")
        if not compare_digest(token.encode(), self.server.token.encode()):
            raise RequestRefused(HTTPStatus.FORBIDDEN)
        expected = [f"http://{hosts[0]}"]
        if origins != expected and (origins or self.command == "POST"):
            raise RequestRefused(HTTPStatus.FORBIDDEN)
        return resource

    def _send_page(self) -> None:
        about = self.server.session.page_data()
        if about is None:
            raise RequestRefused(HTTPStatus.GONE)
        data = embed_json({"scene": about.pop("scene"), "live": about})
        text = render_page(
            "replay.html", title=about["name"], description=about["description"], data=data, policy=LIVE_CONTENT_SECURITY_POLICY
        )
        self._send(HTTPStatus.OK, "text/html; charset=utf-8", text.encode())

    def _send_rows(self) -> None:
        """One line of JSON, then float32 (see `feed`)."""
        try:
            query = parse_qs(urlsplit(self.path).query)
            first, version = (int(query[name][0]) for name in ("first", "version"))
        except (KeyError, ValueError):
            raise RequestRefused(HTTPStatus.BAD_REQUEST) from None
        if first < 0:
            raise RequestRefused(HTTPStatus.BAD_REQUEST)
        state, rows = self.server.session.wait_for_rows(first, version)
        self._send(HTTPStatus.OK, "application/octet-stream", json.dumps(state).encode() + b"\n" + rows)

    def _run_command(self) -> None:
        answer = self.server.session.send_command(self._read_message())
        status = HTTPStatus.BAD_REQUEST if "error" in answer else HTTPStatus.OK
        self._send(status, "application/json", json.dumps(answer).encode())

    def _read_message(self) -> dict[str, Any]:
        if self.headers.get_content_type() != "application/json":
            raise RequestRefused(HTTPStatus.UNSUPPORTED_MEDIA_TYPE)
        length = self.headers.get("Content-Length", "")
        if not (length.isascii() and length.isdigit()) or len(length) > 9:
            raise RequestRefused(HTTPStatus.LENGTH_REQUIRED)
        if int(length) > MAX_COMMAND_LENGTH:
            raise RequestRefused(HTTPStatus.REQUEST_ENTITY_TOO_LARGE)
        try:
            message = json.loads(self.rfile.read(int(length)))
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, dict):
            raise RequestRefused(HTTPStatus.BAD_REQUEST)
        return message

    def _send(self, status: HTTPStatus, kind: str, body: bytes) -> None:
        self.send_response(status)
        for name, value in {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(body))}.items():
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)
