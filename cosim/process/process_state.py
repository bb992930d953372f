"""Protection of the state of the process from foreign code, which one thread at a time may run."""

from __future__ import annotations

import errno
import os
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from ..core import component_log
from .journal import Phase, current_journal
from .process_attributes import ProcessState, set_signal_mask, signal_mask

try:
    from ._process_state import encode as _encode
except ImportError:  # not Linux, or installed without a C compiler

    def _encode() -> bytes:
        return b""


#: held while foreign code may change the state of the process, so that only one thread at a time
#: runs foreign code
_lock = threading.RLock()
#: states at the begin of the nested blocks of the thread that holds the lock
_saved_states: list[ProcessState] = []


class _StateCache:
    """The last state that was read with its encoding, because reading one takes much longer than encoding it."""

    def __init__(self) -> None:
        self._encoding, self._state = b"", ProcessState()

    def read(self) -> tuple[bytes, ProcessState]:
        """Return the encoding of the present state, b"" without the extension module, and the state."""
        encoding = _encode()
        if not encoding or encoding != self._encoding:
            self._encoding, self._state = encoding, ProcessState()
        return encoding, self._state


#: device and inode of the files behind the standard streams, see `_output_files`; root folder and
#: permission, see `_file_access`
_Files = tuple[list[tuple[int, int]], tuple[int, bool]]


@contextmanager
def restoring_process_state(component: str) -> Iterator[None]:
    """Restore the process state at the end of the block and warn of each change.

    Other threads wait before such a block.

    A supervised process that lost its standard output, its standard error or the access to the
    files of the run ends here: only its supervisor can still report the component and save the
    rows.

    Args:
        component: Name of the component or components that may change the state, for messages.
    """
    with _lock:
        saved = _save_state()
        try:
            yield
        finally:
            _restore_state(component, *saved)


def call_restoring_process_state(
    component: str, function: Callable[..., object], *arguments: Any
) -> None:
    """Call a function in a block of `restoring_process_state`; takes half as long."""
    with _lock:
        saved = _save_state()
        try:
            function(*arguments)
        finally:
            _restore_state(component, *saved)


def _save_state() -> tuple[bytes, ProcessState, _Files | None]:
    """Return the present state, its encoding, and the accessible files of a supervised process."""
    encoding, state = _state_cache().read()
    _saved_states.append(state)
    return encoding, state, (_output_files(), _file_access()) if current_journal() else None


def _restore_state(
    component: str, encoding: bytes, state: ProcessState, files: _Files | None
) -> None:
    _saved_states.pop()
    journal = current_journal()
    if journal and files and files != (now := (_output_files(), _file_access())):
        activity = (
            "closed the files of the process"
            if files[0] != now[0]
            else "gave up the access to the files of the run"
        )
        journal.record_call(component, f"a call that {activity}")
        journal.enter_phase(
            journal.phase if journal.phase == Phase.RESULTS_WRITTEN else Phase.CALLING
        )
        os._exit(70)
    if not encoding or _encode() != encoding:
        for change in state.restore():
            text = f"changed {change} of the process; it was changed back"
            component_log.log_message(component, component_log.WARNING, text)


@contextmanager
def exclusive_process_state() -> Iterator[None]:
    """Exclude other threads from this block and from `restoring_process_state` while the block runs."""
    with _lock:
        yield


@cache
def _state_cache() -> _StateCache:
    return _StateCache()


def _release_after_fork() -> None:
    """In a child forked while another thread held the lock, replace the lock and restore what that thread would restore."""
    global _lock
    if _lock.acquire(blocking=False):
        _lock.release()
        return
    _lock = threading.RLock()
    if _saved_states:
        mask = signal_mask()
        _saved_states[0].restore()
        set_signal_mask(mask)  # that of this thread, not of the other one
        _saved_states.clear()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_release_after_fork)


def _output_files() -> list[tuple[int, int]]:
    """Return device and inode of the files behind `sys.stdout` and `sys.stderr`, if they have any."""
    files = []
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            status = os.fstat(stream.fileno())
            files.append((status.st_dev, status.st_ino))
    return files


def _file_access() -> tuple[int, bool]:
    """Return the inode of the root folder, and whether files can be created in the folder of the run."""
    journal, root = current_journal(), Path("/").stat().st_ino
    try:
        if journal and journal.folder and hasattr(os, "O_TMPFILE"):
            os.close(os.open(journal.folder, os.O_TMPFILE | os.O_RDWR))  # a file without a name
    except OSError as error:
        return root, error.errno not in (errno.EACCES, errno.EPERM)
    return root, True
