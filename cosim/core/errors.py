"""Every failure that cosim reports on purpose.

CosimError
├── InputError        the user's input is refused: usage, scenario, FMU (exit code 2); carries all problems at once
├── ComponentError    a component failed while it ran (exit code 1)
├── LateError         a real-time run could not keep up (exit code 1)
├── OutputError       a result could not be written, as on a full disk (exit code 1)
└── CheckError        a check, comparison or `build --check` was not met (exit code 3)
"""

from __future__ import annotations

import difflib
import traceback
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

#: what passes through other people's code without being its failure; all else is, also what is no Exception (a library's panic)
PASS_THROUGH_EXCEPTIONS = (KeyboardInterrupt, GeneratorExit)
#: characters of an exception's text that are shown
_MAX_TEXT_LENGTH = 2000


class CosimError(Exception):
    """Base of all errors that are meant for the user; the text is complete without a traceback.

    Attributes:
        exit_code: Exit code of the command `cosim` for this class of error.
        result: The `cosim.Result` recorded before the failure, if `cosim.run` raised the error after it began to simulate; else
            None.
    """

    exit_code = 70
    result: Any = None


@dataclass(frozen=True, slots=True)
class Problem:
    """One refused thing: what is wrong, and where it stands (file, line, JSON path) as far as that is known.

    `subject` names the setting that is wrong ("components", "usv", "period"); who knows where settings stand replaces `where`.
    As text it is one line: what cannot be printed is escaped.
    """

    message: str
    where: str = ""
    subject: tuple[str, ...] = ()

    def __str__(self) -> str:
        text = f"{self.where}: {self.message}" if self.where else self.message
        return _escape_unprintable(text)


def _escape_unprintable(text: str) -> str:
    """One line; what cannot be printed, as what would control a terminal, is escaped."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape", "surrogatepass").decode() for c in text)


class InputError(CosimError):
    """Input was refused before anything ran; `problems` lists every reason, one line each."""

    exit_code = 2

    def __init__(self, problems: str | Problem | Iterable[str | Problem]):
        if isinstance(problems, str | Problem):
            problems = [problems]
        self.problems: Sequence[Problem] = tuple(p if isinstance(p, Problem) else Problem(p) for p in problems)
        super().__init__("\n".join(map(str, self.problems)))


class ComponentError(CosimError):
    """A component failed while it ran: says which one, in which function, at which time and why."""

    exit_code = 1

    def __init__(self, component: str, function: str, reason: str, time: float | None = None):
        self.component, self.function, self.reason, self.time = component, function, reason, time
        super().__init__(component, function, reason, time)

    def __str__(self) -> str:
        when = "" if self.time is None else f" at t = {self.time:.12g} s"
        return _escape_unprintable(f"{self.component}: {self.function} failed{when}: {self.reason}")


class LateError(CosimError):
    """A run that was to keep up with real time did not."""

    exit_code = 1


class OutputError(CosimError):
    """A result could not be written to a place that was good when the work began: the disk is full, or it failed."""

    exit_code = 1


class CheckError(CosimError):
    """A result does not meet a check, a reference or a manifest."""

    exit_code = 3


def describe_exception(error: BaseException) -> str:
    """An exception of other people's code in one line: its kind, its text, and where it was raised."""
    try:
        text = str(error)
    except Exception:
        text = "(its text cannot be made)"
    text = (
        text
        if len(text) <= _MAX_TEXT_LENGTH
        else f"{text[:_MAX_TEXT_LENGTH]} ... and {len(text) - _MAX_TEXT_LENGTH} characters more"
    )
    places = traceback.extract_tb(error.__traceback__)
    where = f" ({Path(places[-1].filename).name}:{places[-1].lineno})" if places else ""
    return f"{type(error).__name__}: {text}{where}"


def abbreviate_names(names: Iterable[str], limit: int = 8) -> str:
    """Return the names as a list in one line, each name once; after the first `limit` names only the number of the others.

    >>> abbreviate_names("abcdea", limit=3)
    'a, b, c and 2 more'
    """
    different = list(dict.fromkeys(names))
    return ", ".join(different[:limit]) + (f" and {len(different) - limit} more" if len(different) > limit else "")


def join_alternatives(names: Iterable[str]) -> str:
    """Return the name of the component a failure is attributed to, or "one of ..." if several come into question.

    >>> join_alternatives(["uav"]), join_alternatives(["uav", "usv"])
    ('uav', 'one of uav, usv')
    """
    different = dict.fromkeys(names)
    return f"{'one of ' if len(different) > 1 else ''}{abbreviate_names(different)}"


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """The nearest valid name as the end of a message, or the list of valid names when it is short, or nothing.

    Nearest is a name with two neighbouring letters swapped.

    >>> did_you_mean("stop_tme", ["start_time", "stop_time"])
    '; did you mean "stop_time"?'
    >>> did_you_mean("uva", ["usv", "uav"])
    '; did you mean "uav"?'
    """
    return _did_you_mean(name, tuple(valid))


@lru_cache(16)  # a name that is wrong in one place often is so in the next ones
def _did_you_mean(name: str, names: tuple[str, ...]) -> str:
    swapped = {name[:i] + name[i + 1] + name[i] + name[i + 2 :] for i in range(len(name) - 1)}
    if near := [other for other in names if other in swapped] or difflib.get_close_matches(name, names, n=1):
        return f'; did you mean "{near[0]}"?'
    if 0 < len(names) <= 8:
        return f"; valid: {', '.join(names)}"
    return ""
