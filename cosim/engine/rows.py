"""Where recorded rows lie: in chunks of memory, or in a file that outlives a crash and may be larger than memory."""

from __future__ import annotations

import mmap
import os
from pathlib import Path
from typing import Any

import numpy as np

#: a chunk is at most this large (bytes)
CHUNK = 1 << 26


class Rows:
    """Rows of one structured dtype, in chunks of memory; `expected` rows are all that will come."""

    def __init__(self, dtype: np.dtype[Any], expected: int):
        self.dtype = dtype
        #: rows of a chunk
        self.chunk_rows = max(1, min(expected, CHUNK // max(1, dtype.itemsize)))
        self._chunks: list[np.ndarray] = []

    def extend(self) -> np.ndarray:
        """A new chunk at the end, to be filled."""
        self._chunks.append(np.zeros(self.chunk_rows, self.dtype))
        return self._chunks[-1]

    def first(self, count: int) -> np.ndarray:
        """The first `count` rows."""
        if not self._chunks:
            return np.zeros(0, self.dtype)
        return (self._chunks[0] if len(self._chunks) == 1 else np.concatenate(self._chunks))[:count]


class FileRows(Rows):
    """Rows in a file, one after the other: what was recorded is in it even when the process is killed.

    Only the chunk that is being filled occupies memory. The disk's space is claimed chunk by chunk, so that a full disk is an
    OSError and no crash.
    """

    def __init__(self, dtype: np.dtype[Any], expected: int, path: Path):
        super().__init__(dtype, expected)
        self._path, self._rows = path, 0
        path.write_bytes(b"")

    def extend(self) -> np.ndarray:
        begin = self._rows * self.dtype.itemsize
        self._rows += self.chunk_rows
        end = self._rows * self.dtype.itemsize
        with self._path.open("r+b") as file:
            _claim(file.fileno(), begin, end)
            page = begin - begin % mmap.ALLOCATIONGRANULARITY
            mapped = mmap.mmap(file.fileno(), end - page, offset=page)
        return np.frombuffer(mapped, self.dtype, self.chunk_rows, begin - page)

    def first(self, count: int) -> np.ndarray:
        return read_rows(self._path, self.dtype, count)


def read_rows(path: Path, dtype: np.dtype[Any], count: int) -> np.ndarray:
    """The first `count` rows of a file of rows, read when they are used."""
    return np.memmap(path, dtype, "r", shape=(count,)) if count and dtype.itemsize else np.zeros(count, dtype)


def _claim(file: int, begin: int, end: int) -> None:
    """Make the file `end` bytes long with disk space behind every byte."""
    if hasattr(os, "posix_fallocate") and end > begin:
        os.posix_fallocate(file, begin, end - begin)
    else:
        os.truncate(file, end)
