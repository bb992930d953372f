"""The memory that the importer and one worker share."""

from __future__ import annotations

import ctypes
import mmap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....core.component import Ports
from ....process import journal as journals
from ....process.journal import Journal

_CLOCK, _VALUES = journals.SIZE, journals.SIZE + 64
_TEXTS = np.dtype(object)
_PROT_READ_WRITE, _MAP_PRIVATE, _MAP_FIXED, _MAP_ANONYMOUS = 3, 0x02, 0x10, 0x20


class Block:
    """The worker's journal, the time of the step, and mirrors of the arrays that inputs and outputs are bound to.

    The importer copies values between its arrays and the mirrors, so that a worker can spoil nothing but its own values.
    Texts are in no shared memory; their mirrors belong to the worker.
    """

    def __init__(self, inputs: Ports, outputs: Ports):
        self.memory = mmap.mmap(-1, _VALUES + _size(inputs) + _size(outputs))
        self.journal = Journal(self.memory)
        #: the integers of the journal, which the worker writes in every step
        self.marker = memoryview(self.memory)[:64].cast("q")
        self.clock = ctypes.c_double.from_buffer(self.memory, _CLOCK)
        self.inputs = self._mirror(inputs, _VALUES)
        self.outputs = self._mirror(outputs, _VALUES + _size(inputs))

    def _mirror(self, ports: Ports, offset: int) -> Ports:
        arrays: dict[np.dtype[Any], np.ndarray] = {}
        for dtype, array in ports.arrays.items():
            if dtype.hasobject or not len(array):
                arrays[dtype] = np.empty(len(array), dtype)
            else:
                arrays[dtype] = np.frombuffer(self.memory, dtype, len(array), offset)
                offset += _room(array)
        return Ports(ports.variables, arrays)

    def keep_others_out(self) -> None:
        """In the worker: what the importer shares with anybody is no longer shared with this process, except this block."""
        own = ctypes.addressof(self.clock)
        library = ctypes.CDLL(None, use_errno=True)
        library.mmap.restype = ctypes.c_void_p
        for begin, end in _shared_regions():
            if not begin <= own < end:
                flags = _MAP_PRIVATE | _MAP_FIXED | _MAP_ANONYMOUS
                address, size = ctypes.c_void_p(begin), ctypes.c_size_t(end - begin)
                library.mmap(address, size, _PROT_READ_WRITE, flags, -1, ctypes.c_long(0))


def pairs(targets: Ports, sources: Ports) -> list[tuple[memoryview, memoryview]]:
    """The numbers of both as bytes: `target[:] = source` copies an array."""
    both = [(targets.arrays[dtype], source) for dtype, source in sources.arrays.items() if not dtype.hasobject and len(source)]
    return [(_bytes(target), _bytes(source)) for target, source in both]


def _bytes(array: np.ndarray) -> memoryview:
    return array.view(np.uint8).data


def texts(ports: Ports) -> np.ndarray:
    """The array of texts; empty where there are none."""
    return ports.arrays.get(_TEXTS, np.empty(0, object))


def _size(ports: Ports) -> int:
    return sum(_room(array) for dtype, array in ports.arrays.items() if not dtype.hasobject)


def _room(array: np.ndarray) -> int:
    return -(-array.nbytes // 8) * 8


def _shared_regions() -> Sequence[tuple[int, int]]:
    """Where memory lies that is writable and shared, as far as the system tells (Linux)."""
    try:
        lines = [line.split(maxsplit=2) for line in Path("/proc/self/maps").read_text().splitlines()]
    except OSError:
        return []
    bounds = [place.split("-") for place, rights, _ in lines if rights[1] == "w" and rights[3] == "s"]
    return [(int(begin, 16), int(end, 16)) for begin, end in bounds]
