"""Folders for temporary files that go with their process: at its end, or, when it was killed, at the start of the next one."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from shutil import rmtree
from weakref import finalize

#: what a folder is for: a run, an extracted FMU, what an FMU in a process of its own writes
RUN_PREFIX, FMU_PREFIX, WORKER_PREFIX = "cosim-run-", "cosim-fmu-", "cosim-worker-"


class LockedFolder:
    """A new temporary folder until `cleanup`; folders of processes that were killed before they could end are removed first.

    The process holds a lock on its folder, which the operating system takes back however the process ends. The lock is what
    makes a folder taken: process ids may be reused, or belong to another container with the same /tmp.
    """

    def __init__(self, prefix: str):
        _remove_abandoned_folders(tempfile.gettempdir())
        self.name, lock = _create_locked_folder(prefix)
        self._finalizer = finalize(self, _remove_folder, self.name, lock, os.getpid())

    def cleanup(self) -> None:
        """Remove the folder; done at the end of the process at the latest."""
        self._finalizer()


@contextmanager
def temporary_run_folder() -> Iterator[str]:
    """A locked folder until the block ends."""
    folder = LockedFolder(RUN_PREFIX)
    try:
        yield folder.name
    finally:
        folder.cleanup()


def _remove_folder(folder: str, lock: int, owner: int) -> None:
    """What cannot be removed stays, and the next process finds it. A child that was forked owns nothing."""
    if os.getpid() != owner:
        return
    rmtree(folder, ignore_errors=True)
    with suppress(OSError):  # foreign code has closed all descriptors
        os.close(lock)


def _create_locked_folder(prefix: str) -> tuple[str, int]:
    """A new folder and the descriptor that holds its lock; another process may have removed it before it was locked."""
    while True:
        folder = tempfile.mkdtemp(prefix=prefix)
        lock = _lock_folder(folder, wait=True)
        if lock is None:
            return folder, -1  # no locks here: such folders are never taken for abandoned ones
        if Path(folder).is_dir():
            return folder, lock
        os.close(lock)


@cache
def _remove_abandoned_folders(directory: str) -> None:
    """Once in a process: 1000 runs need not look 1000 times."""
    for prefix in (RUN_PREFIX, FMU_PREFIX, WORKER_PREFIX):
        for folder in Path(directory).glob(f"{prefix}*"):
            lock = _lock_folder(folder, wait=False)
            if lock is not None:
                rmtree(folder, ignore_errors=True)
                os.close(lock)


def _lock_folder(folder: str | Path, wait: bool) -> int | None:
    """A descriptor that holds the lock of a folder of this user; None when it cannot be had."""
    if sys.platform == "win32":
        return None
    import fcntl

    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            if os.fstat(descriptor).st_uid == os.geteuid():
                fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
                return descriptor
        except OSError:
            pass
        os.close(descriptor)
    return None
