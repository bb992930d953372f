"""What a Python process must be able to read."""

from __future__ import annotations

import sys
from pathlib import Path

from ...core.resources import package_folder

#: shared libraries and what the loader and C library look up
_SYSTEM_PATHS = (
    "/usr/lib",
    "/usr/lib64",
    "/usr/local/lib",
    "/lib",
    "/lib64",
    "/etc/ld.so.cache",
    "/dev/urandom",
    "/usr/share/zoneinfo",
)


def interpreter_folders() -> tuple[Path, ...]:
    """Existing folders and files that this interpreter, its packages and shared libraries are read from.

    Not the current folder, which Python searches, too, when it is started as `python -m cosim`.
    """
    own = package_folder()
    searched = [path for path in map(Path, sys.path) if path.absolute() != Path.cwd()]
    places = [*map(Path, (*_SYSTEM_PATHS, sys.prefix, sys.base_prefix)), *searched, own]
    return tuple(dict.fromkeys(path.absolute() for path in places if path.exists()))
