"""Paths that users name: anything may lie there."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import IO, Any


def is_file(path: Path) -> bool:
    """Whether there is such a file; no for names that no file can have, where `Path.is_file` raises."""
    return os.path.isfile(path)  # noqa: PTH113


def resolve_path(path: Path) -> Path:
    """Where a path leads, links followed; where they lead in a circle, as far as that goes."""
    return Path(os.path.realpath(path))


def open_text(path: Path, **how: Any) -> IO[str]:
    """A file opened to read its text, with `how` as in `open`.

    Raises OSError, for pipes and devices too: they could keep the reader waiting for ever, or never end.
    """
    number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        os.close(number)
        raise OSError(errno.EINVAL, "Not a regular file", str(path))
    return os.fdopen(number, **how)
