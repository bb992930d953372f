"""Evaluation of external C functions in Python.

The library of a model's C code, compiled on first use and called by ctypes.
"""

import ctypes
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from ....core.resources import cache_directory
from ....results.files import writing_atomically
from ...fmu.compiler import compile_library
from ..model.arithmetic import EvaluationError
from ..model.flat_model import Function
from .c_files import Argument, CallSignature, call_signature, external_archives, external_files

_C_TYPES: dict[str, Any] = {
    "Real": ctypes.c_double,
    "Integer": ctypes.c_int32,
    "Enumeration": ctypes.c_int32,
    "Boolean": ctypes.c_bool,
    "String": ctypes.c_char_p,
    "ExternalObject": ctypes.c_void_p,
}
_VISIBLE = (
    '#pragma GCC visibility push(default)\n#include "external.h"\n#include "external_calls.h"\n'
    "#pragma GCC visibility pop\n"
)
_owners = count(1)


def callable_functions(
    functions: Mapping[str, Function], packages: Mapping[str, Path]
) -> dict[str, Function]:
    """Return the functions of a model with a library that evaluates the external ones."""
    library = ExternalLibrary({name: f for name, f in functions.items() if f.external}, packages)
    return {
        name: replace(f, external=replace(f.external, library=library)) if f.external else f
        for name, f in functions.items()
    }


@dataclass
class ExternalLibrary:
    """External functions of a model.

    Args:
        functions: The external functions by their names.
        packages: Top-level package -> its folder.
    """

    functions: Mapping[str, Function]
    packages: Mapping[str, Path]
    #: constructor and arguments -> identifier of the object
    _objects: dict[tuple[Any, ...], int] = field(default_factory=dict)
    _owner: int = field(default_factory=lambda: next(_owners))

    def call(self, function: Function, inputs: Sequence[Any]) -> dict[int, Any]:
        """Call the C function of an external function.

        Args:
            function: The external function.
            inputs: Values of the arguments, those of the outputs included.

        Returns:
            Number of the argument -> value of the output; the result has the number -1.

        Raises:
            EvaluationError: The C function has called ModelicaError.
        """
        signature = call_signature(function)
        key = (
            function.name,
            *(value.tobytes() if isinstance(value, np.ndarray) else value for value in inputs),
        )
        if signature.is_constructor and key in self._objects:
            return {-1: self._objects[key]}
        pairs = zip(inputs, signature.arguments, strict=True)
        passed = [
            _passed(self._object(value) if a.type == "ExternalObject" else value, a)
            for value, a in pairs
        ]
        results = (
            [(ctypes.c_uint64 if signature.is_constructor else _C_TYPES[signature.result])()]
            if signature.result
            else []
        )
        arguments = [*self._arguments(signature, passed), *map(ctypes.byref, results)]
        if not getattr(self._library, signature.name)(*arguments):
            reason = f"the external function {function.name} has failed".encode()
            raise EvaluationError(
                self._library.external_reason(reason, None, 0).decode(errors="replace"),
                function.where,
            )
        outputs = {
            k: _value(passed[k])
            for k, argument in enumerate(signature.arguments)
            if argument.is_output
        }
        for result in results:
            outputs[-1] = (
                result.value.decode(errors="replace")
                if isinstance(result, ctypes.c_char_p) and result.value
                else result.value
            )
        if signature.is_constructor:
            self._objects[key] = outputs[-1]
        return outputs

    def _object(self, identifier: int) -> int | None:
        address: int | None = self._library.external_object(
            ctypes.c_void_p(self._owner), ctypes.c_uint64(identifier)
        )
        return address

    def _arguments(self, signature: CallSignature, passed: Sequence[Any]) -> list[Any]:
        arguments: list[Any] = [ctypes.c_void_p(self._owner)] * signature.is_constructor
        for value, argument in zip(passed, signature.arguments, strict=True):
            if argument.is_array:
                arguments.append(value.ctypes.data_as(ctypes.c_void_p))
                arguments += [ctypes.c_size_t(value.size)] * signature.is_constructor
            else:
                arguments.append(ctypes.byref(value) if argument.is_output else value)
        return arguments

    @cached_property
    def _library(self) -> Any:
        """The shared library; it is compiled unless the cache contains it."""
        files = external_files(self.functions.values(), self.packages)
        archives = {
            n: path.read_bytes()
            for n, path in external_archives(self.functions.values(), self.packages).items()
        }
        digest = sha256(
            repr((sorted(files.items()), sorted(archives.items()))).encode()
        ).hexdigest()[:24]
        target = cache_directory() / "modelica" / f"external-{digest}.so"
        if not target.is_file():
            with (
                TemporaryDirectory(prefix="cosim-external-") as temporary,
                writing_atomically(target) as written,
            ):
                texts = {**files, "external_calls.c": _VISIBLE + files["external_calls.c"]}
                texts["external.c"] = _VISIBLE + texts["external.c"]
                for name, text in texts.items():
                    (Path(temporary) / name).write_text(text)
                for name, content in archives.items():
                    (Path(temporary) / name).write_bytes(content)
                compile_library(
                    Path(temporary),
                    [*sorted(n for n in texts if n.endswith(".c")), *archives],
                    written,
                )
        library = ctypes.CDLL(str(target))
        library.external_object.restype = ctypes.c_void_p
        library.external_reason.restype = ctypes.c_char_p
        library.external_reason.argtypes = [ctypes.c_char_p, ctypes.c_void_p, ctypes.c_size_t]
        for function in self.functions.values():
            getattr(library, call_signature(function).name).restype = ctypes.c_bool
        return library


def _passed(value: Any, argument: Argument) -> Any:
    """Return a value as an argument of a C function; arrays are copied."""
    if argument.is_array:
        return np.array(value, dtype=np.float64 if argument.type == "Real" else np.int32)
    return _C_TYPES[argument.type](value.encode() if isinstance(value, str) else value)


def _value(passed: Any) -> Any:
    return passed if isinstance(passed, np.ndarray) else passed.value
