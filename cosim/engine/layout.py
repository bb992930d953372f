"""Memory layout of the values of all components.

A buffer with one array per dtype, each with one part per component.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import chain
from typing import Any, NamedTuple

import numpy as np

from ..core.component import Ports, Variable
from ..core.system import Endpoint

Dtype = np.dtype[Any]

#: alignment of every array (bytes)
ALIGNMENT = 64


class ArrayPosition(NamedTuple):
    """Position of a value: the dtype of its array, and the index in that array."""

    dtype: Dtype
    offset: int


@dataclass(frozen=True, eq=False)
class Layout:
    """Arrays of all components.

    Attributes:
        buffer: bytes that all numeric arrays share; strings and binaries are objects in a separate
            array.
        arrays: one array per dtype.
        ports: each component's variables and its parts of the arrays.
        positions: position of every scalar.
    """

    buffer: np.ndarray
    arrays: Mapping[Dtype, np.ndarray]
    ports: Mapping[str, Ports]
    positions: Mapping[Endpoint, ArrayPosition]

    def byte_offset(self, position: ArrayPosition) -> int:
        """Return the offset of a number in the buffer (bytes)."""
        return self._array_offsets[position.dtype] + position.offset * position.dtype.itemsize

    def copy_values(self) -> list[np.ndarray]:
        """Return a copy of all values, for `restore_values`."""
        return [array.copy() for array in self.arrays.values()]

    def restore_values(self, values: Sequence[np.ndarray]) -> None:
        """Restore values that `copy_values` returned."""
        for array, saved in zip(self.arrays.values(), values, strict=True):
            array[:] = saved

    @cached_property
    def _array_offsets(self) -> dict[Dtype, int]:
        numeric = (dtype for dtype in self.arrays if not dtype.hasobject)
        return {
            dtype: self.arrays[dtype].ctypes.data - self.buffer.ctypes.data for dtype in numeric
        }


def build_layout(variables: Mapping[str, Sequence[Variable]]) -> Layout:
    """Return the layout of the given variables of each component, in the given order."""
    positions: dict[Endpoint, ArrayPosition] = {}
    lengths: dict[Dtype, int] = defaultdict(int)
    parts: dict[str, dict[Dtype, slice]] = defaultdict(dict)
    for name, owned in variables.items():
        for dtype in {variable.dtype: None for variable in owned}:
            first = lengths[dtype]
            scalars = chain.from_iterable(v.scalar_names for v in owned if v.dtype == dtype)
            for scalar in scalars:
                positions[Endpoint(name, scalar)] = ArrayPosition(dtype, lengths[dtype])
                lengths[dtype] += 1
            parts[name][dtype] = slice(first, lengths[dtype])
    buffer, arrays = _allocate(lengths)
    ports = {}
    for name, owned in variables.items():
        own_arrays = {dtype: arrays[dtype][part] for dtype, part in parts[name].items()}
        ports[name] = Ports(tuple(owned), own_arrays)
    return Layout(buffer, arrays, ports, positions)


def _allocate(lengths: Mapping[Dtype, int]) -> tuple[np.ndarray, dict[Dtype, np.ndarray]]:
    """Return the buffer and its arrays, largest item size first.

    Numbers are zero, objects are empty strings.
    """
    numeric = sorted(
        (dtype for dtype in lengths if not dtype.hasobject), key=lambda dtype: -dtype.itemsize
    )
    sizes = {
        dtype: -(-lengths[dtype] * dtype.itemsize // ALIGNMENT) * ALIGNMENT for dtype in numeric
    }
    size = sum(sizes.values())
    memory = np.zeros(size + ALIGNMENT, np.uint8)
    first = -memory.ctypes.data % ALIGNMENT
    buffer = memory[first : first + size]
    arrays, begin = {}, 0
    for dtype in numeric:
        arrays[dtype] = buffer[begin : begin + lengths[dtype] * dtype.itemsize].view(dtype)
        begin += sizes[dtype]
    objects = {
        dtype: np.full(length, "", dtype) for dtype, length in lengths.items() if dtype.hasobject
    }
    return buffer, arrays | objects
