"""Record of the present activity of this process, which a supervisor reads after a crash.

A journal is a small block of memory that both processes map. It holds the marker of the executor
(see `MARKER_SIZE`) and the present activity outside the stepping loop with its deadline. A process
without a supervisor has no journal.

There is no lock, because a process that crashed would never release it. Each field is one aligned
word, which is written at once, and a counter of changes (`CHANGE_COUNT`) increases before the
deadline changes. In the stepping loop only the executor's marker moves, which costs no call.
"""

import ctypes
import math
import mmap
import os
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from ..core import component_log
from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, CosimError, describe_exception

#: size of a journal (bytes)
JOURNAL_SIZE = 4 * 4096
#: indices of the int64 fields, which occupy the first 64 bytes
CALL_NUMBER, STEP_COUNT, ROW_COUNT, STEP_TIME, PHASE, CHANGE_COUNT, DEADLINE, EXIT_CODE = range(8)
#: number of leading fields that form the marker, which the executor updates: present call, finished
#: macro steps, recorded rows, start of the present macro step (a float64, in s)
MARKER_SIZE = 4
#: offsets of a float64 and of three texts; a text is its length (uint32) followed by UTF-8
_TIME_OFFSET, _COMPONENT_OFFSET, _FUNCTION_OFFSET, _FOLDER_OFFSET = 64, 4096, 8192, 12288
_MAX_TEXT_SIZE = 4092
#: reason of a failure after which the journal is not valid
OVERWRITTEN = "it wrote over memory of the process that is not its own"


class Phase(IntEnum):
    """Kind of the present activity."""

    #: no foreign code is running
    IDLE = 0
    #: a call into a component, outside the stepping loop
    CALLING = 1
    #: the stepping loop
    STEPPING = 2
    #: a call into a component after all results were written
    RESULTS_WRITTEN = 3
    #: the entry function of the process has returned
    DONE = 4
    #: a call or the stepping loop waits for something that is not a component
    WAITING = 5


_PHASES = frozenset(Phase)
#: longest deadline (ms), and largest number of steps, rows or changes
_MAX_DEADLINE, _MAX_COUNT = 10**15, 2**53


@dataclass(frozen=True, slots=True)
class Deadlines:
    """Maximum duration of one call into a component, in s of wall time.

    Attributes:
        load: Loading and instantiating.
        initialization: Calls until the end of initialization mode.
        step: Calls in the stepping loop.
        end: Terminating and freeing.
    """

    load: float = 10.0
    initialization: float = 10.0
    step: float = 5.0
    end: float = 5.0


class Activity(NamedTuple):
    """Recorded call into a component.

    `time` is the simulation time (s; NaN outside the simulation), `deadline` its maximum duration
    (s).
    """

    component: str
    function: str
    time: float
    deadline: float


