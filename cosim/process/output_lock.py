"""Locks of outputs and of the cache, so that two processes never write the same file at once.

The operating system releases a lock when the processes that hold it have ended, even if they were
killed. A lock file that a killed process left behind locks nothing.
"""

from __future__ import annotations

import json
import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path

from ..core.errors import InputError, write_error
from ..core.json_values import parse_object

#: lock file of an output directory
LOCK_FILE = ".cosim-lock"

_MAX_PATH_SIZE = 1 << 13


def lock_descriptor(descriptor: int, wait: bool = False) -> None:
    """Lock an open file or folder against other processes, until its last descriptor is closed.

    Args:
        descriptor: Descriptor of the file or folder.
        wait: Wait until no other process holds the lock.

    Raises:
        BlockingIOError: Another process holds the lock.
        OSError: The platform or the file system has no locks.
    """
    if sys.platform == "win32":
        raise OSError("this platform has no file locks")
    import fcntl

    fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))


class OutputLock:
    """Locked file beside an output; its content describes the process that writes the output.

    The folders that were created for it are removed with it if nothing was written to them.
    """

    def __init__(self, path: Path, descriptor: int, created_folders: int):
        self._path, self._descriptor = path, descriptor
        self._created_folders = created_folders

    def release(self) -> None:
        """Remove the file and release the lock."""
        with suppress(OSError):
            self._path.unlink(missing_ok=True)
            _remove_empty_folders(self._path, self._created_folders)
        os.close(self._descriptor)

    def send(self, connection: socket.socket) -> None:
        """Hand the lock over to the process at the other end of a connection.

        It stays locked on the way.
        """
        message = [bytes([self._created_folders]), os.fsencode(self._path)]
        socket.send_fds(connection, message, [self._descriptor])
        os.close(self._descriptor)

    @classmethod
    def receive(cls, connection: socket.socket) -> OutputLock | None:
        """Return the lock that was sent through a connection; None if none was sent."""
        connection.setblocking(False)
        with suppress(BlockingIOError):
            message, descriptors, _, _ = socket.recv_fds(connection, _MAX_PATH_SIZE, 1)
            if descriptors:
                return cls(Path(os.fsdecode(message[1:])), descriptors[0], message[0])
        return None


def acquire_lock(path: Path, output: Path, process: int | None = None) -> OutputLock:
    """Create and lock a lock file.

    Args:
        path: The lock file. Missing folders are created; `OutputLock.release` removes them again if
            they are empty then.
        output: The output that it locks, as messages show it.
        process: Id of the process that other commands name as the holder; default: this process.

    Raises:
        InputError: Another process holds the lock, or the file cannot be written.
        OutputError: The disk is full or defective.
    """
    created = sum(not folder.exists() for folder in path.parents)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = _open_locked(path)
    except BlockingIOError:
        raise InputError(
            f'"{output}" is in use by {_read_holder(path)}; wait until it has ended, or choose '
            "another output"
        ) from None
    except OSError as error:
        with suppress(OSError):
            _remove_empty_folders(path, created)
        raise write_error(f'cannot write to "{output}": {error.strerror or error}', error) from None
    lock = OutputLock(path, descriptor, created)
    try:
        holder = {
            "process": process or os.getpid(),
            "host": os.uname().nodename if hasattr(os, "uname") else "this machine",
            "start": f"{datetime.now():%Y-%m-%d %H:%M:%S}",
        }
        os.ftruncate(descriptor, 0)
        os.write(descriptor, json.dumps(holder).encode())
    except OSError as error:
        lock.release()
        raise write_error(f'cannot write to "{output}": {error.strerror}', error) from None
    return lock


def _remove_empty_folders(path: Path, count: int) -> None:
    """Remove the innermost `count` folders of a path; raise OSError at one that is not empty."""
    for folder in list(path.parents)[:count]:
        folder.rmdir()


@contextmanager
def waiting_for_lock(path: Path) -> Iterator[None]:
    """Hold a lock file during the block, after waiting until no other process holds it.

    Args:
        path: The lock file; missing folders are created, and the file is left there.

    Raises:
        InputError: The file cannot be written.
        OutputError: The disk is full or defective.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        descriptor = _open_locked(path, wait=True)
    except OSError as error:
        raise write_error(f'cannot write to "{path.parent}": {error.strerror}', error) from None
    try:
        yield
    finally:
        os.close(descriptor)


def _open_locked(path: Path, wait: bool = False) -> int:
    """Create, open and lock a file.

    Repeat this if its former holder removed the file before it was locked.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        try:
            try:
                lock_descriptor(descriptor, wait)
            except BlockingIOError:
                raise
            except OSError:  # without locks, files are written as if no other process did
                pass
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(descriptor), path.stat()):
                    return descriptor
        except OSError:
            os.close(descriptor)
            raise
        os.close(descriptor)


def _read_holder(path: Path) -> str:
    """Return a description of the process that holds a lock."""
    try:
        holder = parse_object(path.read_bytes())
        return f"process {holder['process']} on {holder['host']}, started at {holder['start']}"
    except (OSError, ValueError, LookupError):  # it has not written the file yet
        return "another process"


class LockKeeper:
    """Context that holds the lock of a command's output until results are saved.

    The child sends the descriptor of its lock through a socket. So the lock survives a crash of the
    child, and foreign code in the child cannot release it.
    """

    def __enter__(self) -> LockKeeper:
        self._process = os.getpid()
        self._receiver, self._sender = socket.socketpair()
        return self

    def lock(self, path: Path, output: Path) -> None:
        """Lock an output, see `acquire_lock`.

        Called at most once, in this process or in a child that was forked.
        """
        acquire_lock(path, output, self._process).send(self._sender)
        self._sender.close()
        if os.getpid() != self._process:
            self._receiver.close()

    def __exit__(self, *_: object) -> None:
        self._sender.close()
        if lock := OutputLock.receive(self._receiver):
            lock.release()
        self._receiver.close()
