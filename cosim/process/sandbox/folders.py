"""Files that a Python process has to read."""

from __future__ import annotations

import sys
from pathlib import Path

from ...core.resources import package_folder

#: shared libraries, and files that the loader and the C library read
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
    """Return the existing folders and files of this interpreter, its packages and shared libraries.

    The current folder is excluded, although `python -m cosim` adds it to `sys.path`.
    """
    module_folders = [path for path in map(Path, sys.path) if path.absolute() != Path.cwd()]
    paths = [*map(Path, (*_SYSTEM_PATHS, sys.prefix, sys.base_prefix)), *module_folders, package_folder()]
    return tuple(dict.fromkeys(path.absolute() for path in paths if path.exists()))
