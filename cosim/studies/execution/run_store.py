"""What is known about finished runs: a file with one line per record, so that nothing is run twice.

Lines are only ever appended. A kill at any moment costs at most the line that was being written; the file is forced to the disk
every second. Lines that cannot be read are passed over.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from ...core.errors import InputError, OutputError
from .job import Job, Record

RUN_STORE_FILE = "journal.jsonl"
#: s
_SYNC_INTERVAL = 1.0
#: how every line begins
_LINE_PREFIX = b'{"key": "'
#: position of a record that is being made
_PENDING = -1


class RunStore:
    """Records by key, in a folder that no other process may use meanwhile; in memory are only their positions in the file.

    With `retry` runs that failed count as not done. Raises InputError when the folder cannot be used, or holds another file of
    that name.
    """

    def __init__(self, folder: Path, retry_failed: bool = False):
        self.path = folder / RUN_STORE_FILE
        try:
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise InputError(f'another sweep is writing to "{folder}"') from None
        except OSError as error:
            raise InputError(f'cannot write "{self.path}": {error.strerror}') from None
        #: lines that are no records; their runs count as not done
        self.unreadable_lines = 0
        self._positions: dict[bytes, int] = {}
        self._end = self._synced = 0.0
        self._size = self._read(retry_failed)

    def _read(self, retry: bool) -> int:
        """Index the file, and cut off what a kill or power cut has left of a last line; returns the size."""
        size = 0
        with self.path.open("rb") as file:
            for line in file:
                record = _parse_record(line)
                if size == 0 and not record and not _LINE_PREFIX.startswith(line[: len(_LINE_PREFIX)]):
                    os.close(self._file)
                    raise InputError(f'"{self.path}" is no file of finished runs, expected one or none')
                if not line.endswith(b"\n"):
                    os.ftruncate(self._file, size)
                    break
                if record:
                    self._index(record, size, retry)
                self.unreadable_lines += record is None
                size += len(line)
        return size

    def _index(self, record: Record, position: int, retry: bool) -> None:
        if retry and record.failure:
            self._positions.pop(bytes.fromhex(record.key), None)
        else:
            self._positions[bytes.fromhex(record.key)] = position

    def claim_jobs(self, jobs: Iterable[Job]) -> Iterator[Job]:
        """Those that are not done; of several with one key the first."""
        for job in jobs:
            if bytes.fromhex(job.key) not in self._positions:
                self._positions[bytes.fromhex(job.key)] = _PENDING
                yield job

    def add(self, record: Record) -> None:
        """Keep a record. Raises OutputError when the disk does not take it."""
        line = record.to_json().encode() + b"\n"
        try:
            if os.write(self._file, line) != len(line):
                raise OSError(28, "No space left on device")
        except OSError as error:
            os.ftruncate(self._file, self._size)
            raise OutputError(f'cannot write "{self.path}": {error.strerror}') from None
        self._positions[bytes.fromhex(record.key)] = self._size
        self._size += len(line)
        if time.monotonic() - self._synced > _SYNC_INTERVAL:
            self._sync()

    def _sync(self) -> None:
        os.fsync(self._file)
        self._synced = time.monotonic()

    def __contains__(self, key: str) -> bool:
        return self._positions.get(bytes.fromhex(key), _PENDING) != _PENDING

    def __getitem__(self, key: str) -> Record:
        """The record of a finished run."""
        self._reader.seek(self._positions[bytes.fromhex(key)])
        return Record.from_json(self._reader.readline())

    def __enter__(self) -> RunStore:
        self._reader = self.path.open("rb")
        return self

    def __exit__(self, *_: object) -> None:
        self._sync()
        self._reader.close()
        os.close(self._file)


def _parse_record(line: bytes) -> Record | None:
    """A line's record; None when it holds none."""
    try:
        record = Record.from_json(line)
        bytes.fromhex(record.key)
        return record if line.endswith(b"\n") and isinstance(record.kpis, dict) else None
    except (ValueError, TypeError):
        return None
