"""A folder for temporary files that goes with its process: at its end, or, when it was killed, at the start of the next one."""

from __future__ import annotations

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from shutil import rmtree

PREFIX = "cosim-run-"


@contextmanager
def run_folder() -> Iterator[str]:
    """A temporary folder until the block ends; folders of processes that were killed before they could end are removed now.

    The process holds a lock on its folder, which the operating system takes back however the process ends. The lock is what
    makes a folder taken: process ids may be reused, or belong to another container with the same /tmp.
    """
    if sys.platform == "win32":
        with tempfile.TemporaryDirectory(prefix=PREFIX, ignore_cleanup_errors=True) as folder:
            yield folder
        return
    for stale in Path(tempfile.gettempdir()).glob(f"{PREFIX}*"):
        _remove_abandoned(stale)
    folder, lock = _locked_folder()
    try:
        yield folder
    finally:
        rmtree(folder, ignore_errors=True)
        os.close(lock)


def _locked_folder() -> tuple[str, int]:
    """A new folder and the descriptor that holds its lock; another process may have removed it before it was locked."""
    while True:
        folder = tempfile.mkdtemp(prefix=PREFIX)
        lock = _lock(folder, wait=True)
        if lock is not None and Path(folder).is_dir():
            return folder, lock
        if lock is not None:
            os.close(lock)


def _remove_abandoned(folder: Path) -> None:
    lock = _lock(folder, wait=False)
    if lock is not None:
        rmtree(folder, ignore_errors=True)
        os.close(lock)


def _lock(folder: str | Path, wait: bool) -> int | None:
    """A descriptor that holds the lock of a folder of this user; None when it cannot be had."""
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
