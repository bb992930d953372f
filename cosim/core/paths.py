"""Safe access to paths given by users, which may be pipes, devices or link loops."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import TextIO


def is_file(path: Path) -> bool:
    """Return whether the file exists.

    False for names that no file can have, for which `Path.is_file` raises.
    """
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: Path) -> bool:
    """Return whether the folder exists.

    False for names that no folder can have, for which `Path.is_dir` raises.
    """
    return os.path.isdir(path)  # noqa: PTH112


def resolve_path(path: Path) -> Path:
    """Return the path with symbolic links resolved.

    A loop of links is left unresolved instead of raising.
    """
    return Path(os.path.realpath(path))


def open_text(path: Path, encoding: str, newline: str | None = None) -> TextIO:
    """Open a regular file to read its text.

    Args:
        path: The file.
        encoding: As in `open`.
        newline: As in `open`.

    Raises:
        OSError: The file cannot be opened, or is a pipe or a device, from which reading might never
            end.
    """
    number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        os.close(number)
        raise OSError(errno.EINVAL, "Not a regular file", str(path))
    return os.fdopen(number, encoding=encoding, newline=newline)
