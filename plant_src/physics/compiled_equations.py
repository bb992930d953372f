"""Compiled equations of a vehicle model, loaded from the binary of its plant FMU.

No compiler is needed to run a world.
"""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Sequence
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile, ZipFile

import numpy as np

from cosim.core import resources
from cosim.core.errors import InputError
from cosim.results.files import writing_atomically

if TYPE_CHECKING:
    from ctypes import _NamedFuncPointer

#: sys.platform -> folder of FMI 2.0 binaries, suffix of shared libraries
_PLATFORMS = {
    "linux": ("linux64", ".so"),
    "darwin": ("darwin64", ".dylib"),
    "win32": ("win64", ".dll"),
}


def load_library(model: str) -> ctypes.PyDLL:
    """Load the shared library of `fmus/MODEL.fmu`.

    Its functions take microseconds, so they run without releasing the interpreter lock.

    Raises:
        InputError: If the FMU cannot be read or has no binary for this platform.
    """
    return ctypes.PyDLL(str(library_path(model)))


def library_path(model: str) -> Path:
    """Return the path of the shared library of `fmus/MODEL.fmu`, unpacked to the user's cache directory.

    Raises:
        InputError: If the FMU cannot be read or has no binary for this platform.
    """
    fmu = resources.root() / "fmus" / f"{model}.fmu"
    try:
        modification_time = fmu.stat().st_mtime_ns
    except OSError as error:
        raise _unreadable_fmu_error(model, fmu, error) from None
    folder = resources.cache_directory() / "plant"
    path = _cached_library_path(model, fmu, modification_time, folder)
    return (
        path
        if path.exists()
        else _cached_library_path.__wrapped__(model, fmu, modification_time, folder)
    )


@cache
def _cached_library_path(
    model: str, fmu: Path, _modification_time: int, cache_folder: Path
) -> Path:
    folder, suffix = _PLATFORMS.get(sys.platform, (sys.platform, ".so"))
    member = f"binaries/{folder}/{model}{suffix}"
    try:
        with ZipFile(fmu) as archive:
            content = archive.read(member)
    except (OSError, BadZipFile) as error:
        raise _unreadable_fmu_error(model, fmu, error) from None
    except KeyError:
        raise InputError(
            f'"{fmu}" has no "{member}"; build it on this platform with `cosim build`'
        ) from None
    return _extract_to_cache(content, cache_folder, f"{model}{suffix}")


def _unreadable_fmu_error(model: str, fmu: Path, error: Exception) -> InputError:
    return InputError(
        f'the equations of the vehicle model "{model}" cannot be read from "{fmu}": {error}'
    )


def _extract_to_cache(content: bytes, cache_folder: Path, name: str) -> Path:
    """Write a file to the cache.

    Its name contains a hash of its content, and a damaged file is replaced.
    """
    path = cache_folder / f"{sha256(content).hexdigest()[:20]}-{name}"
    if not _has_content(path, content):
        with writing_atomically(path) as temporary:
            temporary.write_bytes(content)
    return path


def _has_content(path: Path, content: bytes) -> bool:
    try:
        return path.read_bytes() == content
    except OSError:
        return False


def bind_arrays(
    function: _NamedFuncPointer, arguments: Sequence[np.ndarray], results: Sequence[np.ndarray]
) -> Callable[[], None]:
    """Bind a compiled function to its arrays, so that calls need no conversion of arguments.

    Args:
        function: C function `void f(const double *const in[], double *const out[])`.
        arguments: Contiguous float64 arrays to which `in` points.
        results: Contiguous float64 arrays to which `out` points.

    Returns:
        A function without arguments. It keeps the arrays alive.

    Raises:
        TypeError: If an array is not contiguous or not of type float64.
    """
    arrays = (*arguments, *results)
    if not all(array.dtype == np.float64 and array.flags.c_contiguous for array in arrays):
        raise TypeError("found an array that is not contiguous or not of type float64")
    function.restype = None
    tables = [
        (ctypes.c_void_p * len(side))(*(array.ctypes.data for array in side))
        for side in (arguments, results)
    ]
    call = partial(function, *map(ctypes.byref, tables))
    vars(call)["arrays"] = arrays
    return call
