"""FMUs in the user's cache, each with its digest, so that a damaged file is built again."""

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

from ..core.resources import cache_directory
from ..process.output_lock import LOCK_FILE, waiting_for_lock
from ..results.files import remove_files, write_file


def cached_file(key: str, name: str, build: Callable[[Path], object]) -> Path:
    """Return a file of the cache, which is built if it does not exist.

    Args:
        key: Text that is different for different contents, usable as the name of a folder.
        name: Name of the file.
        build: Writes the file to a path; another process that needs the same file waits.

    Raises:
        InputError: The file cannot be built, or the cache cannot be written.
        OutputError: The disk is full or defective.
    """
    target = cache_directory() / "fmus" / key / name
    if not _is_intact(target):
        with waiting_for_lock(target.parent / LOCK_FILE):
            if not _is_intact(target):
                remove_files(target.parent, target.name)
                build(target)
                write_file(_digest_file(target), file_hash(target))
    return target


def _is_intact(file: Path) -> bool:
    """Return whether a cached file exists and has the digest with which it was written."""
    try:
        return file.is_file() and file_hash(file).encode() == _digest_file(file).read_bytes()
    except OSError:
        return False


def _digest_file(file: Path) -> Path:
    return file.with_suffix(".sha256")


def file_hash(path: Path) -> str:
    """Return the SHA-256 digest of a file as hexadecimal text."""
    return sha256(path.read_bytes()).hexdigest()
