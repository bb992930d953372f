"""Compiled equations of a vehicle model, loaded from the binary of its plant FMU.

No compiler is needed to run a world.
"""

from __future__ import annotations

import ctypes
import shlex
import sys
from collections.abc import Callable, Mapping
from functools import cache, partial
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING
from zipfile import BadZipFile, ZipFile

import numpy as np

from cosim.core import resources
from cosim.core.errors import InputError
from cosim.export.equations.exported_interface import (
    ROWS_SUFFIX,
    first_difference,
    interface_hash,
    read_functions,
)
from cosim.results.files import writing_atomically

from ..vehicles.common.interface import WORLD_OUTPUTS

if TYPE_CHECKING:
    from ..catalogue import Model

#: sys.platform -> folder of FMI 2.0 binaries, suffix of shared libraries
_PLATFORMS = {
    "linux": ("linux64", ".so"),
    "darwin": ("darwin64", ".dylib"),
    "win32": ("win64", ".dll"),
}


class CompiledEquations:
    """Equations of a vehicle model in a shared library.

    The functions take microseconds, so they run without releasing the interpreter lock.

    Attributes:
        functions: Names and sizes of the arrays of each exported function.
        sizes: Size of each array of all functions, by name.

    Raises:
        InputError: If the FMU cannot be read, has no binary for this platform, or was built from
            other variables than those of `model`.
    """

    def __init__(self, model: Model):
        self._library = ctypes.PyDLL(str(library_path(model.binary)))
        try:
            expected = model.equation_variables_text
            if interface_hash(expected) != self._text("hash"):
                here, there = first_difference(expected, self._text("variables"))
                raise InputError(
                    f'"{_fmu_path(model.binary)}" was built from other variables: found "{there}", '
                    f'expected "{here}"; {_rebuilding(model.binary)}'
                )
            self.functions = read_functions(self._text("functions"))
        except ValueError:
            raise InputError(
                f'"{_fmu_path(model.binary)}" was built by an older version of cosim; '
                f"{_rebuilding(model.binary)}"
            ) from None
        self.sizes: dict[str, int] = {}
        for function in self.functions.values():
            self.sizes |= function.sizes
        self._refuse_other_sizes(model)

    def _text(self, name: str) -> str:
        """Return an exported text. Raises ValueError if the library has none."""
        address = ctypes.addressof(ctypes.c_char.in_dll(self._library, f"equations_{name}"))
        return ctypes.string_at(address).decode()

    def _refuse_other_sizes(self, model: Model) -> None:
        """Raise InputError if the world divides the variables among the arrays in another way."""
        world_outputs = {variable.name for variable in WORLD_OUTPUTS}
        counts = {
            "state": len(model.states),
            "inputs": model.input_count,
            "environment_inputs": len(model.environment_inputs),
            "motion": len(set(model.slots("output")) - world_outputs),
        }
        for name, expected in counts.items():
            if self.sizes[name] != expected:
                raise InputError(
                    f'"{_fmu_path(model.binary)}" has an array "{name}" of other size: found '
                    f"{self.sizes[name]} elements, expected {expected}; "
                    f"{_rebuilding(model.binary)}"
                )

    def bind(self, function: str, arrays: Mapping[str, np.ndarray]) -> Callable[[], None]:
        """Bind a function to its arrays, so that calls need no conversion of arguments.

        Args:
            function: Name of an exported function.
            arrays: Contiguous float64 arrays by the names of the function's arguments and results;
                further ones are ignored.

        Returns:
            A function without arguments. It keeps the arrays alive.

        Raises:
            TypeError: If an array is not contiguous or not of type float64.
            ValueError: If an array has another size than the function's.
        """
        signature = self.functions[function]
        sides = [
            _checked_arrays(function, arrays, side)
            for side in (signature.arguments, signature.results)
        ]
        tables = []
        for side in sides:
            addresses = [array.ctypes.data for array in side]
            tables.append((ctypes.c_void_p * len(side))(*addresses))
        pointer = getattr(self._library, function)
        pointer.restype = None
        call = partial(pointer, *map(ctypes.byref, tables))
        vars(call)["arrays"] = sides
        return call


def _checked_arrays(
    function: str, arrays: Mapping[str, np.ndarray], sizes: Mapping[str, int]
) -> list[np.ndarray]:
    """Return the arrays of one side of a function, in order."""
    for name, size in sizes.items():
        array = arrays[name]
        if array.dtype != np.float64 or not array.flags.c_contiguous:
            raise TypeError(
                f'{function}: the array "{name}" is not contiguous or not of type float64'
            )
        fits = array.size % size == 0 if name.endswith(ROWS_SUFFIX) else array.size == size
        if not fits:
            raise ValueError(
                f'{function}: the array "{name}" has {array.size} elements, expected {size}'
            )
    return [arrays[name] for name in sizes]


def _fmu_path(binary: str) -> Path:
    return resources.root() / "fmus" / f"{binary}.fmu"


def _rebuilding(binary: str) -> str:
    """Return the advice to build the FMU again, with the command."""
    folder = resources.root() / "plant_src" / "vehicles"
    source = folder / binary / "equations.py"
    if not source.exists():
        source = folder / "data" / f"{binary}.json"
    return f"rebuild it with `cosim build {shlex.quote(str(source))}`"


def library_path(model: str) -> Path:
    """Unpack the shared library of `fmus/MODEL.fmu` to the cache and return its path.

    Raises:
        InputError: If the FMU cannot be read or has no binary for this platform.
    """
    fmu = _fmu_path(model)
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
            f'"{fmu}" has no "{member}"; {_rebuilding(model)} on this platform'
        ) from None
    # the name contains a hash of the content, and a damaged file is replaced
    path = cache_folder / f"{sha256(content).hexdigest()[:20]}-{model}{suffix}"
    try:
        is_intact = path.read_bytes() == content
    except OSError:
        is_intact = False
    if not is_intact:
        with writing_atomically(path) as temporary:
            temporary.write_bytes(content)
    return path


def _unreadable_fmu_error(model: str, fmu: Path, error: Exception) -> InputError:
    return InputError(
        f'the equations of the vehicle model "{model}" cannot be read from "{fmu}": {error}'
    )
