"""Atomic writing of files: each is written under a temporary name and then renamed."""

from __future__ import annotations

import glob
import json
import math
import mmap
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from tempfile import TemporaryFile
from typing import Any

import numpy as np

from ..core.errors import write_error
from ..process.row_store import FileMapping

#: suffix of files that are being written
_PART_SUFFIX = ".part"


def iterate_chunks(arrays: Sequence[np.ndarray], size: int) -> Iterator[slice]:
    """Yield slices that cover arrays of equal length, to read them in bounded memory.

    Memory of arrays that are mapped to files is released after each slice.

    Args:
        arrays: Arrays of shape (rows,).
        size: Maximum number of rows of a slice.
    """
    files = {id(file): file for array in arrays if (file := _memory_map(array))}
    for first in range(0, len(arrays[0]), size):
        yield slice(first, first + size)
        for file in files.values():
            file.madvise(mmap.MADV_DONTNEED)


def _memory_map(array: Any) -> mmap.mmap | FileMapping | None:
    """Return the file mapping behind an array; None if it is not mapped to a file."""
    while array is not None and not isinstance(array, mmap.mmap | FileMapping):
        array = getattr(array, "base", None)
    return array if hasattr(mmap, "MADV_DONTNEED") else None


@contextmanager
def writing_atomically(path: str | Path) -> Iterator[Path]:
    """Rename a temporary file to `path` at the end of the block, or remove it if the block raises.

    Args:
        path: The file to write; missing folders are created.

    Yields:
        Path of the temporary file, in the same folder.

    Raises:
        InputError: The path cannot be written.
        OutputError: The disk is full or defective.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{token_hex(8)}{_PART_SUFFIX}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise write_error(f"cannot write {path}: {error}", error) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def check_writable(directory: Path) -> None:
    """Create a folder if necessary.

    Raise OutputError or InputError if no file can be written there.
    """
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=directory):
            pass
    except OSError as error:
        raise write_error(
            f'cannot write to "{directory}": {error.strerror or error}', error
        ) from None


def remove_files(directory: Path, *names: str) -> None:
    """Remove files of earlier runs and their temporary files.

    Args:
        directory: Folder of the files.
        *names: Names of the files.

    Raises:
        OutputError: The disk failed or is full.
        InputError: A file cannot be removed.
    """
    try:
        for name in names:
            for path in (
                directory / name,
                *directory.glob(f".{glob.escape(name)}.*{_PART_SUFFIX}"),
            ):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise write_error(f'cannot replace "{path}": {error.strerror or error}', error) from None


def write_json(data: Mapping[str, Any], path: str | Path) -> None:
    """Write `data` as JSON with an indent of two spaces; see `to_json_types` for the values."""
    text = json.dumps(to_json_types(data), indent=2, ensure_ascii=False, allow_nan=False)
    with writing_atomically(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8", newline="\n")


def to_json_types(value: Any) -> Any:
    """Convert a value to types that JSON supports.

    Bytes become hexadecimal digits, NaN and infinities become None.
    """
    match value:
        case bytes():
            return value.hex()
        case Mapping():
            return {str(key): to_json_types(item) for key, item in value.items()}
        case list() | tuple():
            return [to_json_types(item) for item in value]
        case np.ndarray() | np.generic():
            return to_json_types(value.tolist())
        case float() if not math.isfinite(value):
            return None
        case Path():
            return value.as_posix()
    return value
