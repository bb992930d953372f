"""Protection of the state of the process from foreign code, which one thread at a time may run.

The state is a list of attributes (`_ATTRIBUTES`), each with a function that reads it and one that
restores it. Reading all of them takes much longer than one call of a component. Therefore an
extension module encodes most of them as bytes, and Python reads them only if these have changed.
"""

import ctypes
import errno
import locale
import os
import resource
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, lru_cache
from pathlib import Path
from typing import Any, NamedTuple

from ..core import component_log
from .float_mode import FloatEnvironment
from .journal import Phase, current_journal

try:
    from ._process_state import encode as _encode
except ImportError:  # not Linux, or installed without a C compiler

    def _encode() -> bytes:
        return b""


_SIGNALS = (
    signal.SIGINT,
    signal.SIGTERM,
    signal.SIGSEGV,
    signal.SIGFPE,
    signal.SIGABRT,
    signal.SIGPIPE,
    signal.SIGCHLD,
)
_TIMERS = (signal.ITIMER_REAL, signal.ITIMER_VIRTUAL, signal.ITIMER_PROF)
_LIMITS = (
    resource.RLIMIT_AS,
    resource.RLIMIT_CPU,
    resource.RLIMIT_DATA,
    resource.RLIMIT_FSIZE,
    resource.RLIMIT_NOFILE,
)
#: descriptors that foreign code cannot use up (see `reserve_descriptors`)
_RESERVED_DESCRIPTORS = 32
_SIGACTION_SIZE = 512  # more than any platform's struct sigaction, which begins with the handler
_POINTER_SIZE = ctypes.sizeof(ctypes.c_void_p)


class ProcessState:
    """Values of all attributes in `_ATTRIBUTES` at the time of construction."""

    def __init__(self) -> None:
        self._values = [attribute.read() for attribute in _ATTRIBUTES]

    def restore(self) -> list[str]:
        """Restore all attributes; return a description of each one that had changed."""
        details = (
            (attribute.name, attribute.restore(value))
            for attribute, value in zip(_ATTRIBUTES, self._values, strict=True)
        )
        return [f"{name}{detail}" for name, detail in details if detail is not None]


@cache
def _c_library() -> Any:
    library = ctypes.CDLL(None)
    library.setlocale.restype = ctypes.c_char_p
    return library


def _working_directory() -> str:
    with suppress(OSError):
        return str(Path.cwd())
    return ""


def _set_working_directory(path: str) -> None:
    with suppress(OSError):  # the folder was removed meanwhile
        os.chdir(path)


def _umask() -> int:
    mask = os.umask(0o077)  # safe for a file that another thread creates now
    os.umask(mask)
    return mask


def _set_locale(name: bytes | None) -> bytes:
    """Set the locale of the C library unless `name` is None; return the present one."""
    return bytes(_c_library().setlocale(locale.LC_ALL, name) or b"C")


def _c_environment() -> dict[bytes, bytes]:
    """Return the environment of the C library.

    Foreign code changes it without changing `os.environ`.
    """
    if sys.platform != "linux":
        return {}
    entries = ctypes.POINTER(ctypes.c_char_p).in_dll(_c_library(), "environ")
    variables, i = {}, 0
    while entries and (entry := entries[i]) is not None:
        name, _, value = entry.partition(b"=")
        variables[name] = value
        i += 1
    return variables


def _set_c_environment(variables: dict[bytes, bytes]) -> None:
    current = _c_environment()
    for name in (
        name for name in {*current, *variables} if current.get(name) != variables.get(name)
    ):
        with suppress(OSError, ValueError):  # a name that is not permitted
            if (value := variables.get(name)) is None:
                os.environb.pop(name, None)
                _c_library().unsetenv(name)  # a variable that `os.environ` does not know
            else:
                os.environb[name] = value


def signal_mask() -> set[int]:
    """Return the numbers of the signals that this thread blocks."""
    return {*signal.pthread_sigmask(signal.SIG_BLOCK, ())}


def set_signal_mask(mask: set[int]) -> None:
    """Set the numbers of the signals that this thread blocks."""
    signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _signal_actions() -> dict[int, bytes]:
    """Return the C `struct sigaction` of each signal in `_SIGNALS`."""
    actions: dict[int, bytes] = {}
    for number in _SIGNALS:
        action = ctypes.create_string_buffer(_SIGACTION_SIZE)
        _c_library().sigaction(int(number), None, action)
        actions[number] = action.raw
    return actions


def _restore_signal_actions(saved: dict[int, bytes]) -> str | None:
    """Restore the actions whose handlers differ; return the names of their signals."""
    current = _signal_actions()
    changed = [
        number
        for number in saved
        if current[number][:_POINTER_SIZE] != saved[number][:_POINTER_SIZE]
    ]
    for number in changed:
        _c_library().sigaction(int(number), saved[number], None)
    return f" {', '.join(signal.Signals(number).name for number in changed)}" if changed else None


