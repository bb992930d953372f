"""What the supervising process knows of a run that is looked at, and how it passes commands on."""

from __future__ import annotations

import json
import time
from collections.abc import Mapping
from multiprocessing.connection import Connection
from queue import Empty, Queue
from threading import Condition, Lock, Thread
from typing import Any

from ...process.journal import ROWS, Journal
from ...process.run_files.folder import read_header
from .feed import Feed

#: rows are looked for this often, and a request waits for news this long (s)
LOOK, PATIENCE = 0.03, 10.0

#: a command may wait this long for the end of the present step (s)
LONGEST_STEP = 60.0

#: rows given out at a time
MOST_ROWS = 2000


class Session:
    """A run in the process at the other end of `link`. Safe to use from several threads."""

    def __init__(self, link: Connection, journal: Journal):
        self._link, self._journal = link, journal
        self._answers: Queue[dict[str, Any]] = Queue()
        self._one_at_a_time, self._changed = Lock(), Condition()
        self._commands = 0
        self._values: dict[str, Any] = {}
        self._about: dict[str, Any] = {}
        self._state: dict[str, Any] = {"version": 0, "paused": False, "speed": None, "time": 0.0, "ended": False}
        self.feed: Feed | None = None
        #: until when somebody looks (s, monotonic), and whether everything was shown until the end
        self.looked, self.complete = 0.0, False
        self._listener = Thread(target=self._listen, daemon=True)

    def start(self) -> None:
        self._listener.start()

    def _listen(self) -> None:
        try:
            while True:
                self._hear(json.loads(self._link.recv_bytes()))
        except (EOFError, OSError, ValueError):
            self._link.close()
            self.end()

    def _hear(self, message: dict[str, Any]) -> None:
        folder = self._journal.folder
        if "about" in message and folder and (header := read_header(folder)):
            self.feed = Feed(folder, header, message["about"]["rows"])
            self._link.send_bytes(b"{}")  # the first that the run hears; commands come after
        changes: dict[str, Any] = {key: message[key] for key in ("paused", "speed", "time", "ended") if key in message}
        with self._changed:
            self._about = message.get("about", self._about)
            self._state = {**self._state, **changes, "version": self._state["version"] + 1}
            self._changed.notify_all()
        if "id" in message:
            self._answers.put(message)

    def end(self) -> None:
        """Nothing more will come."""
        with self._changed:
            if not self._state["ended"]:
                self._state = {**self._state, "ended": True, "version": self._state["version"] + 1}
            self._changed.notify_all()
        self._answers.put({"id": None})

    def about(self) -> dict[str, Any] | None:
        """What a page has to know before the first row, as soon as the run has come that far; None when it has ended before."""
        self._wait_for_the_beginning()
        if self.feed is None:
            return None
        adjustable = [{**each, "value": self._values.get(each["name"], each["value"])} for each in self._about["adjustable"]]
        layout = {"columns": self.feed.columns, "units": self.feed.units, "capacity": self.feed.capacity}
        return {**self._about, **layout, "adjustable": adjustable}

    def _wait_for_the_beginning(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._about or self._state["ended"])

    def news(self, first: int, version: int) -> tuple[dict[str, Any], bytes]:
        """The state of the run and the rows from `first` on, when there are any or the state is not that of `version`; else
        after a while."""
        self.looked = until = time.monotonic() + PATIENCE
        while True:
            state, available = self._state, self._available()
            if available > first or state["version"] != version or time.monotonic() > until:
                break
            with self._changed:
                self._changed.wait(LOOK)
        count = max(0, min(available - first, MOST_ROWS))
        rows = self.feed.read(first, count) if self.feed else b""
        self.looked = time.monotonic()
        self.complete = state["ended"] and first + count >= available
        return {**state, "first": first, "count": count, "complete": self.complete}, rows

    def _available(self) -> int:
        return self.feed.available(self._journal[ROWS]) if self.feed else 0

    def command(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """What the run answers to a command (see `control`)."""
        self._wait_for_the_beginning()
        with self._one_at_a_time:
            self._commands += 1
            try:
                if not self._state["ended"]:
                    self._link.send_bytes(json.dumps({**message, "id": self._commands}).encode())
            except OSError:
                self.end()
            answer = self._answer(self._commands)
        if message.get("command") == "set" and "error" not in answer:
            self._values[message["name"]] = message["value"]
        return answer

    def _answer(self, number: int) -> dict[str, Any]:
        until = time.monotonic() + LONGEST_STEP
        while time.monotonic() < until:
            try:
                answer = self._answers.get(timeout=0.2)
            except Empty:
                if self._state["ended"]:
                    return {"error": "the run has ended"}
                continue
            if answer.pop("id") == number:
                return answer
        return {"error": f"no answer within {LONGEST_STEP:g} s"}
