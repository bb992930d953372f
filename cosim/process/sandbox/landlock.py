"""Restriction of the file access of a process by Landlock, without root privileges (Linux).

The three system calls are made by number, which is the same on every architecture. The constants
are from linux/landlock.h.
"""

import ctypes
import os
import stat
import sys
from collections.abc import Iterable
from pathlib import Path

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
CREATE_RULESET_VERSION, RULE_PATH_BENEATH = 1, 1

EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1 << 0, 1 << 1, 1 << 2, 1 << 3
TRUNCATE, IOCTL_DEV = 1 << 14, 1 << 15
#: rights that apply to a file, the others apply to folders
FILE_ACCESS_RIGHTS = EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE | IOCTL_DEV
#: number of file system rights in each version
FILE_RIGHT_COUNTS = {1: 13, 2: 14, 3: 15, 4: 15, 5: 16}

_LIBC = ctypes.CDLL(None, use_errno=True)


class _Ruleset(ctypes.Structure):
    _fields_ = [("files", ctypes.c_uint64)]


class _PathBeneath(ctypes.Structure):
    _pack_ = 1
    _fields_ = [("allowed", ctypes.c_uint64), ("parent", ctypes.c_int32)]


def abi_version() -> int:
    """Return the Landlock version of this kernel; 0 if it has none."""
    if sys.platform != "linux":
        return 0
    version: int = _LIBC.syscall(
        CREATE_RULESET, None, ctypes.c_size_t(0), ctypes.c_uint32(CREATE_RULESET_VERSION)
    )
    return max(version, 0)


def confine(readable: Iterable[Path], writable: Iterable[Path]) -> None:
    """Confine this thread and its children to the listed files, irrevocably.

    Open files stay open. The process must have set no_new_privs (see `limits.detach`) or be
    privileged.

    Args:
        readable: Folders and files that may be read and executed.
        writable: Folders and files that may be read and written, not executed.

    Raises:
        OSError: The kernel refused, or a path does not exist.
    """
    rights = (1 << FILE_RIGHT_COUNTS[min(abi_version(), max(FILE_RIGHT_COUNTS))]) - 1
    attributes = _Ruleset(rights)
    size = ctypes.c_size_t(ctypes.sizeof(attributes))
    ruleset = _system_call(CREATE_RULESET, ctypes.byref(attributes), size, ctypes.c_uint32(0))
    try:
        for path in readable:
            _add_path_rule(ruleset, path, rights & (EXECUTE | READ_FILE | READ_DIR))
        for path in writable:
            _add_path_rule(ruleset, path, rights & ~EXECUTE)
        _add_path_rule(ruleset, Path(os.devnull), rights & (READ_FILE | WRITE_FILE))
        _system_call(RESTRICT_SELF, ctypes.c_int(ruleset), ctypes.c_uint32(0))
    finally:
        os.close(ruleset)


def _add_path_rule(ruleset: int, path: Path, rights: int) -> None:
    descriptor = os.open(path, os.O_PATH | os.O_CLOEXEC)
    try:
        if not stat.S_ISDIR(os.fstat(descriptor).st_mode):
            rights &= FILE_ACCESS_RIGHTS
        rule = _PathBeneath(rights, descriptor)
        _system_call(
            ADD_RULE,
            ctypes.c_int(ruleset),
            ctypes.c_int(RULE_PATH_BENEATH),
            ctypes.byref(rule),
            ctypes.c_uint32(0),
        )
    finally:
        os.close(descriptor)


def _system_call(number: int, *arguments: object) -> int:
    returned: int = _LIBC.syscall(number, *arguments)
    if returned < 0:
        error = ctypes.get_errno()
        raise OSError(error, f"Landlock: {os.strerror(error)}")
    return returned
