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

_CLOCK_OFFSET, _VALUES_OFFSET = journals.JOURNAL_SIZE, journals.JOURNAL_SIZE + 64
_OBJECT_DTYPE = np.dtype(object)
_PROT_READ_WRITE, _MAP_PRIVATE, _MAP_FIXED, _MAP_ANONYMOUS = 3, 0x02, 0x10, 0x20


class SharedMemoryBlock:
    """The worker's journal, the time of the step, and mirrors of the arrays that inputs and outputs are bound to.

    The importer copies values between its arrays and the mirrors, so that a worker can spoil nothing but its own values.
    Texts are in no shared memory; their mirrors belong to the worker.
    """

    def __init__(self, inputs: Ports, outputs: Ports):
        self.memory = mmap.mmap(-1, _VALUES_OFFSET + _mirror_size(inputs) + _mirror_size(outputs))
        self.journal = Journal(self.memory)
        #: the integers of the journal, which the worker writes in every step
        self.marker = memoryview(self.memory)[:64].cast("q")
        self.clock = ctypes.c_double.from_buffer(self.memory, _CLOCK_OFFSET)
        self.inputs = self._mirror(inputs, _VALUES_OFFSET)
        self.outputs = self._mirror(outputs, _VALUES_OFFSET + _mirror_size(inputs))

    def _mirror(self, ports: Ports, offset: int) -> Ports:
        arrays: dict[np.dtype[Any], np.ndarray] = {}
        for dtype, array in ports.arrays.items():
            if dtype.hasobject or not len(array):
                arrays[dtype] = np.empty(len(array), dtype)
            else:
                arrays[dtype] = np.frombuffer(self.memory, dtype, len(array), offset)
                offset += _aligned_size(array)
        return Ports(ports.variables, arrays)

    def unshare_other_memory(self) -> None:
        """In the worker: what the importer shares with anybody is no longer shared with this process, except this block."""
        own = ctypes.addressof(self.clock)
        library = ctypes.CDLL(None, use_errno=True)
        library.mmap.restype = ctypes.c_void_p
        for begin, end in _shared_regions():
            if not begin <= own < end:
                flags = _MAP_PRIVATE | _MAP_FIXED | _MAP_ANONYMOUS
                address, size = ctypes.c_void_p(begin), ctypes.c_size_t(end - begin)
                library.mmap(address, size, _PROT_READ_WRITE, flags, -1, ctypes.c_long(0))


def matching_buffers(targets: Ports, sources: Ports) -> list[tuple[memoryview, memoryview]]:
    """The numbers of both as bytes: `target[:] = source` copies an array."""
    both = [(targets.arrays[dtype], source) for dtype, source in sources.arrays.items() if not dtype.hasobject and len(source)]
    return [(_byte_view(target), _byte_view(source)) for target, source in both]


def _byte_view(array: np.ndarray) -> memoryview:
    return array.view(np.uint8).data


def string_array(ports: Ports) -> np.ndarray:
    """The array of texts; empty where there are none."""
    return ports.arrays.get(_OBJECT_DTYPE, np.empty(0, object))


def _mirror_size(ports: Ports) -> int:
    return sum(_aligned_size(array) for dtype, array in ports.arrays.items() if not dtype.hasobject)


def _aligned_size(array: np.ndarray) -> int:
    return -(-array.nbytes // 8) * 8


def _shared_regions() -> Sequence[tuple[int, int]]:
    """Where memory lies that is writable and shared, as far as the system tells (Linux)."""
    try:
        lines = [line.split(maxsplit=2) for line in Path("/proc/self/maps").read_text().splitlines()]
    except OSError:
        return []
    bounds = [place.split("-") for place, rights, _ in lines if rights[1] == "w" and rights[3] == "s"]
    return [(int(begin, 16), int(end, 16)) for begin, end in bounds]
