"""Exceptions for all failures that cosim reports.

CosimError
├── InputError        invalid input: usage, scenario, FMU (exit code 2); lists all problems at once
├── ComponentError    a component failed during the run (exit code 1)
├── LateError         a real-time run fell behind (exit code 1)
├── OutputError       a result could not be written, for example to a full disk (exit code 1)
└── CheckError        a check, comparison or `build --check` failed (exit code 3)
"""

import difflib
import errno
import re
import traceback
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache
from pathlib import Path
from typing import Any

from .paths import resolve_path
from .text import MAX_QUOTATION_LENGTH, count_noun, escape_control_characters, shorten

#: exceptions that are not a failure of the foreign code they pass through; all others are, even if
#: not derived from Exception
PASS_THROUGH_EXCEPTIONS = (KeyboardInterrupt, GeneratorExit)
#: errors of the disk, not of the path
_DISK_ERRORS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}
#: maximum number of characters shown of an exception's text
_MAX_EXCEPTION_LENGTH = 2000
#: parts of regular expressions and of patterns of a shell; indices such as [1] and [1,2] belong to
#: names
_FOREIGN_WILDCARD = re.compile(r"[?(|{^$\\]|\[(?!\d+(,\d+)*\])")
#: maximum number of characters of the line of an error
_MAX_LINE_LENGTH = 8000


class CosimError(Exception):
    """Base of all errors that are meant for the user; the text is complete without a traceback.

    Attributes:
        exit_code: Exit code of the command `cosim` for this class of error.
        result: The `cosim.Result` recorded before the failure, if `cosim.run` raised the error
            after it began to simulate; else None.
    """

    exit_code = 70
    result: Any = None


@dataclass(frozen=True, slots=True)
class Problem:
    """One reason why input is refused; `str` gives it as one line.

    Attributes:
        message: Description of the problem.
        where: Location (file, line, JSON path); "" if unknown.
        subject: Keys of the setting in the scenario ("components", "usv", "period"), from which a
            caller can find the location.
    """

    message: str
    where: str = ""
    subject: tuple[str, ...] = ()

    def __str__(self) -> str:
        text = f"{self.where}: {self.message}" if self.where else self.message
        return escape_control_characters(shorten(text, _MAX_LINE_LENGTH))


class InputError(CosimError):
    """Invalid input, detected before the run starts.

    Attributes:
        problems: All reasons, one line each.
    """

    exit_code = 2

    def __init__(self, problems: str | Problem | Iterable[str | Problem]):
        if isinstance(problems, str | Problem):
            problems = [problems]
        self.problems: Sequence[Problem] = tuple(
            p if isinstance(p, Problem) else Problem(p) for p in problems
        )
        super().__init__("\n".join(map(str, self.problems)))

    def located(self, where: str) -> list[Problem]:
        """Return the problems; `where` is the location of those without one."""
        return [Problem(each.message, each.where or where) for each in self.problems]


class ComponentError(CosimError):
    """Failure of a component during the run.

    Attributes:
        component: Name of the component.
        function: Function that failed, such as "fmi2DoStep".
        reason: Description of the failure.
        time: Simulation time of the failure (s); None if unknown.
    """

    exit_code = 1

    def __init__(self, component: str, function: str, reason: str, time: float | None = None):
        self.component, self.function, self.reason, self.time = component, function, reason, time
        super().__init__(component, function, reason, time)

    def __str__(self) -> str:
        when = "" if self.time is None else f" at t = {self.time:.12g} s"
        text = f"{self.component}: {self.function} failed{when}: {self.reason}"
        return escape_control_characters(shorten(text, _MAX_LINE_LENGTH))


class LateError(CosimError):
    """Delay of a real-time run by more than one step, with `late="fail"`."""

    exit_code = 1


class OutputError(CosimError):
    """Failure to write a result because the disk is full or defective."""

    exit_code = 1


class CheckError(CosimError):
    """Violation of a check, a reference or a manifest."""

    exit_code = 3


def write_error(text: str, error: OSError) -> CosimError:
    """Return the error for a file that cannot be written.

    OutputError if the disk is full or defective, else InputError.
    """
    return OutputError(text) if error.errno in _DISK_ERRORS else InputError(text)


