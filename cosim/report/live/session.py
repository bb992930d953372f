"""Session of a live view in the supervising process.

State of the run, its rows, and commands to it.
"""

import json
import time
from collections.abc import Mapping
from contextlib import suppress
from multiprocessing.connection import Connection
from queue import Empty, Queue
from threading import Condition, Lock, Thread
from typing import Any

import numpy as np

from ...process.journal import ROW_COUNT, Journal
from ...process.row_store import map_rows
from ...process.run_files import SIGNALS, TIME, RowsFile

#: interval at which a request checks for new rows, and the longest time that it waits for them (s)
POLL_INTERVAL, LONG_POLL_TIMEOUT = 0.03, 10.0

#: longest time that a command waits for the end of the current step (s)
COMMAND_TIMEOUT = 60.0

#: largest number of rows in a response
MAX_ROWS = 2000

#: largest number of values of all signals together in a live page; longer runs are downsampled
MAX_VALUES = 4_000_000


class RowFeed:
    """Reader of the numeric signals of a running simulation.

    Used by the request threads of the supervising process.

    Args:
        rows_file: The rows of the run.
        expected_rows: The number of rows of the complete run. Only every `stride`-th row is read if
            there are many.
    """

    def __init__(self, rows_file: RowsFile, expected_rows: int):
        self._dtype = rows_file.layout.dtype
        self._file = rows_file.path.open("rb")  # stays readable after the run has removed the file
        self.columns = ["time", *(column.name for column in rows_file.layout.columns)]
        self.stride = max(1, -(-expected_rows * len(self.columns) // MAX_VALUES))
        #: number of rows of the complete run after downsampling
        self.capacity = (expected_rows - 1) // self.stride + 1
        #: unit of each signal, "" if unknown
        self.units = {column.name: column.unit for column in rows_file.layout.columns}

    def available(self, recorded: int) -> int:
        """Return the number of rows after downsampling when `recorded` rows have been recorded.

        Rows between communication points are not in `capacity`; the page then shows fewer of the
        last rows while the run goes on.
        """
        return min(self.capacity, (recorded - 1) // self.stride + 1) if recorded else 0

    def read(self, first: int, count: int) -> bytes:
        """Return the bytes of `count` rows from `first` on, column by column.

        Float32, shape (columns, count).
        """
        table = np.empty((len(self.columns), count), "<f4")
        span = max(0, (count - 1) * self.stride + 1)
        # not read from the file, because threads that read at the same time share its position
        rows = map_rows(self._file, self._dtype, first * self.stride, span)[:: self.stride]
        table[0] = rows[TIME]
        with np.errstate(over="ignore"):  # beyond float32 a value is shown as infinite
            for column, name in enumerate(self.columns[1:], start=1):
                table[column] = rows[SIGNALS][name]
        return table.tobytes()

    def close(self) -> None:
        """Close the file of the rows."""
        self._file.close()


class LiveSession:
    """State of a live run and channel for commands.

    Used by the request threads of the supervising process.

    A separate thread receives the messages of the simulation process.

    Args:
        connection: The pipe to the simulation process.
        journal: The journal that the simulation process shares, with the number of recorded rows.
        wait: Let the simulation begin when a page fetches rows for the first time; otherwise it
            begins at once.
    """

    def __init__(self, connection: Connection, journal: Journal, wait: bool = False) -> None:
        self._connection, self._journal = connection, journal
        self._wait, self._begun, self._begin_lock = wait, False, Lock()
        self._replies: Queue[dict[str, Any]] = Queue()
        self._command_lock, self._changed = Lock(), Condition()
        self._commands = 0
        self._values: dict[str, Any] = {}
        self._run_info: dict[str, Any] = {}
        self._state: dict[str, Any] = {
            "version": 0,
            "paused": False,
            "speed": None,
            "time": 0.0,
            "ended": False,
        }
        self.feed: RowFeed | None = None
        #: time until which a page is considered open (s, monotonic), and whether it has fetched all
        #: rows
        self.last_viewed, self.fully_viewed = 0.0, False
        Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        """Receive messages until the simulation process closes the pipe.

        Runs in a separate thread.
        """
        try:
            while True:
                self._handle_message(json.loads(self._connection.recv_bytes()))
        except (EOFError, OSError, ValueError):
            self._connection.close()
            self.mark_ended()

    def _handle_message(self, message: dict[str, Any]) -> None:
        folder = self._journal.folder
        if "about" in message and folder and (rows_file := RowsFile.open(folder)):
            self.feed = RowFeed(rows_file, message["about"]["rows"])
            if not self._wait:
                self._begin()
        changes: dict[str, Any] = {
            key: message[key] for key in ("paused", "speed", "time", "ended") if key in message
        }
        with self._changed:
            self._run_info = message.get("about", self._run_info)
            self._state = {**self._state, **changes, "version": self._state["version"] + 1}
            self._changed.notify_all()
        if "id" in message:
            self._replies.put(message)

    def _begin(self) -> None:
        """Let the simulation begin, once: complete its handshake, before any command is sent."""
        with self._begin_lock, suppress(OSError):
            if self.feed and not self._begun:
                self._connection.send_bytes(b"{}")
                self._begun = True

    def mark_ended(self) -> None:
        """Record that the run has ended, and wake all waiting requests."""
        with self._changed:
            if not self._state["ended"]:
                self._state = {**self._state, "ended": True, "version": self._state["version"] + 1}
            self._changed.notify_all()
        self._replies.put({"id": None})

    def page_data(self) -> dict[str, Any] | None:
        """Return the description of the run for the page.

        Wait until there is one, and return None if the run ends before.
        """
        self._wait_until_started()
        if self.feed is None:
            return None
        adjustable = [
            {**each, "value": self._values.get(each["name"], each["value"])}
            for each in self._run_info["adjustable"]
        ]
        layout = {
            "columns": self.feed.columns,
            "units": self.feed.units,
            "capacity": self.feed.capacity,
        }
        return {**self._run_info, **layout, "adjustable": adjustable}

    def _wait_until_started(self) -> None:
        with self._changed:
            self._changed.wait_for(lambda: self._run_info or self._state["ended"])

    def wait_for_rows(self, first: int, version: int) -> tuple[dict[str, Any], bytes]:
        """Return the state of the run and the rows from `first` on, as bytes (see `RowFeed`).

        Waits until there are such rows, the version of the state is not `version`, or
        LONG_POLL_TIMEOUT has passed.
        """
        self._begin()
        self.last_viewed = until = time.monotonic() + LONG_POLL_TIMEOUT
        while True:
            state, feed = self._state, self.feed
            available = feed.available(self._journal[ROW_COUNT]) if feed else 0
            if available > first or state["version"] != version or time.monotonic() > until:
                break
            with self._changed:
                self._changed.wait(POLL_INTERVAL)
        count = max(0, min(available - first, MAX_ROWS))
        rows = feed.read(first, count) if feed else b""
        self.last_viewed = time.monotonic()
        self.fully_viewed = state["ended"] and first + count >= available
        return {**state, "first": first, "count": count, "complete": self.fully_viewed}, rows

    def send_command(self, message: Mapping[str, Any]) -> dict[str, Any]:
        """Send a command to the simulation process and return its reply (see `control`)."""
        self._wait_until_started()
        self._begin()
        with self._command_lock:
            self._commands += 1
            try:
                if not self._state["ended"]:
                    self._connection.send_bytes(
                        json.dumps({**message, "id": self._commands}).encode()
                    )
            except OSError:
                self.mark_ended()
            reply = self._wait_for_reply(self._commands)
        if message.get("command") == "set" and "error" not in reply:
            self._values[message["name"]] = message["value"]
        return reply

    def _wait_for_reply(self, number: int) -> dict[str, Any]:
        until = time.monotonic() + COMMAND_TIMEOUT
        while time.monotonic() < until:
            try:
                reply = self._replies.get(timeout=0.2)
            except Empty:
                if self._state["ended"]:
                    return {"error": "the run has ended"}
                continue
            if reply.pop("id") == number:
                return reply
        return {"error": f"the simulation did not reply within {COMMAND_TIMEOUT:g} s"}
