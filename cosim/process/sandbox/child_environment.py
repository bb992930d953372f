"""Environment of a sandboxed process: its variables, and the files that Python has to read."""

import ctypes
import os
import site
import sys
import tempfile
from functools import cache
from pathlib import Path

from ...core.errors import InputError
from ...core.resources import package_folder

#: variables that a sandboxed process keeps: language, time zone, folder for temporary files and
#: numbers of threads
KEPT_VARIABLES = (
    "LANG",
    "LANGUAGE",
    "LC_ALL",
    "LC_COLLATE",
    "LC_CTYPE",
    "LC_MESSAGES",
    "LC_MONETARY",
    "LC_NUMERIC",
    "LC_TIME",
    "TZ",
    "TMPDIR",
    "OMP_NUM_THREADS",
    "OPENBLAS_NUM_THREADS",
    "MKL_NUM_THREADS",
)

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

#: files and folders of packages that are installed in a folder
_MODULE_SUFFIXES = (".py", ".pyi", ".pyc", ".so", ".pth")
_METADATA_SUFFIXES = (".dist-info", ".egg-info", ".libs")

#: first of the fields env_start and env_end in /proc/self/stat, counted after the name of the
#: program
_FIRST_FIELD = 47
_BYTES_HEADER_SIZE = bytes.__basicsize__ - 1


def clear_environment() -> None:
    """Remove all variables but `KEPT_VARIABLES` and overwrite their values in memory (Linux).

    HOME names the folder for temporary files afterwards.

    Removed but not overwritten values would remain readable in memory: in the block that the kernel
    created at the start of the program, in copies of the C library, and in bytes objects of
    `os.environ`.
    """
    kept = {name: os.environ[name] for name in KEPT_VARIABLES if name in os.environ} | {
        "HOME": tempfile.gettempdir()
    }
    library = ctypes.CDLL(None)
    values = [value for value in os.environ._data.values() if len(value) > 1]  # type: ignore[attr-defined]
    entries = ctypes.POINTER(ctypes.c_void_p).in_dll(library, "environ")
    copies, i = [], 0
    while entries and (address := entries[i]):
        copies.append((address, len(ctypes.string_at(address))))
        i += 1
    fields = Path("/proc/self/stat").read_text().rpartition(")")[2].split()
    begin, end = (int(field) for field in fields[_FIRST_FIELD : _FIRST_FIELD + 2])
    os.environ.clear()
    library.clearenv()
    for address, size in [
        (begin, end - begin),
        *copies,
        *((id(value) + _BYTES_HEADER_SIZE, len(value)) for value in values),
    ]:
        ctypes.memset(address, 0, size)
    os.environ.update(kept)


def interpreter_folders() -> tuple[Path, ...]:
    """Return the existing folders and files of this interpreter, its packages and shared libraries.

    Other folders of `sys.path` are included only if they contain only packages. The folder of a
    script, the current folder and a checkout often contain other files.

    Raises:
        InputError: A folder in PYTHONPATH contains other files than packages.
    """
    installed = [sys.prefix, sys.base_prefix, site.getusersitepackages()]
    paths = [
        *map(Path, (*_SYSTEM_PATHS, *installed)),
        *_folders_of_packages(installed),
        package_folder(),
    ]
    return tuple(dict.fromkeys(path.absolute() for path in paths if path.exists()))


def _folders_of_packages(installed: list[str]) -> list[Path]:
    """Return the folders of `sys.path` outside the installed ones that hold only packages."""
    search_path = {
        Path(entry).absolute()
        for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep)
        if entry
    }
    folders = []
    for folder in dict.fromkeys(Path(entry).absolute() for entry in sys.path):
        if (
            not folder.is_dir()
            or folder == package_folder().parent
            or any(folder.is_relative_to(path) for path in installed)
        ):
            continue
        other = _first_file_of_no_package(folder)
        if other is None:
            folders.append(folder)
        elif folder in search_path:
            raise InputError(
                f'the folder "{folder}" in PYTHONPATH holds "{other.relative_to(folder)}", which '
                "is no part of a Python package "
                f"and which a sandboxed FMU could read; expected a folder that holds only packages"
            )
    return folders


@cache
def _first_file_of_no_package(folder: Path) -> Path | None:
    """Return a file or unreadable folder in a folder that belongs to no Python package.

    None if there is none.
    """
    try:
        paths = sorted(folder.iterdir())
    except PermissionError:
        return folder
    for path in paths:
        if path.is_dir():
            is_package = (
                path.name == "__pycache__"
                or path.suffix in _METADATA_SUFFIXES
                or (path / "__init__.py").exists()
            )
            other = None if is_package else _first_file_of_no_package(path)
        else:
            other = None if path.suffix in _MODULE_SUFFIXES else path
        if other:
            return other
    return None
