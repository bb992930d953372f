"""Where values lie: one block of memory for all components, in it one array per dtype, in that a piece per component."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from ..core.component import Ports, Variable
from ..core.system import Endpoint

Dtype = np.dtype[Any]

#: every array begins at a multiple of this many bytes
ALIGNMENT = 64


class ArrayPosition(NamedTuple):
    """Where a value lies: in the array of its dtype, at this place."""

    dtype: Dtype
    offset: int


@dataclass(frozen=True, eq=False)
class Layout:
    """The arrays, each component's part of them, and the place of every slot.

    `block` is the memory (bytes) that all arrays of numbers share; texts and binaries are objects in an array of their own.
    """

    buffer: np.ndarray
    arrays: Mapping[Dtype, np.ndarray]
    ports: Mapping[str, Ports]
    positions: Mapping[Endpoint, ArrayPosition]

    def byte_offset(self, slot: ArrayPosition) -> int:
        """Where the value of a number begins in the block, in bytes."""
        return self._array_offsets[slot.dtype] + slot.offset * slot.dtype.itemsize

    @cached_property
    def _array_offsets(self) -> dict[Dtype, int]:
        numbers = (dtype for dtype in self.arrays if not dtype.hasobject)
        return {dtype: self.arrays[dtype].ctypes.data - self.buffer.ctypes.data for dtype in numbers}


def build_layout(variables: Mapping[str, Sequence[Variable]]) -> Layout:
    """Lay out the given variables of each component, in the given order."""
    places: dict[Endpoint, ArrayPosition] = {}
    extents: dict[Dtype, int] = defaultdict(int)
    parts: dict[str, dict[Dtype, slice]] = defaultdict(dict)
    for name, owned in variables.items():
        for dtype in {variable.dtype: None for variable in owned}:
            first = extents[dtype]
            for slot in (slot for variable in owned if variable.dtype == dtype for slot in variable.scalar_names):
                places[Endpoint(name, slot)] = ArrayPosition(dtype, extents[dtype])
                extents[dtype] += 1
            parts[name][dtype] = slice(first, extents[dtype])
    block, arrays = _allocate(extents)
    ports = {
        name: Ports(tuple(owned), {dtype: arrays[dtype][part] for dtype, part in parts[name].items()})
        for name, owned in variables.items()
    }
    return Layout(block, arrays, ports, places)


def _allocate(extents: Mapping[Dtype, int]) -> tuple[np.ndarray, dict[Dtype, np.ndarray]]:
    """The block and its arrays, the widest dtype first; all numbers are zero, all objects empty texts."""
    numbers = sorted((dtype for dtype in extents if not dtype.hasobject), key=lambda dtype: -dtype.itemsize)
    sizes = {dtype: _round_up(extents[dtype] * dtype.itemsize) for dtype in numbers}
    block = _allocate_aligned(sum(sizes.values()))
    arrays, begin = {}, 0
    for dtype in numbers:
        arrays[dtype] = block[begin : begin + extents[dtype] * dtype.itemsize].view(dtype)
        begin += sizes[dtype]
    return block, arrays | _object_arrays(extents.items())


def _object_arrays(extents: Iterable[tuple[Dtype, int]]) -> dict[Dtype, np.ndarray]:
    return {dtype: np.full(extent, "", dtype) for dtype, extent in extents if dtype.hasobject}


def _allocate_aligned(size: int) -> np.ndarray:
    block = np.zeros(size + ALIGNMENT, np.uint8)
    begin = -block.ctypes.data % ALIGNMENT
    return block[begin : begin + size]


def _round_up(size: int) -> int:
    return -(-size // ALIGNMENT) * ALIGNMENT
