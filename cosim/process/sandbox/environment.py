"""Environment variables of a sandboxed process."""

from __future__ import annotations

import ctypes
import os
import tempfile
from pathlib import Path

#: variables that a sandboxed process keeps: language, time zone, folder for temporary files and
#: numbers of threads
KEPT_VARIABLES = (
    *(
        "LANG",
        "LANGUAGE",
        "LC_ALL",
        "LC_COLLATE",
        "LC_CTYPE",
        "LC_MESSAGES",
        "LC_MONETARY",
        "LC_NUMERIC",
        "LC_TIME",
    ),
    *("TZ", "TMPDIR"),
    *("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"),
)

#: first of the fields env_start and env_end in /proc/self/stat, counted after the name of the
#: program
_FIRST_FIELD = 47
_BYTES_HEADER_SIZE = bytes.__basicsize__ - 1


def clear_environment() -> None:
    """Remove all variables but `KEPT_VARIABLES`, and overwrite their values in the memory of this process (Linux).

    HOME names the folder for temporary files afterwards.

    Removed but not overwritten values would remain readable in memory: in the block that the kernel created at the start of the
    program, in copies of the C library, and in bytes objects of `os.environ`.
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
