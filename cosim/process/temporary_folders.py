"""Temporary folders that are removed with their process.

If it was killed, a later process removes them.
"""

import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from shutil import rmtree
from weakref import finalize

from .output_lock import lock_descriptor

#: prefixes of folders for a run, an extracted FMU, and the files that an isolated FMU writes
RUN_PREFIX, FMU_PREFIX, WORKER_PREFIX = "cosim-run-", "cosim-fmu-", "cosim-worker-"


class LockedFolder:
    """New temporary folder, removed by `cleanup` or at the end of the process.

    The process holds a lock on the folder, which the operating system releases even if the process
    is killed. An unlocked folder is therefore abandoned. Process ids would not be sufficient,
    because they are reused, and another container may share /tmp. Abandoned folders are removed
    before the new one is created.

    Attributes:
        name: Path of the folder.
    """

    def __init__(self, prefix: str):
        _remove_abandoned_folders(tempfile.gettempdir())
        while True:
            self.name = tempfile.mkdtemp(prefix=prefix)
            lock = _lock_folder(self.name, wait=True)
            if Path(self.name).is_dir():  # else another process removed it before it was locked
                break
            if lock is not None:
                os.close(lock)
        self._finalizer = finalize(self, _remove_folder, self.name, lock, os.getpid())

    def cleanup(self) -> None:
        """Remove the folder."""
        self._finalizer()


@contextmanager
def temporary_run_folder() -> Iterator[str]:
    """Yield the path of a new folder, which is removed at the end of the block."""
    folder = LockedFolder(RUN_PREFIX)
    try:
        yield folder.name
    finally:
        folder.cleanup()


def _remove_folder(folder: str, lock: int | None, owner: int) -> None:
    """Remove the folder, except in a forked child; a later process removes remaining files."""
    if os.getpid() != owner:
        return
    rmtree(folder, ignore_errors=True)
    if lock is not None:
        with suppress(OSError):  # foreign code may have closed all descriptors
            os.close(lock)


@cache
def _remove_abandoned_folders(directory: str) -> None:
    """Remove abandoned folders; cached, so that it happens once per process."""
    for prefix in (RUN_PREFIX, FMU_PREFIX, WORKER_PREFIX):
        for folder in Path(directory).glob(f"{prefix}*"):
            lock = _lock_folder(folder, wait=False)
            if lock is not None:
                rmtree(folder, ignore_errors=True)
                os.close(lock)


def _lock_folder(folder: str | Path, wait: bool) -> int | None:
    """Lock a folder of this user and return the descriptor that holds the lock.

    None if that is impossible.
    """
    if sys.platform == "win32":
        return None
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_NOFOLLOW)
        try:
            if os.fstat(descriptor).st_uid == os.geteuid():
                lock_descriptor(descriptor, wait)
                return descriptor
        except OSError:
            pass
        os.close(descriptor)
    return None