def describe_exception(error: BaseException) -> str:
    """Return class, text, file and line of an exception that foreign code raised.

    The line is the innermost one in the user's code, or the innermost one of all if libraries alone
    were running.

    >>> describe_exception(ValueError("no such mode"))
    'ValueError: no such mode'
    """
    try:
        text = str(error)
    except Exception:
        text = "(its text cannot be made)"
    frames = (
        [] if isinstance(error, SyntaxError) else traceback.extract_tb(error.__traceback__)[::-1]
    )  # its text has a line
    where = innermost_user_line((frame.filename, frame.lineno) for frame in frames)
    where = where or next((f"{Path(frame.filename).name}:{frame.lineno}" for frame in frames), "")
    return f"{type(error).__name__}: {shorten(text, _MAX_EXCEPTION_LENGTH)}" + (
        f" ({where})" if where else ""
    )


def abbreviate_names(names: Iterable[str], limit: int = 8) -> str:
    """Return the names as a list in one line, each name once.

    After the first `limit` names only the number of the others.

    >>> abbreviate_names("abcdea", limit=3)
    'a, b, c and 2 more'
    """
    different = list(dict.fromkeys(names))
    return ", ".join(different[:limit]) + (
        f" and {len(different) - limit} more" if len(different) > limit else ""
    )


def join_alternatives(names: Iterable[str]) -> str:
    """Return the name of the component that failed, or "one of ..." if several are possible.

    >>> join_alternatives(["uav"]), join_alternatives(["uav", "usv"])
    ('uav', 'one of uav, usv')
    """
    different = dict.fromkeys(names)
    return f"{'one of ' if len(different) > 1 else ''}{abbreviate_names(different)}"


def merge_problems(problems: Iterable[Problem], beginning: str) -> list[Problem]:
    """Return different problems.

    Of those in a file with the same message, the first one stands for all, with their number.

    Args:
        problems: The problems in their order.
        beginning: Beginning of the messages of problems that have the same cause if they are equal.
    """
    groups: dict[tuple[str, str], list[Problem]] = {}
    for each in dict.fromkeys(problems):
        place = each.where.partition(":")[0] if each.message.startswith(beginning) else each.where
        groups.setdefault((each.message, place), []).append(each)
    merged = []
    for first, *others in groups.values():
        more = f"; {count_noun(len(others), 'more place')} likewise" if others else ""
        merged.append(replace(first, message=first.message + more))
    return merged


def did_you_mean(name: str, valid: Iterable[str]) -> str:
    """Return a hint for the end of a message.

    The most similar valid name, else up to 12 valid names, else "".

    A name that differs by two swapped neighbouring letters counts as the most similar one. For a
    name with dots, names that begin with the same component come first; others must be nearly
    equal.

    >>> did_you_mean("stop_tme", ["start_time", "stop_time"])
    '; did you mean "stop_time"?'
    >>> did_you_mean("uva", ["usv", "uav"])
    '; did you mean "uav"?'
    >>> did_you_mean("uav.altitude_reference", ["usv.heading_reference", "uav.altitude"])
    '; did you mean "uav.altitude"?'
    """
    return _did_you_mean(name, tuple(valid))


def pattern_hint(pattern: str, valid: Iterable[str]) -> str:
    """Return a hint for the end of a message about a pattern that matches no name.

    See `did_you_mean`.

    >>> pattern_hint("usv.position.[xy]", ["usv.position.x"])
    '; only "*" is a wildcard'
    >>> pattern_hint("usv.positoin[1]", ["usv.position[1]"])
    '; did you mean "usv.position[1]"?'
    """
    return (
        '; only "*" is a wildcard'
        if _FOREIGN_WILDCARD.search(pattern)
        else did_you_mean(pattern, valid)
    )


