"""What this process is doing, in memory that a supervising process can still read after a crash.

A journal is a small block of memory: the marker of the executor (see `engine.executor`), and beside it the activity that is
going on outside the stepping loop, with the time it may take. Without a supervisor nothing is noted.
"""

from __future__ import annotations

import math
import struct
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path
from typing import Any, NamedTuple

from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, CosimError, describe_exception

#: size of a journal (bytes)
JOURNAL_SIZE = 5 * 4096
#: indices of the int64 fields, which occupy the first 64 bytes
CALL_NUMBER, STEP_COUNT, ROW_COUNT, PHASE, CHANGE_COUNT, DEADLINE, EXIT_CODE, CSV_UPDATE = range(8)
#: number of leading fields that form the marker, which the executor updates: present call, finished macro steps, recorded rows
MARKER_SIZE = 3
_TIME_OFFSET, _COMPONENT_OFFSET, _FUNCTION_OFFSET, _FOLDER_OFFSET, _CSV_PATH_OFFSET, _MAX_TEXT_SIZE = (
    64,
    4096,
    8192,
    12288,
    16384,
    4092,
)


class Phase(IntEnum):
    """What kind of thing is going on: nothing foreign, a call, the stepping loop, a call with all results written, the end,
    or that a call or the stepping loop waits for something that is no component."""

    IDLE, CALLING, STEPPING, RESULTS_WRITTEN, DONE, WAITING = range(6)

    @property
    def in_loop(self) -> bool:
        """Rows are being recorded."""
        return self in (Phase.STEPPING, Phase.WAITING)


_PHASES = frozenset(Phase)
#: no deadline is longer (ms)
_MAX_DEADLINE = 10**15


@dataclass(frozen=True, slots=True)
class Deadlines:
    """How long a call into a component may take, in s of wall time.

    `load`: load and instantiate; `initialization`: until the end of initialization mode; `step`: one call while stepping;
    `end`: terminate and free.
    """

    load: float = 10.0
    initialization: float = 10.0
    step: float = 5.0
    end: float = 5.0


class Activity(NamedTuple):
    """What the journal says: a call into a component, begun at simulation time `time` (NaN: outside the simulation)."""

    component: str
    function: str
    time: float
    deadline: float


class Journal:
    """A journal in `memory`, which may be shared with another process."""

    def __init__(self, memory: Any):
        self.memory = memory
        self._integers = memoryview(memory)[:_TIME_OFFSET].cast("q")
        self.deadlines = Deadlines()
        self.enter_phase(Phase.IDLE)

    def __getitem__(self, field: int) -> int:
        return self._integers[field]

    def __setitem__(self, field: int, value: int) -> None:
        self._integers[field] = value

    @property
    def is_valid(self) -> bool:
        """Whether this can be what cosim wrote: foreign code in the process can write anywhere."""
        deadline, counts = self[DEADLINE], (self[STEP_COUNT], self[ROW_COUNT], self[CHANGE_COUNT])
        return self[PHASE] in _PHASES and self[CSV_UPDATE] in (0, 1) and -1 <= deadline <= _MAX_DEADLINE and min(counts) >= 0

    def to_bytes(self) -> bytes:
        """All that stands here."""
        return bytes(self.memory[:])

    def restore(self, contents: bytes) -> None:
        """As it was when `contents` were taken."""
        self.memory[:] = contents

    @property
    def phase(self) -> Phase:
        return Phase(self[PHASE])

    def enter_phase(self, phase: Phase, deadline: float = math.inf) -> None:
        """From now on this is going on, for at most `deadline` s at a time."""
        self[CHANGE_COUNT] += 1  # first: whoever sees the new deadline sees that something has changed
        self[DEADLINE] = -1 if math.isinf(deadline) else int(min(deadline * 1000, _MAX_DEADLINE))
        self[PHASE] = phase
        while self[CSV_UPDATE]:
            clock.sleep(1e-4)

    @contextmanager
    def updating_csv(self) -> Iterator[bool]:
        """Within this block the supervisor may change the result file, if True comes of it: the run does not touch it yet."""
        self[CSV_UPDATE] = 1
        try:
            yield self.phase.in_loop
        finally:
            self[CSV_UPDATE] = 0

    def record_call(self, component: str, function: str, time: float = math.nan) -> None:
        """Which call is being made."""
        struct.pack_into("d", self.memory, _TIME_OFFSET, time)
        self._write_text(_COMPONENT_OFFSET, component)
        self._write_text(_FUNCTION_OFFSET, function)

    def activity(self) -> Activity:
        """What was noted last."""
        (time,) = struct.unpack_from("d", self.memory, _TIME_OFFSET)
        return Activity(self._read_text(_COMPONENT_OFFSET), self._read_text(_FUNCTION_OFFSET), time, self.deadline)

    @property
    def deadline(self) -> float:
        """How long what is going on may take (s)."""
        milliseconds = self[DEADLINE]
        return math.inf if milliseconds < 0 else milliseconds / 1000

    def set_run_files(self, folder: Path, csv: Path | None) -> None:
        """The run's files lie in `folder`; the user waits for its rows in `csv`."""
        self._write_text(_FOLDER_OFFSET, str(folder.resolve()))
        self._write_text(_CSV_PATH_OFFSET, str(csv.resolve()) if csv else "")

    @property
    def folder(self) -> Path | None:
        """Where the files of the run lie (see `unfinished`), once that is known."""
        return Path(text) if (text := self._read_text(_FOLDER_OFFSET)) else None

    @property
    def csv_path(self) -> Path | None:
        """Where the user wants the rows."""
        return Path(text) if (text := self._read_text(_CSV_PATH_OFFSET)) else None

    def _write_text(self, place: int, text: str) -> None:
        data = text.encode("utf-8", "replace")[:_MAX_TEXT_SIZE]
        struct.pack_into(f"I{len(data)}s", self.memory, place, len(data), data)

    def _read_text(self, place: int) -> str:
        size, data = struct.unpack_from(f"I{_MAX_TEXT_SIZE}s", self.memory, place)
        return str(data[:size].decode("utf-8", "replace"))


_current: Journal | None = None


def set_current_journal(journal: Journal | None) -> None:
    """This process notes what it does in `journal` from now on."""
    global _current
    _current = journal


def current_journal() -> Journal | None:
    """The journal of this process, if it has a supervisor."""
    return _current


@contextmanager
def calling_component(component: str, function: str, deadline_name: str, time: float = math.nan) -> Iterator[None]:
    """Within this block a function of a component is called, outside the stepping loop; `kind` names its deadline.

    Raises ComponentError for whatever is raised there.
    """
    journal = _current
    if journal is None:
        with as_component_error(component, function, time):
            yield
        return
    phase, deadline, before = journal.phase, journal.deadline, journal.activity()
    journal.record_call(component, function, time)
    journal.enter_phase(
        Phase.RESULTS_WRITTEN if phase == Phase.RESULTS_WRITTEN else Phase.CALLING, getattr(journal.deadlines, deadline_name)
    )
    try:
        with as_component_error(component, function, time):
            yield
    finally:
        journal.record_call(before.component, before.function, before.time)
        journal.enter_phase(phase, deadline)


@contextmanager
def as_component_error(component: str, function: str, time: float = math.nan) -> Iterator[None]:
    """What is raised in this block is a failure of the component: a ComponentError, unless it is an error of cosim already."""
    try:
        yield
    except (CosimError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise ComponentError(component, function, describe_exception(error), None if math.isnan(time) else time) from error


@contextmanager
def suspending_deadline() -> Iterator[None]:
    """Within this block something is done or waited for that is no component, as long as it takes."""
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
