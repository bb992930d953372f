"""The compiled equations of a vehicle, loaded from the binary of its plant FMU: no compiler is needed to run the world."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable, Sequence
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from tempfile import NamedTemporaryFile
from zipfile import BadZipFile, ZipFile

import numpy as np

from cosim.core import resources
from cosim.core.errors import InputError

#: sys.platform -> folder of FMI 2.0 binaries, ending of shared libraries
_PLATFORMS = {"linux": ("linux64", ".so"), "darwin": ("darwin64", ".dylib"), "win32": ("win64", ".dll")}


def load_library(model: str) -> ctypes.PyDLL:
    """The shared library of `fmus/MODEL.fmu`. Its functions are short: they run without releasing the interpreter lock.

    Raises InputError when the FMU or its binary for this platform is missing.
    """
    return ctypes.PyDLL(str(library_path(model)))


def library_path(model: str) -> Path:
    """Where that library has been unpacked to."""
    fmu = resources.root() / "fmus" / f"{model}.fmu"
    try:
        changed = fmu.stat().st_mtime_ns
    except OSError as error:
        raise _unreadable_fmu_error(model, fmu, error) from None
    place = resources.cache_directory() / "plant"
    path = _cached_library_path(model, fmu, changed, place)
    return path if path.exists() else _cached_library_path.__wrapped__(model, fmu, changed, place)


@cache
def _cached_library_path(model: str, fmu: Path, _changed: int, place: Path) -> Path:
    folder, ending = _PLATFORMS.get(sys.platform, (sys.platform, ".so"))
    member = f"binaries/{folder}/{model}{ending}"
    try:
        with ZipFile(fmu) as archive:
            content = archive.read(member)
    except (OSError, BadZipFile) as error:
        raise _unreadable_fmu_error(model, fmu, error) from None
    except KeyError:
        raise InputError(f'"{fmu}" has no "{member}"; build it on this platform with `cosim build`') from None
    return _extract_to_cache(content, place, f"{model}{ending}")


def _unreadable_fmu_error(model: str, fmu: Path, error: Exception) -> InputError:
    return InputError(f'the equations of the vehicle model "{model}" cannot be read from "{fmu}": {error}')


def _extract_to_cache(content: bytes, place: Path, name: str) -> Path:
    """A file with this content in the per-user cache; its path depends on the content, so it never changes under a user."""
    path = place / f"{sha256(content).hexdigest()[:20]}-{name}"
    if not path.exists():
        path.parent.mkdir(parents=True, exist_ok=True)
        with NamedTemporaryFile(dir=path.parent, delete=False) as file:
            file.write(content)
        Path(file.name).replace(path)
    return path


def bind_arrays(
    function: Callable[..., None], arguments: Sequence[np.ndarray], results: Sequence[np.ndarray]
) -> Callable[[], None]:
    """A call of `void f(const double *const in[], double *const out[])` on these contiguous arrays, without any conversion."""
    function.restype = None  # type: ignore[attr-defined]
    kept = (*arguments, *results)
    if not all(array.dtype == np.float64 and array.flags.c_contiguous for array in kept):
        raise TypeError("arrays of compiled functions are contiguous and of type float64")
    tables = [(ctypes.c_void_p * len(arrays))(*(array.ctypes.data for array in arrays)) for arrays in (arguments, results)]
    call = partial(function, *map(ctypes.byref, tables))
    call.arrays = kept  # type: ignore[attr-defined]  # they must live as long as the pointers
    return call
