"""Safe access to paths given by users, which may be pipes, devices or link loops."""

import errno
import os
import stat
from pathlib import Path
from shutil import copyfileobj
from typing import BinaryIO, TextIO

#: largest number of symbolic links that are followed, as on Linux
_MAX_LINKS = 40
_REFUSED_KINDS = ((stat.S_ISSOCK, "Is a socket"), (stat.S_ISBLK, "Is a block device"))


def is_file(path: Path) -> bool:
    """Return whether the file exists.

    False for names that no file can have, for which `Path.is_file` raises.
    """
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: Path) -> bool:
    """Return whether the folder exists.

    False for names that no folder can have, for which `Path.is_dir` raises.
    """
    return os.path.isdir(path)  # noqa: PTH112


def resolve_path(path: Path) -> Path:
    """Return the path with symbolic links resolved.

    A loop of links is left unresolved instead of raising.
    """
    return Path(os.path.realpath(path))


def open_text(path: Path, encoding: str, newline: str | None = None) -> TextIO:
    """Open a regular file to read its text.

    Args:
        path: The file.
        encoding: As in `open`.
        newline: As in `open`.

    Raises:
        OSError: The file cannot be opened, or is a pipe or a device, from which reading might never
            end.
    """
    number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    mode = os.fstat(number).st_mode
    if not stat.S_ISREG(mode) and not stat.S_ISDIR(mode):
        os.close(number)
        raise OSError(errno.EINVAL, "Not a regular file", str(path))
    return os.fdopen(number, encoding=encoding, newline=newline)


def file_to_replace(path: Path) -> Path | None:
    """Return the file that a new version of an output replaces, with symbolic links followed.

    Args:
        path: The output as the user named it. It need not exist.

    Returns:
        A regular file, or a path that does not exist. None: the output is written to directly,
        because it is a FIFO, a character device, or a descriptor of this process (/dev/stdout).

    Raises:
        OSError: The output is a folder, a socket, a disk or a loop of links.
    """
    try:
        mode = path.stat().st_mode
    except FileNotFoundError:  # also a link whose target does not exist
        return resolve_path(path) if path.is_symlink() else path
    for is_kind, kind in _REFUSED_KINDS:
        if is_kind(mode):
            text = f"{kind}; expected a file, a FIFO or a character device"
            raise OSError(errno.EINVAL, text, str(path))
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode) or _own_descriptor(path) is not None:
        return None
    return resolve_path(path) if path.is_symlink() else path


def write_directly(content: BinaryIO, path: Path) -> None:
    """Copy a stream to a FIFO, a character device or a descriptor of this process.

    Raises:
        OSError: It cannot be written, or no process reads the FIFO.
    """
    descriptor = _own_descriptor(path)
    # a duplicate shares the position in the file, unlike another `open`
    number = _open_without_waiting(path) if descriptor is None else os.dup(descriptor)
    with os.fdopen(number, "wb") as target:
        copyfileobj(content, target)


def duplicate_descriptor(path: Path) -> Path:
    """Return a name for a duplicate of the descriptor that `path` names, such as /dev/stdout.

    The duplicate stays when this process or a forked one redirects its standard streams. A path
    that names no descriptor is returned unchanged.
    """
    descriptor = _own_descriptor(path)
    return path if descriptor is None else Path(f"/dev/fd/{os.dup(descriptor)}")


def _open_without_waiting(path: Path) -> int:
    """Open a FIFO or a device to write; opening a FIFO would wait for a reader, maybe for ever."""
    flags = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)
    try:
        number = os.open(path, os.O_WRONLY | flags)
    except OSError as error:
        if error.errno == errno.ENXIO and path.is_fifo():
            raise OSError(errno.ENXIO, "No process reads this FIFO", str(path)) from None
        raise
    os.set_blocking(number, True)
    return number


def _own_descriptor(path: Path) -> int | None:
    """Return the number in a name such as /dev/stdout or /dev/fd/1; None for other paths."""
    own_descriptors = os.path.realpath("/proc/self/fd")
    for _ in range(_MAX_LINKS):
        if os.path.realpath(path.parent) == own_descriptors and path.name.isdecimal():
            return int(path.name)
        if not path.is_symlink():
            return None
        path = path.parent / path.readlink()
    return None
