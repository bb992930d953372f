"""`cosim run --view` as a user starts it, and requests to its page as a browser sends them."""

from __future__ import annotations

import json
import os
import time
from http.client import HTTPConnection
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import numpy as np
from cosim_command import StartedCommand


class HttpReply:
    """Status, headers and body of an answer."""

    def __init__(self, response: Any):
        self.status, self.headers, self.body = response.status, response.headers, response.read()

    def json(self) -> Any:
        return json.loads(self.body)


class LiveRun:
    """A run with a page."""

    def __init__(self, folder: Path, scenario: object, *options: str):
        self.out = folder / "out"
        words = ("run", scenario, "--view", "--no-report", "--output-dir", self.out)
        self.process = StartedCommand(*words, *options, cwd=folder, env=os.environ)
        self.url = self.process.first_line().removeprefix("live view: ").strip()
        parts = urlsplit(self.url)
        self.host, self.path = parts.netloc, parts.path
        self.version = -1

    def request(
        self, method: str, path: str, body: bytes | None = None, **headers: str | None
    ) -> HttpReply:
        """A request; underscores in names of headers are hyphens, a header that is None is left
        out.
        """
        connection = HTTPConnection(self.host, timeout=60)
        connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
        for name, value in {"Host": self.host, **headers}.items():
            if value is not None:
                connection.putheader(name.replace("_", "-"), value)
        connection.endheaders(body)
        try:
            return HttpReply(connection.getresponse())
        finally:
            connection.close()

    def get(self, resource: str = "", **headers: str | None) -> HttpReply:
        return self.request("GET", self.path + resource, **headers)

    def post(self, body: bytes, **headers: str | None) -> HttpReply:
        usual = {
            "Origin": f"http://{self.host}",
            "Content_Type": "application/json",
            "Content_Length": str(len(body)),
        }
        return self.request("POST", f"{self.path}command", body, **{**usual, **headers})

    def command(self, command: str, **more: Any) -> Any:
        return self.post(json.dumps({"command": command, **more}).encode()).json()

    def page(self) -> Any:
        """Return the data that the page receives when it is opened."""
        data = self.get().body.partition(b'id="replay-data">')[2].partition(b"</script>")[0]
        return json.loads(data)["live"]

    def rows(self, first: int = 0) -> tuple[Any, np.ndarray]:
        """The state, and the rows from `first` on, shape (columns, rows)."""
        state, _, rows = self.get(f"rows?first={first}&version={self.version}").body.partition(
            b"\n"
        )
        told = json.loads(state)
        self.version = told["version"]
        table = np.frombuffer(rows, "<f4")
        return told, table.reshape(-1, told["count"]) if told["count"] else table

    def count(self) -> int:
        """Return the number of recorded rows."""
        self.version = -1
        return int(self.rows()[0]["count"])

    def end(self) -> int:
        """Run to the end as fast as possible and return the exit code."""
        self.command("speed", factor=None)
        self.command("resume")
        return self.wait()

    def wait(self) -> int:
        self.output = "".join(self.process.communicate(timeout=60))
        return self.process.wait()

    def run_metadata(self) -> Any:
        return json.loads((self.out / "run.json").read_text())


def wait_until(condition: Any, limit: float = 30.0) -> Any:
    """The first true value of a condition."""
    end = time.monotonic() + limit
    while not (value := condition()):
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.01)
    return value
