"""Memory shared by the importer process and one worker process."""

import ctypes
import mmap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ....core.component import Ports
from ....process import journal as journals
from ....process.journal import Journal

_TIME_OFFSET, _VALUES_OFFSET = journals.JOURNAL_SIZE, journals.JOURNAL_SIZE + 64
_OBJECT_DTYPE = np.dtype(object)
_PROT_READ_WRITE, _MAP_PRIVATE, _MAP_FIXED, _MAP_ANONYMOUS = 3, 0x02, 0x10, 0x20


class SharedMemoryBlock:
    """Shared memory block: the worker's journal, the current time, and mirrors of the bound arrays.

    The importer copies values between its own arrays and the mirrors, so that a worker process can
    change only its own values. Strings are sent through the pipes; their arrays here are private to
    each process.

    Attributes:
        memory: The shared memory.
        journal: Journal of the worker process.
        marker: Integers of the journal, which the worker process writes in every step.
        current_time: Communication point at which the step starts (s).
        inputs: Mirrors of the input arrays.
        outputs: Mirrors of the output arrays.
    """

    def __init__(self, inputs: Ports, outputs: Ports):
        """Allocate the block for the bound arrays of a component."""
        self.memory = mmap.mmap(-1, _VALUES_OFFSET + _mirror_size(inputs) + _mirror_size(outputs))
        self.journal = Journal(self.memory)
        self.marker = memoryview(self.memory)[:64].cast("q")
        self.current_time = ctypes.c_double.from_buffer(self.memory, _TIME_OFFSET)
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
        """Replace all other shared mappings of this process by private ones.

        Called in the worker process.

        A forked worker process inherits the importer's mappings, such as the blocks of other
        workers (Linux only).
        """
        own_address = ctypes.addressof(self.current_time)
        library = ctypes.CDLL(None, use_errno=True)
        library.mmap.restype = ctypes.c_void_p
        for begin, end in _shared_regions():
            if not begin <= own_address < end:
                flags = _MAP_PRIVATE | _MAP_FIXED | _MAP_ANONYMOUS
                address, size = ctypes.c_void_p(begin), ctypes.c_size_t(end - begin)
                library.mmap(address, size, _PROT_READ_WRITE, flags, -1, ctypes.c_long(0))


def matching_buffers(targets: Ports, sources: Ports) -> list[tuple[memoryview, memoryview]]:
    """Pair the numeric arrays of two ports.

    Returns:
        Pairs (target, source) of byte views; `target[:] = source` copies an array.
    """
    pairs = [
        (targets.arrays[dtype], source)
        for dtype, source in sources.arrays.items()
        if not dtype.hasobject and len(source)
    ]
    return [(_byte_view(target), _byte_view(source)) for target, source in pairs]


def _byte_view(array: np.ndarray) -> memoryview:
    return array.view(np.uint8).data


def string_array(ports: Ports) -> np.ndarray:
    """Return the array of String and Binary values, which is empty if there are none."""
    return ports.arrays.get(_OBJECT_DTYPE, np.empty(0, object))


def _mirror_size(ports: Ports) -> int:
    return sum(_aligned_size(array) for dtype, array in ports.arrays.items() if not dtype.hasobject)


def _aligned_size(array: np.ndarray) -> int:
    return -(-array.nbytes // 8) * 8


def _shared_regions() -> Sequence[tuple[int, int]]:
    """Return (begin, end) addresses of writable shared mappings.

    Empty where /proc/self/maps does not exist.
    """
    try:
        lines = [
            line.split(maxsplit=2) for line in Path("/proc/self/maps").read_text().splitlines()
        ]
    except OSError:
        return []
    bounds = [
        addresses.split("-")
        for addresses, permissions, _ in lines
        if permissions[1] == "w" and permissions[3] == "s"
    ]
    return [(int(begin, 16), int(end, 16)) for begin, end in bounds]
