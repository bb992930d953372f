"""Lines of the user's own code in a call stack, as opposed to lines of libraries."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]
#: shipped vehicles and controllers of an installed cosim
_BUNDLE = _PACKAGE / "_bundle"


def innermost_user_line(frames: Iterable[tuple[str, int | None]]) -> str:
    """Return "file:line" of the first frame in a file that belongs to no library, or "" if there is none.

    The standard library, installed packages and cosim are libraries.

    Args:
        frames: File and line of each frame, innermost first.
    """
    return next((f"{Path(file).name}:{line}" for file, line in frames if _is_user_file(file)), "")


def is_cosim_file(file: str) -> bool:
    """Return whether a file belongs to the package `cosim`, without the shipped vehicles and controllers."""
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
