"""Storage of recorded rows in memory, or in a file that survives a crash and may be larger than memory."""

from __future__ import annotations

import mmap
import os
import tempfile
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any
from weakref import finalize

import numpy as np

from ...core.errors import write_error

#: maximum size of a chunk of a file (bytes); number of values computed at a time
CHUNK_BYTES, BATCH_VALUES = 1 << 24, 1 << 18

#: maximum size of rows in memory (bytes)
MAX_MEMORY_BYTES = 1 << 26


class RowStore:
    """Rows of one structured dtype in memory.

    Attributes:
        dtype: Structured dtype of a row.
        chunk_rows: Number of rows of a chunk.
    """

    def __init__(self, dtype: np.dtype[Any], expected: int):
        self.dtype = dtype
        self.chunk_rows = max(1, expected)
        self._chunk = np.zeros(0, dtype)

    def add_chunk(self) -> np.ndarray:
        """Append a chunk of zeros and return it, shape (chunk_rows,)."""
        self._chunk = np.zeros(self.chunk_rows, self.dtype)
        return self._chunk

    def read_first(self, count: int) -> np.ndarray:
        """Return the first `count` rows, shape (count,)."""
        return self._chunk[:count]


class FileRowStore(RowStore):
    """Rows in a file, which contains all recorded rows even if the process is killed.

    Only the last chunk occupies memory. Disk space is allocated chunk by chunk, so that a full disk raises OutputError instead
    of crashing the process (SIGBUS).
    """

    def __init__(self, dtype: np.dtype[Any], expected: int, file: IO[bytes]):
        super().__init__(dtype, min(expected, CHUNK_BYTES // max(1, dtype.itemsize)))
        self._file, self._rows = file, 0
        finalize(self, file.close)

    def add_chunk(self) -> np.ndarray:
        """Append a chunk of zeros and return it, shape (chunk_rows,), mapped to the file.

        Raises:
            OutputError: The disk has no space for the chunk.
        """
        if not self.dtype.itemsize:
            return np.zeros(self.chunk_rows, self.dtype)
        begin = self._rows * self.dtype.itemsize
        self._rows += self.chunk_rows
        end = self._rows * self.dtype.itemsize
        try:
            _allocate_disk_space(self._file.fileno(), begin, end)
        except OSError as error:
            self._rows -= self.chunk_rows
            where = self._file.name if isinstance(self._file.name, str) else tempfile.gettempdir()
            text = f"cannot write {(end - begin) / 1e6:.3g} MB of recorded rows to {where}: {error.strerror}"
            raise write_error(text, error) from None
        page = begin - begin % mmap.ALLOCATIONGRANULARITY
        mapped = mmap.mmap(self._file.fileno(), end - page, offset=page)
        return np.frombuffer(mapped, self.dtype, self.chunk_rows, begin - page)

    def read_first(self, count: int) -> np.ndarray:
        """Return the first `count` rows, shape (count,), mapped to the file."""
        return read_rows(self._file, self.dtype, count)


def open_row_store(dtype: np.dtype[Any], expected: int, path: Path | None) -> RowStore:
    """Return a store in the file at `path`, else in memory, or in an unnamed temporary file if it exceeds `MAX_MEMORY_BYTES`.

    Args:
        dtype: Structured dtype of a row.
        expected: Number of rows that will be added.
        path: File that is created; None for none.
    """
    if path is None and expected * dtype.itemsize <= MAX_MEMORY_BYTES:
        return RowStore(dtype, expected)
    return FileRowStore(dtype, expected, path.open("w+b") if path else TemporaryFile())


def compute_in_chunks(count: int, fill: Callable[[range], np.ndarray], dtype: np.dtype[Any]) -> np.ndarray:
    """Compute an array piece by piece; a large one is stored in a temporary file.

    Args:
        count: Number of values.
        fill: Returns the values at a range of indices.
        dtype: Type of the values.

    Returns:
        All values, shape (count,).
    """
    store = open_row_store(dtype, count, None)
    for begin in range(0, count, store.chunk_rows):
        chunk = store.add_chunk()[: count - begin]
        for first in range(0, len(chunk), BATCH_VALUES):
            piece = fill(range(begin + first, begin + min(len(chunk), first + BATCH_VALUES)))
            chunk[first : first + len(piece)] = piece
    return store.read_first(count)


def read_rows(file: Path | IO[bytes], dtype: np.dtype[Any], count: int) -> np.ndarray:
    """Return the first `count` rows of a file, shape (count,), mapped to memory."""
    return np.memmap(file, dtype, "r", shape=(count,)) if count and dtype.itemsize else np.zeros(count, dtype)


def _allocate_disk_space(file: int, begin: int, end: int) -> None:
    """Extend the file to `end` bytes and allocate disk space from `begin` on."""
    if hasattr(os, "posix_fallocate") and end > begin:
        os.posix_fallocate(file, begin, end - begin)
    else:
        os.truncate(file, end)