def _running_timers() -> set[int]:
    return {timer for timer in _TIMERS if any(signal.getitimer(timer))}


def _stop_new_timers(saved: set[int]) -> str | None:
    new = _running_timers() - saved
    for timer in new:
        signal.setitimer(timer, 0)
    return "" if new else None


def _resource_limits() -> dict[int, tuple[int, int]]:
    return {kind: resource.getrlimit(kind) for kind in _LIMITS}


def _restore_resource_limits(saved: dict[int, tuple[int, int]]) -> str | None:
    """Restore limits if permitted; a lowered hard limit cannot be raised again."""
    current = _resource_limits()
    if current == saved:
        return None
    for kind, limit in saved.items():
        if current[kind] != limit:
            with suppress(ValueError, OSError):
                resource.setrlimit(kind, limit)
    return "" if _resource_limits() == saved else " (what was lowered for good stays so)"


def reserve_descriptors() -> None:
    """Lower the soft limit of open files, to have descriptors for results.

    Foreign code may use up all others.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if soft > 2 * _RESERVED_DESCRIPTORS:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft - _RESERVED_DESCRIPTORS, hard))


def _has_free_descriptor() -> bool:
    try:
        os.close(os.dup(2))
    except OSError as error:
        return error.errno != errno.EMFILE
    return True


def _release_descriptors(had_free: bool) -> str | None:
    """Release the reserved descriptors if no others are free."""
    if not had_free or _has_free_descriptor():
        return None
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft + _RESERVED_DESCRIPTORS, hard))
    return " (none was left)"


class _Attribute(NamedTuple):
    """One attribute of the process.

    `restore` takes the value that `read` returned earlier. It returns None if nothing had changed,
    else details that follow the name in the warning.
    """

    name: str
    read: Callable[[], Any]
    restore: Callable[[Any], str | None]


def _compared(name: str, read: Callable[[], Any], write: Callable[[Any], object]) -> _Attribute:
    """Return an attribute that is compared by its value and restored by `write`."""

    def restore(value: Any) -> str | None:
        if read() == value:
            return None
        write(value)
        return ""

    return _Attribute(name, read, restore)


_ATTRIBUTES = (
    _Attribute(
        "the floating-point mode",
        FloatEnvironment,
        lambda environment: "" if environment.restore() else None,
    ),
    _compared("the working directory", _working_directory, _set_working_directory),
    _compared("the file mode mask", _umask, os.umask),
    _compared("the locale", lambda: _set_locale(None), _set_locale),
    _compared("the environment", _c_environment, _set_c_environment),
    _Attribute("what is done upon", _signal_actions, _restore_signal_actions),
    _compared("which signals are blocked", signal_mask, set_signal_mask),
    _Attribute("the timers", _running_timers, _stop_new_timers),
    _Attribute("the limits", _resource_limits, _restore_resource_limits),
    _Attribute("the number of free descriptors", _has_free_descriptor, _release_descriptors),
)


#: held while foreign code may change the state of the process, so that only one thread at a time
#: runs foreign code
_lock = threading.RLock()
#: states at the begin of the nested blocks of the thread that holds the lock
_saved_states: list[ProcessState] = []


@lru_cache(maxsize=1)
def _encoded_state(_encoding: bytes) -> ProcessState:
    """Return the present state; the last one is kept, because reading takes longer than encoding.

    Args:
        _encoding: The encoding of the present state.
    """
    return ProcessState()


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
    encoding = _encode()  # b"" without the extension module
    state = _encoded_state(encoding) if encoding else ProcessState()
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
    """Exclude other threads from such blocks and from `restoring_process_state`."""
    with _lock:
        yield


def _release_after_fork() -> None:
    """Replace a lock that another thread held when this process was forked.

    Restore what that thread would restore.
    """
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
    """Return device and inode of the files behind `sys.stdout` and `sys.stderr`."""
    files = []
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            status = os.fstat(stream.fileno())
            files.append((status.st_dev, status.st_ino))
    return files


def _file_access() -> tuple[int, bool]:
    """Return the inode of the root folder, and whether the folder of the run is writable."""
    journal, root = current_journal(), Path("/").stat().st_ino
    try:
        if journal and journal.folder and hasattr(os, "O_TMPFILE"):
            os.close(os.open(journal.folder, os.O_TMPFILE | os.O_RDWR))  # a file without a name
    except OSError as error:
        return root, error.errno not in (errno.EACCES, errno.EPERM)
    return root, True
