"""What this machine offers and what holds for this process, each tried out and not assumed."""

from __future__ import annotations

import errno
import os
import resource
import socket
from dataclasses import dataclass

from . import landlock, limits
from .bubblewrap import find_bubblewrap

#: the discard port: nobody listens, so that a connection which is permitted is refused at once
_DISCARD_ADDRESS = ("127.0.0.1", 9)


@dataclass(frozen=True)
class AvailableSandboxes:
    """What sandboxes can be built from here: Landlock version (0: none) and path of a working bubblewrap (empty: none)."""

    landlock: int
    bubblewrap: str


@dataclass(frozen=True)
class ActiveRestrictions:
    """What holds for this process. Limits are None where there is none; memory and file size in bytes, time in s.

    `files_confined`: by Landlock; bubblewrap shows other files instead.
    """

    files_confined: bool
    tcp_closed: bool
    own_session: bool
    no_new_privileges: bool
    memory: int | None
    open_files: int | None
    file_size: int | None
    cpu_seconds: int | None


def find_available_sandboxes() -> AvailableSandboxes:
    return AvailableSandboxes(landlock.abi_version(), find_bubblewrap())


def probe_restrictions() -> ActiveRestrictions:
    """Look and try: lists the root folder and knocks at a port of this machine."""
    return ActiveRestrictions(
        files_confined=_is_root_unreadable(),
        tcp_closed=_is_tcp_denied(),
        own_session=os.getsid(0) == os.getpid(),
        no_new_privileges=limits.no_new_privileges(),
        memory=_soft_limit(resource.RLIMIT_AS),
        open_files=_soft_limit(resource.RLIMIT_NOFILE),
        file_size=_soft_limit(resource.RLIMIT_FSIZE),
        cpu_seconds=_soft_limit(resource.RLIMIT_CPU),
    )


def _is_root_unreadable() -> bool:
    """Anyone may list the root folder unless Landlock forbids it."""
    try:
        os.close(os.open("/", os.O_RDONLY | os.O_DIRECTORY))
    except PermissionError:
        return True
    return False


def _is_tcp_denied() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as knocking:
        knocking.settimeout(0.5)
        return knocking.connect_ex(_DISCARD_ADDRESS) in (errno.EACCES, errno.EPERM, errno.ENETUNREACH)


def _soft_limit(kind: int) -> int | None:
    soft, _ = resource.getrlimit(kind)
    return None if soft == resource.RLIM_INFINITY else soft