class Journal:
    """Journal in a buffer of `JOURNAL_SIZE` bytes, which may be shared with another process."""

    def __init__(self, memory: Any):
        self.memory = memory
        self._integers = memoryview(memory)[:_TIME_OFFSET].cast("q")
        self.deadlines = Deadlines()
        #: several components are being called at the same time; their calls are not recorded one by
        #: one
        self.is_shared = False
        self._is_claimed = False
        #: the results of the run are written beside its folder
        self.writes_csv = False
        self.enter_phase(Phase.IDLE)

    def __getitem__(self, field: int) -> int:
        return self._integers[field]

    def __setitem__(self, field: int, value: int) -> None:
        self._integers[field] = value

    @property
    def is_valid(self) -> bool:
        """True if the content is plausible; foreign code in the process can overwrite it."""
        deadline, counts = self[DEADLINE], (self[STEP_COUNT], self[ROW_COUNT], self[CHANGE_COUNT])
        counts_are_valid = min(counts) >= 0 and max(counts) <= _MAX_COUNT
        return self[PHASE] in _PHASES and -1 <= deadline <= _MAX_DEADLINE and counts_are_valid

    def claim(self) -> bool:
        """Return True at the first call.

        The journal records one run of the process, and not those that its KPIs make.
        """
        first, self._is_claimed = not self._is_claimed, True
        return first

    def exclude_from_forks(self) -> None:
        """Make later forks of this process crash at their first access to the journal (Linux).

        See `process.journal`.
        """
        if hasattr(mmap, "MADV_DONTFORK"):
            self.memory.madvise(mmap.MADV_DONTFORK)

    def to_bytes(self) -> bytes:
        """Return a copy of the whole content."""
        return bytes(self.memory[:])

    def restore(self, contents: bytes) -> None:
        """Restore a content returned by `to_bytes`."""
        self.memory[:] = contents

    @property
    def phase(self) -> Phase:
        """Present phase. Raises ValueError if foreign code has overwritten it."""
        return Phase(self[PHASE])

    def enter_phase(self, phase: Phase, deadline: float = math.inf) -> None:
        """Begin a phase with a maximum duration of each call (s)."""
        # first, so that a reader of the new deadline also reads the new count
        self[CHANGE_COUNT] += 1
        self[DEADLINE] = -1 if math.isinf(deadline) else int(min(deadline * 1000, _MAX_DEADLINE))
        self[PHASE] = phase

    def record_call(self, component: str, function: str, time: float = math.nan) -> None:
        """Record the present call and its simulation time (s; NaN outside the simulation)."""
        struct.pack_into("d", self.memory, _TIME_OFFSET, time)
        self._write_text(_COMPONENT_OFFSET, component)
        self._write_text(_FUNCTION_OFFSET, function)

    def activity(self) -> Activity:
        """Return the call that was recorded last."""
        (time,) = struct.unpack_from("d", self.memory, _TIME_OFFSET)
        return Activity(
            self._read_text(_COMPONENT_OFFSET),
            self._read_text(_FUNCTION_OFFSET),
            time,
            self.deadline,
        )

    @property
    def deadline(self) -> float:
        """Deadline of the present phase (s)."""
        milliseconds = self[DEADLINE]
        return math.inf if milliseconds < 0 else milliseconds / 1000

    @property
    def step_time(self) -> float:
        """Start of the present macro step (s)."""
        (time,) = struct.unpack_from("d", self.memory, 8 * STEP_TIME)
        return float(time)

    def set_folder(self, folder: Path, writes_csv: bool = False) -> None:
        """Record the folder of the files of the run, and whether results are written beside it."""
        self._write_text(_FOLDER_OFFSET, str(folder.resolve()))
        self.writes_csv = writes_csv

    @property
    def folder(self) -> Path | None:
        """Folder of the files of the run (see `process.run_files`); None if not set."""
        return Path(text) if (text := self._read_text(_FOLDER_OFFSET)) else None

    def _write_text(self, offset: int, text: str) -> None:
        data = text.encode("utf-8", "replace")[:_MAX_TEXT_SIZE]
        struct.pack_into(f"I{len(data)}s", self.memory, offset, len(data), data)

    def _read_text(self, offset: int) -> str:
        size, data = struct.unpack_from(f"I{_MAX_TEXT_SIZE}s", self.memory, offset)
        return str(data[:size].decode("utf-8", "replace"))


#: returns component and function of the present call
CallDescription = Callable[[], tuple[str, str]]

_describe_call: CallDescription | None = None
#: calls that have forked this process, and whether they were reported
_noted_calls: dict[tuple[str, str], bool] = {}


class attributing_forks:  # noqa: N801  # a generator as context manager would take twice as long
    """Attribute forks in the block to the present call.

    A copy of this process that reaches the end of the block is ended.
    """

    def __init__(self, describe_call: CallDescription | None):
        """Prepare the block.

        Args:
            describe_call: Returns component and function of the present call; None for forks that
                are not made by foreign code.
        """
        self._inner = describe_call

    def __enter__(self) -> None:
        global _describe_call
        self._process, self._outer, _describe_call = os.getpid(), _describe_call, self._inner

    def __exit__(self, *error: object) -> None:
        global _describe_call
        _describe_call = self._outer
        if os.getpid() != self._process:
            os._exit(1)


