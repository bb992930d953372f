"""Storage of recorded rows in memory, or in a file that may be larger than memory."""

import ctypes
import mmap
import os
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any
from weakref import finalize

import numpy as np

from ..core.errors import write_error

#: maximum size of a chunk of a file (bytes)
CHUNK_BYTES = 1 << 24
#: maximum size of rows in memory (bytes)
MAX_MEMORY_BYTES = 1 << 26


class RowStore:
    """Rows of one structured dtype in memory, in an array that is replaced by a larger one if full.

    Attributes:
        dtype: Structured dtype of a row.
    """

    def __init__(self, dtype: np.dtype[Any], expected: int):
        self.dtype = dtype
        self._expected = max(1, expected)
        self._rows = np.zeros(0, dtype)

    def provide_chunk(self, count: int) -> tuple[int, np.ndarray]:
        """Forget all but the first `count` rows, and provide space for at least one more.

        Arrays that `read_first` has returned keep their rows.

        Returns:
            Number of the first row of the chunk in which the next row lies, and the chunk.
        """
        rows = np.zeros(max(self._expected, 2 * count), self.dtype)
        rows[:count] = self._rows[:count]
        self._rows = rows
        return 0, rows

    def read_first(self, count: int) -> np.ndarray:
        """Return the first `count` rows, shape (count,)."""
        return self._rows[:count]


class FileRowStore(RowStore):
    """Rows in a file, which contains all recorded rows even if the process is killed.

    Only the last chunk occupies memory. Disk space is allocated chunk by chunk, so that a full disk
    raises OutputError instead of crashing the process (SIGBUS). A file given by its path is open
    only while a chunk is added, see `FileMapping`.
    """

    def __init__(self, dtype: np.dtype[Any], expected: int, file: Path | IO[bytes]):
        super().__init__(dtype, expected)
        self._file = file
        self._chunk_rows = max(1, min(expected, CHUNK_BYTES // dtype.itemsize))
        if isinstance(file, Path):
            file.write_bytes(b"")

    @contextmanager
    def _open(self) -> Iterator[IO[bytes]]:
        if isinstance(self._file, Path):
            with self._file.open("r+b") as file:
                yield file
        else:
            yield self._file

    def provide_chunk(self, count: int) -> tuple[int, np.ndarray]:
        """Map the chunk of the next row after the first `count` rows; a new one contains zeros.

        Raises:
            OutputError: The disk has no space for the chunk.
        """
        first = count - count % self._chunk_rows
        begin, size = first * self.dtype.itemsize, self._chunk_rows * self.dtype.itemsize
        try:
            with self._open() as file:
                _allocate_disk_space(file.fileno(), begin, begin + size)
                return first, map_rows(file, self.dtype, first, self._chunk_rows, writable=True)
        except OSError as error:
            where = self._file if isinstance(self._file, Path) else tempfile.gettempdir()
            raise write_error(
                f"cannot write {size / 1e6:.3g} MB of recorded rows to {where}: {error.strerror}",
                error,
            ) from None

    def read_first(self, count: int) -> np.ndarray:
        """Return the first `count` rows, shape (count,), mapped to the file."""
        with self._open() as file:
            return map_rows(file, self.dtype, 0, count)


class FileMapping:
    """Part of a file mapped to memory without an open descriptor.

    Foreign code in this process could truncate the file by its descriptor.

    `mmap.mmap` would keep a descriptor open. `np.asarray` returns the bytes as an array.
    """

    def __init__(self, file: int, begin: int, size: int, writable: bool):
        library = _c_library()
        page = begin - begin % mmap.ALLOCATIONGRANULARITY
        self._length = begin - page + size
        protection = mmap.PROT_READ | (mmap.PROT_WRITE if writable else 0)
        length, offset = ctypes.c_size_t(self._length), ctypes.c_long(page)
        self._address = library.mmap(None, length, protection, mmap.MAP_SHARED, file, offset)
        if self._address == ctypes.c_void_p(-1).value:
            number = ctypes.get_errno()
            raise OSError(number, os.strerror(number))
        address = self._address + begin - page
        self.__array_interface__ = {
            "data": (address, not writable),
            "shape": (size,),
            "typestr": "|u1",
            "version": 3,
        }
        finalize(self, library.munmap, ctypes.c_void_p(self._address), length).atexit = False

    def madvise(self, option: int) -> None:
        """Give the operating system advice about the mapping, like `mmap.mmap.madvise`."""
        _c_library().madvise(ctypes.c_void_p(self._address), ctypes.c_size_t(self._length), option)


@cache
def _c_library() -> Any:
    library = ctypes.CDLL(None, use_errno=True)
    library.mmap.restype = ctypes.c_void_p
    return library


def map_rows(
    file: IO[bytes], dtype: np.dtype[Any], first: int, count: int, writable: bool = False
) -> np.ndarray:
    """Map `count` rows of a file from row `first` on, shape (count,)."""
    if not count:
        return np.zeros(0, dtype)
    begin, size = first * dtype.itemsize, count * dtype.itemsize
    if sys.platform == "win32":
        return np.memmap(file, dtype, "r+" if writable else "r", begin, (count,))
    return np.asarray(FileMapping(file.fileno(), begin, size, writable)).view(dtype)


def open_row_store(dtype: np.dtype[Any], expected: int, path: Path | None) -> RowStore:
    """Return a store in the file at `path`, in memory, or in a temporary file if it is large.

    Args:
        dtype: Structured dtype of a row.
        expected: Number of rows that will be added.
        path: File that is created; None for none.
    """
    if path is None and expected * dtype.itemsize <= MAX_MEMORY_BYTES:
        return RowStore(dtype, expected)
    return FileRowStore(dtype, expected, path or TemporaryFile())


def _allocate_disk_space(file: int, begin: int, end: int) -> None:
    """Extend the file to `end` bytes and allocate disk space from `begin` on."""
    if hasattr(os, "posix_fallocate") and end > begin:
        os.posix_fallocate(file, begin, end - begin)
    else:
        os.truncate(file, end)
