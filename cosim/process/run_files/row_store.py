"""Where recorded rows lie: in memory, or chunk by chunk in a file that outlives a crash and may be larger than memory."""

from __future__ import annotations

import mmap
import os
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any
from weakref import finalize

import numpy as np

#: a chunk of a file is at most this large (bytes); so many values are computed at a time
CHUNK_BYTES, BATCH_VALUES = 1 << 24, 1 << 18

#: more than this (bytes) is not kept in memory
MAX_MEMORY_BYTES = 1 << 26


class RowStore:
    """Rows of one structured dtype, in memory; `expected` rows are all that will come."""

    def __init__(self, dtype: np.dtype[Any], expected: int):
        self.dtype = dtype
        #: rows of a chunk
        self.chunk_rows = max(1, expected)
        self._chunk = np.zeros(0, dtype)

    def add_chunk(self) -> np.ndarray:
        """A new chunk at the end, to be filled."""
        self._chunk = np.zeros(self.chunk_rows, self.dtype)
        return self._chunk

    def read_first(self, count: int) -> np.ndarray:
        """The first `count` rows."""
        return self._chunk[:count]


class FileRowStore(RowStore):
    """Rows in a file, one after the other: what was recorded is in it even when the process is killed.

    Only the chunk that is being filled occupies memory. The disk's space is claimed chunk by chunk, so that a full disk is an
    OSError and no crash.
    """

    def __init__(self, dtype: np.dtype[Any], expected: int, file: IO[bytes]):
        super().__init__(dtype, min(expected, CHUNK_BYTES // max(1, dtype.itemsize)))
        self._file, self._rows = file, 0
        finalize(self, file.close)

    def add_chunk(self) -> np.ndarray:
        if not self.dtype.itemsize:
            return np.zeros(self.chunk_rows, self.dtype)
        begin = self._rows * self.dtype.itemsize
        self._rows += self.chunk_rows
        end = self._rows * self.dtype.itemsize
        _allocate_disk_space(self._file.fileno(), begin, end)
        page = begin - begin % mmap.ALLOCATIONGRANULARITY
        mapped = mmap.mmap(self._file.fileno(), end - page, offset=page)
        return np.frombuffer(mapped, self.dtype, self.chunk_rows, begin - page)

    def read_first(self, count: int) -> np.ndarray:
        return read_rows(self._file, self.dtype, count)


def open_row_store(dtype: np.dtype[Any], expected: int, path: Path | None) -> RowStore:
    """Rows in the file at `path`; without one in memory, or in a temporary file that nobody sees when they are many."""
    if path is None and expected * dtype.itemsize <= MAX_MEMORY_BYTES:
        return RowStore(dtype, expected)
    return FileRowStore(dtype, expected, path.open("w+b") if path else TemporaryFile())


def compute_in_chunks(count: int, fill: Callable[[range], np.ndarray], dtype: np.dtype[Any]) -> np.ndarray:
    """The values 0 ... count - 1 that `fill` makes piece by piece; many of them lie in a temporary file."""
    store = open_row_store(dtype, count, None)
    for begin in range(0, count, store.chunk_rows):
        chunk = store.add_chunk()[: count - begin]
        for first in range(0, len(chunk), BATCH_VALUES):
            piece = fill(range(begin + first, begin + min(len(chunk), first + BATCH_VALUES)))
            chunk[first : first + len(piece)] = piece
    return store.read_first(count)


def read_rows(file: Path | IO[bytes], dtype: np.dtype[Any], count: int) -> np.ndarray:
    """The first `count` rows of a file of rows, read when they are used."""
    return np.memmap(file, dtype, "r", shape=(count,)) if count and dtype.itemsize else np.zeros(count, dtype)


def _allocate_disk_space(file: int, begin: int, end: int) -> None:
    """Make the file `end` bytes long with disk space behind every byte."""
    if hasattr(os, "posix_fallocate") and end > begin:
        os.posix_fallocate(file, begin, end - begin)
    else:
        os.truncate(file, end)
