"""Files that are either whole or not there: each is written under a temporary name and then renamed."""

from __future__ import annotations

import errno
import glob
import json
import math
import mmap
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any

import numpy as np

from ..core.errors import CosimError, InputError, OutputError

#: what the disk is to blame for, and not the path
_DISK_ERRORS = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO}

#: end of the names of files that are being written
_PART_SUFFIX = ".part"


def iterate_chunks(arrays: Sequence[np.ndarray], size: int) -> Iterator[slice]:
    """Slices of at most `size` rows that cover arrays of equal length, to read them in bounded memory.

    What was read of arrays that lie in files is let go of after each piece.
    """
    files = {id(file): file for array in arrays if (file := _memory_map(array))}
    for first in range(0, len(arrays[0]), size):
        yield slice(first, first + size)
        for file in files.values():
            file.madvise(mmap.MADV_DONTNEED)


def _memory_map(array: Any) -> mmap.mmap | None:
    while array is not None and not isinstance(array, mmap.mmap):
        array = getattr(array, "base", None)
    return array if hasattr(mmap, "MADV_DONTNEED") else None


@contextmanager
def writing_atomically(path: str | Path) -> Iterator[Path]:
    """A temporary path beside `path`; what is written there becomes `path` when the block ends well, else it disappears.

    Missing folders are made. Raises InputError when nothing can be written there, OutputError when the disk is full or failed.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}{_PART_SUFFIX}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise _write_error(f"cannot write {path}: {error}", error) from error
    finally:
        with suppress(OSError):
            temporary.unlink()


def _write_error(text: str, error: OSError) -> CosimError:
    return OutputError(text) if error.errno in _DISK_ERRORS else InputError(text)


def check_writable(directory: Path) -> None:
    """Make sure that files can be written to `directory` before the work begins; raises as `replacing`."""
    try:
        directory.mkdir(parents=True, exist_ok=True)
        with TemporaryFile(dir=directory):
            pass
    except OSError as error:
        raise _write_error(f'cannot write to "{directory}": {error.strerror or error}', error) from None


def remove_files(directory: Path, *names: str) -> None:
    """Remove the files `names` of earlier work, and what a killed process has left of writing them; raises as `replacing`."""
    try:
        for name in names:
            for path in (directory / name, *directory.glob(f".{glob.escape(name)}.*{_PART_SUFFIX}")):
                path.unlink(missing_ok=True)
    except OSError as error:
        raise _write_error(f'cannot replace "{path}": {error.strerror or error}', error) from None


def write_json(data: Mapping[str, Any], path: str | Path) -> None:
    """Write `data` as JSON in its own order, two spaces deep; see `plain` for what becomes of its values."""
    text = json.dumps(to_json_types(data), indent=2, ensure_ascii=False, allow_nan=False)
    with writing_atomically(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8", newline="\n")


def to_json_types(value: Any) -> Any:
    """`value` in JSON's own types: NumPy numbers and arrays and paths converted, NaN and infinities (unknown to JSON) null."""
    match value:
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