def report_forks() -> None:
    """Warn once of each call that has forked this process."""
    for (component, function), reported in _noted_calls.items():
        if not reported:
            text = f"{function} forked the process; a copy that returns from the call is ended"
            component_log.log_message(component, component_log.WARNING, text)
            _noted_calls[component, function] = True


@cache
def watch_forks() -> None:
    """Note the present call at each fork from now on.

    For processes that end without finalizing the interpreter.
    """
    library = ctypes.CDLL(None)
    register = getattr(library, "pthread_atfork", None) or getattr(
        library, "__register_atfork", None
    )
    if register:
        register(None, _note_fork_callback, None, None)


def _note_fork() -> None:
    """Note the present call; called in the process that forks, after the fork."""
    if _describe_call:
        _noted_calls.setdefault(_describe_call(), False)


_note_fork_callback = ctypes.CFUNCTYPE(None)(_note_fork)


_current: Journal | None = None


def set_current_journal(journal: Journal | None) -> None:
    """Set the journal of this process; None for none."""
    global _current
    _current = journal


def current_journal() -> Journal | None:
    """Return the journal of this process; None without a supervisor."""
    return _current


@contextmanager
def calling_several_components() -> Iterator[None]:
    """Keep the recorded call while threads call the several components that it names."""
    journal = _current
    if journal is None:
        yield
        return
    journal.is_shared = True
    try:
        yield
    finally:
        journal.is_shared = False


@contextmanager
def calling_component(
    component: str, function: str, deadline_name: str | None = None, time: float = math.nan
) -> Iterator[None]:
    """Record a call into a component, outside the stepping loop, for the duration of the block.

    Args:
        component: Name of the component.
        function: Name of its function.
        deadline_name: Attribute of `Deadlines` with the maximum duration; None: no maximum.
        time: Simulation time (s); NaN outside the simulation.

    Raises:
        ComponentError: The block raised an exception, see `as_component_error`.
    """
    journal = _current
    with (
        nullcontext()
        if journal is None or journal.is_shared
        else _recording_call(journal, component, function, deadline_name, time),
        attributing_forks(lambda: (component, function)),
        as_component_error(component, function, time),
    ):
        yield


@contextmanager
def _recording_call(
    journal: Journal, component: str, function: str, deadline_name: str | None, time: float
) -> Iterator[None]:
    """Record a call and its deadline in the journal for the duration of the block."""
    phase, deadline, before = journal.phase, journal.deadline, journal.activity()
    journal.record_call(component, function, time)
    journal.enter_phase(
        Phase.RESULTS_WRITTEN if phase == Phase.RESULTS_WRITTEN else Phase.CALLING,
        getattr(journal.deadlines, deadline_name) if deadline_name else math.inf,
    )
    try:
        yield
    finally:
        journal.record_call(before.component, before.function, before.time)
        journal.enter_phase(phase, deadline)


@contextmanager
def as_component_error(component: str, function: str, time: float = math.nan) -> Iterator[None]:
    """Raise a ComponentError for an exception in the block that is no CosimError.

    Exceptions in `PASS_THROUGH_EXCEPTIONS` pass unchanged.
    """
    try:
        yield
    except (CosimError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise ComponentError(
            component, function, describe_exception(error), None if math.isnan(time) else time
        ) from error


@contextmanager
def suspending_deadline() -> Iterator[None]:
    """Suspend the deadline during this block, because no component is running in it."""
    journal = _current
    if journal is None:
        yield
        return
    phase, deadline = journal.phase, journal.deadline
    journal.enter_phase(Phase.WAITING)
    try:
        yield
    finally:
        journal.enter_phase(phase, deadline)
