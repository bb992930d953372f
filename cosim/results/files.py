"""Atomic writing of files: each is written under a temporary name and then renamed.

Every output of every command goes through `writing_atomically`. It follows symbolic links and
replaces only regular files; a FIFO, a character device and /dev/stdout are written to directly.
"""

import errno
import glob
import json
import math
import mmap
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from secrets import token_hex
from tempfile import TemporaryDirectory, TemporaryFile
from typing import Any

import numpy as np

from ..core import paths
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
    files = {id(file): file for file in map(_memory_map, arrays) if file}
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
    """Replace `path` by a temporary file at the end of the block, unless the block raises.

    Args:
        path: The file to write; missing folders are created. A symbolic link is kept, and the file
            that it leads to is replaced. A FIFO or character device is written to directly.

    Yields:
        Path of the temporary file, in a folder that this process can write.

    Raises:
        InputError: The path cannot be written.
        OutputError: The disk is full or defective.
    """
    path = Path(path)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        target = paths.file_to_replace(path)
        if target is None:
            with TemporaryDirectory() as folder:
                temporary = Path(folder) / path.name
                yield temporary
                with temporary.open("rb") as content:
                    paths.write_directly(content, path)
            return
        target.parent.mkdir(parents=True, exist_ok=True)
        temporary = target.with_name(f".{target.name}.{token_hex(8)}{_PART_SUFFIX}")
        try:
            yield temporary
            temporary.replace(target)
        finally:
            with suppress(OSError):
                temporary.unlink()
    except OSError as error:
        raise write_error(f"cannot write {path}: {error}", error) from error


def write_file(path: str | Path, content: str | bytes) -> None:
    """Write a whole file atomically, see `writing_atomically`; text is encoded as UTF-8."""
    data = content if isinstance(content, bytes) else content.encode()
    with writing_atomically(path) as temporary:
        temporary.write_bytes(data)


def check_writable(directory: Path) -> None:
    """Check that files can be written to a folder, which need not exist; create nothing.

    Raises:
        InputError: The folder or its nearest existing parent cannot be written.
        OutputError: The disk is full or defective.
    """
    existing = next(path for path in (directory, *directory.parents) if path.exists())
    try:
        if not existing.is_dir():
            raise FileExistsError(errno.EEXIST, os.strerror(errno.EEXIST), str(existing))
        with TemporaryFile(dir=existing):
            pass
    except OSError as error:
        raise write_error(
            f'cannot write to "{directory}": {error.strerror or error}', error
        ) from None


def check_output_file(path: Path) -> Path | None:
    """Check that an output can be written, and return the file that it replaces.

    Args:
        path: The output; its folder need not exist.

    Returns:
        See `paths.file_to_replace`.

    Raises:
        InputError: The path cannot be written.
        OutputError: The disk is full or defective.
    """
    try:
        target = paths.file_to_replace(path)
        if target is None and not os.access(path, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    except OSError as error:
        raise write_error(f'cannot write "{path}": {error.strerror or error}', error) from None
    if target is not None:
        check_writable(target.parent)
    return target


def remove_files(directory: Path, *names: str) -> None:
    """Remove files of earlier runs and their temporary files.

    Symbolic links are kept, and so is what is no regular file; folders and sockets are refused.

    Args:
        directory: Folder of the files.
        *names: Names of the files.

    Raises:
        OutputError: The disk failed or is full.
        InputError: A file cannot be removed.
    """
    try:
        targets = []
        for path in map(directory.joinpath, names):
            targets.append(paths.file_to_replace(path))
        for target in filter(None, targets):  # only now, so that all are kept if one is refused
            path = target
            target.unlink(missing_ok=True)
            for part in target.parent.glob(f".{glob.escape(target.name)}.*{_PART_SUFFIX}"):
                part.unlink(missing_ok=True)
    except OSError as error:
        raise write_error(f'cannot replace "{path}": {error.strerror or error}', error) from None


def write_json(data: Mapping[str, Any], path: str | Path) -> None:
    """Write `data` as JSON with an indent of two spaces; see `to_json_types` for the values."""
    text = json.dumps(to_json_types(data), indent=2, ensure_ascii=False, allow_nan=False)
    write_file(path, text + "\n")


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
