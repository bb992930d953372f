"""Sandboxes that this machine supports, and restrictions in force for this process, found by trying them."""

from __future__ import annotations

import errno
import os
import resource
import socket
from dataclasses import dataclass

from .. import limits
from . import landlock
from .bubblewrap import find_bubblewrap

#: port 9 (discard), which is normally closed: a permitted connection is refused at once
_DISCARD_ADDRESS = ("127.0.0.1", 9)


@dataclass(frozen=True)
class AvailableSandboxes:
    """Supported sandboxes: Landlock version (0: none) and path of a working bubblewrap ("": none)."""

    landlock: int
    bubblewrap: str


@dataclass(frozen=True)
class ActiveRestrictions:
    """Restrictions in force for this process.

    Attributes:
        files_confined: Landlock confines access to files; False in bubblewrap, which hides files instead.
        tcp_closed: TCP connections are not permitted.
        own_session: The process leads a session.
        no_new_privileges: The process cannot gain privileges.
        memory: Limit of the address space (bytes); None for no limit.
        open_files: Limit of open files; None for no limit.
        file_size: Limit of the size of a written file (bytes); None for no limit.
        cpu_seconds: Limit of the processor time (s); None for no limit.
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
    """Return the sandboxes that this machine supports."""
    return AvailableSandboxes(landlock.abi_version(), find_bubblewrap())


def probe_restrictions() -> ActiveRestrictions:
    """Determine the restrictions in force by trying to open the root folder and to connect to a port of this machine."""
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
    """Return whether Landlock forbids to open the root folder, which every user may read otherwise."""
    try:
        os.close(os.open("/", os.O_RDONLY | os.O_DIRECTORY))
    except PermissionError:
        return True
    return False


def _is_tcp_denied() -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as connection:
        connection.settimeout(0.5)
        return connection.connect_ex(_DISCARD_ADDRESS) in (errno.EACCES, errno.EPERM, errno.ENETUNREACH)


def _soft_limit(kind: int) -> int | None:
    soft, _ = resource.getrlimit(kind)
    return None if soft == resource.RLIM_INFINITY else soft