def near_or_valid_names(name: str, valid: Iterable[str]) -> str:
    """Return a hint like `did_you_mean`, or the valid names if none is similar.

    Of many names only the parts before the first dot are listed.

    >>> near_or_valid_names("speed.x", [f"{n}.{i}" for n in ("landing", "path") for i in range(8)])
    '; valid: landing.*, path.*'
    """
    names = tuple(valid)
    parts = [re.sub(r"\..*", ".*", name) for name in names]
    return did_you_mean(name, names) or (f"; valid: {abbreviate_names(parts, 12)}" if names else "")


def nearest_file(path: Path) -> str:
    """Return a hint for the end of a message about a missing file.

    The most similar name in its folder, else its files.

    Files are those with the same ending, up to 12; without one, the hint is the absolute path of
    the folder. A name without an ending that is similar to none has no hint.
    """
    try:
        folder = resolve_path(path.parent) if ".." in path.parts else path.parent
        names = tuple(
            sorted(
                each.name
                for each in folder.iterdir()
                if not path.suffix or each.suffix == path.suffix
            )
        )
    except FileNotFoundError:
        return f'; there is no folder "{folder.absolute()}"'
    except (OSError, ValueError):
        return ""
    if near := [name for name in names if Path(name).stem == path.name] or _close_matches(
        path.name, names
    ):
        return f'; did you mean "{near[0]}"?'
    if not path.suffix:
        return ""
    return (
        f'; files in "{folder}": {abbreviate_names(names, 12)}'
        if names
        else f'; no *{path.suffix} in "{folder.absolute()}"'
    )


@lru_cache(16)  # the same wrong name often occurs several times
def _did_you_mean(name: str, names: tuple[str, ...]) -> str:
    if near := nearest_name(name, names):
        return f'; did you mean "{near}"?'
    if len(name) <= MAX_QUOTATION_LENGTH and 0 < len(names) <= 12:
        return f"; valid: {', '.join(names)}"
    return ""


def nearest_name(name: str, valid: Iterable[str]) -> str:
    """Return the valid name that a wrong one probably means, as in `did_you_mean`.

    "" if none is similar.
    """
    if len(name) > MAX_QUOTATION_LENGTH:  # no slip of the pen, and the search takes quadratic time
        return ""
    names = tuple(valid)
    swapped = {name[:i] + name[i + 1] + name[i] + name[i + 2 :] for i in range(len(name) - 1)}
    same = [other for other in names if other.lower() == name.lower()]
    near = same or [other for other in names if other in swapped] or _close_matches(name, names)
    return near[0] if near else ""


def _close_matches(name: str, names: tuple[str, ...]) -> list[str]:
    """Return the most similar name, or an empty list."""
    component, dot, _ = name.partition(".")
    if not dot or not any("." in other for other in names):
        return difflib.get_close_matches(name, names, n=1)
    siblings = [other for other in names if other.startswith(f"{component}.")]
    return difflib.get_close_matches(name, siblings, n=1) or difflib.get_close_matches(
        name, names, n=1, cutoff=0.85
    )


_PACKAGE = Path(__file__).resolve().parents[1]
#: shipped vehicles and controllers of an installed cosim
_BUNDLE = _PACKAGE / "_bundle"


def innermost_user_line(frames: Iterable[tuple[str, int | None]]) -> str:
    """Return "file:line" of the first frame in a file of no library; "" if there is none.

    The standard library, installed packages and cosim are libraries.

    Args:
        frames: File and line of each frame, innermost first.
    """
    return next((f"{Path(file).name}:{line}" for file, line in frames if _is_user_file(file)), "")


def is_cosim_file(file: str) -> bool:
    """Return whether a file belongs to `cosim` itself, not to shipped vehicles and controllers."""
    return Path(file).is_relative_to(_PACKAGE) and not Path(file).is_relative_to(_BUNDLE)


@cache
def _is_user_file(file: str) -> bool:
    path = Path(file)
    if path.is_relative_to(_BUNDLE):
        return True
    # exported Python FMUs contain a copy of PythonFMU
    is_library = path.parent.name == "pythonfmu" or any(
        path.is_relative_to(folder) for folder in _library_folders()
    )
    return not (file.startswith("<") or is_library or is_cosim_file(file))


@cache
def _library_folders() -> set[Path]:
    import sysconfig  # takes some milliseconds, and only failures need it

    return {
        Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib", "platlib")
    }
