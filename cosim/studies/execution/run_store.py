"""Store of finished runs: a file with one line per record, so that no run is made twice.

Lines are only appended. A kill at any moment loses at most the line that is being written; the file
is synchronized with the disk every second. Unreadable lines are skipped.
"""

from __future__ import annotations

import errno
import os
import time
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from ...core import paths
from ...core.errors import InputError, OutputError, write_error
from ...process.output_lock import LOCK_FILE, acquire_lock
from .job import Job, Record, RunKey

RUN_STORE_FILE = "journal.jsonl"
#: time between two synchronizations with the disk (s)
_SYNC_INTERVAL = 1.0
#: start of every line
_LINE_PREFIX = b'{"key": "'
#: position in the file of a run that is not finished
_PENDING = -1


class RunStore:
    """Records of finished runs by key, in a folder locked against other processes.

    Only the positions of the records in the file are kept in memory. Records can be read inside the
    store's context.
    """

    def __init__(self, folder: Path, retry_failed: bool = False):
        """Open the store of a folder, or create it.

        Args:
            folder: folder of the file; it is created if necessary, and removed again if no record
                is written to it.
            retry_failed: treat failed runs as not finished.

        Raises:
            InputError: if the folder cannot be written, is used by another process, or holds a
                foreign file of that name.
            OutputError: if the disk is full or defective.
        """
        self.path = folder / RUN_STORE_FILE
        self._lock = acquire_lock(folder / LOCK_FILE, folder)
        try:
            self._open(retry_failed)
        except BaseException:
            self._lock.release()
            raise

    def _open(self, retry_failed: bool) -> None:
        try:
            self._is_new = not self.path.exists()
            if paths.file_to_replace(self.path) is None:
                raise OSError(errno.EINVAL, "Not a regular file")
            self._file = os.open(self.path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o666)
        except OSError as error:
            raise write_error(f'cannot write "{self.path}": {error.strerror}', error) from None
        #: number of lines that are not records; their runs are treated as not finished
        self.unreadable_lines = 0
        #: units of the KPIs of all records; a line holds only those that no earlier line has
        self.units: dict[str, str] = {}
        self._positions: dict[bytes, int] = {}
        self._end = self._synced = 0.0
        self._size = self._read(retry_failed)

    def _read(self, retry: bool) -> int:
        """Index the file, cut off an incomplete last line, and return the size (bytes)."""
        size = 0
        with self.path.open("rb") as file:
            for line in file:
                record = _parse_record(line)
                if (
                    size == 0
                    and not record
                    and not _LINE_PREFIX.startswith(line[: len(_LINE_PREFIX)])
                ):
                    os.close(self._file)
                    raise InputError(
                        f'"{self.path}" is not a file of finished runs; expected one, or no such '
                        "file"
                    )
                if not line.endswith(b"\n"):
                    os.ftruncate(self._file, size)
                    break
                if record:
                    key = bytes.fromhex(record.key)
                    if retry and record.failure:
                        self._positions.pop(key, None)
                    else:
                        self._positions[key] = size
                    self.units |= record.units
                self.unreadable_lines += record is None
                size += len(line)
        return size

    def claim_jobs(self, jobs: Iterable[Job]) -> Iterator[Job]:
        """Yield the jobs that are not finished, each key only once."""
        for job in jobs:
            if bytes.fromhex(job.key) not in self._positions:
                self._positions[bytes.fromhex(job.key)] = _PENDING
                yield job

    def add(self, record: Record) -> None:
        """Append a record.

        Raises:
            OutputError: if it cannot be written, as on a full disk.
        """
        new_units = {
            name: unit for name, unit in record.units.items() if self.units.get(name) != unit
        }
        line = replace(record, units=new_units).to_json().encode() + b"\n"
        try:
            if os.write(self._file, line) != len(line):
                raise OSError(28, "No space left on device")
        except OSError as error:
            os.ftruncate(self._file, self._size)
            raise OutputError(f'cannot write "{self.path}": {error.strerror}') from None
        self.units |= new_units
        self._positions[bytes.fromhex(record.key)] = self._size
        self._size += len(line)
        if time.monotonic() - self._synced > _SYNC_INTERVAL:
            self._sync()

    def _sync(self) -> None:
        os.fsync(self._file)
        self._synced = time.monotonic()

    def __contains__(self, key: RunKey) -> bool:
        return self._positions.get(bytes.fromhex(key), _PENDING) != _PENDING

    def __getitem__(self, key: RunKey) -> Record:
        """Return the record of a finished run."""
        self._reader.seek(self._positions[bytes.fromhex(key)])
        return Record.from_json(self._reader.readline())

    def __enter__(self) -> RunStore:
        self._reader = self.path.open("rb")
        return self

    def __exit__(self, *_: object) -> None:
        self._sync()
        self._reader.close()
        os.close(self._file)
        if self._is_new and not self._size:
            self.path.resolve().unlink(missing_ok=True)
        self._lock.release()


def _parse_record(line: bytes) -> Record | None:
    """Return the record of a line, or None if the line is not a complete record."""
    try:
        return Record.from_json(line) if line.endswith(b"\n") else None
    except ValueError:
        return None
