"""Sandboxes that this machine supports, and restrictions in force for this process, found by trying them."""

from __future__ import annotations

import os
import resource
import socket
from dataclasses import dataclass

from .. import limits
from . import landlock, system_call_filter
from .bubblewrap import find_bubblewrap


@dataclass(frozen=True)
class AvailableSandboxes:
    """Supported sandboxes.

    Attributes:
        landlock: Version of Landlock (0: none).
        system_call_filter: The system call filter is supported.
        bubblewrap: Path of a working bubblewrap ("": none).
    """

    landlock: int
    system_call_filter: bool
    bubblewrap: str

    @property
    def confines_fmus(self) -> bool:
        """Support of the confinement of FMUs (`--sandbox`)."""
        return self.landlock > 0 and self.system_call_filter


@dataclass(frozen=True)
class ActiveRestrictions:
    """Restrictions in force for this process.

    Attributes:
        files_confined: Landlock confines access to files; False in bubblewrap, which hides files
            instead.
        network_closed: No socket can be opened.
        own_session: The process leads a session.
        no_new_privileges: The process cannot gain privileges.
        memory: Limit of the address space (bytes); None for no limit.
        open_files: Limit of open files; None for no limit.
        file_size: Limit of the size of a written file (bytes); None for no limit.
        cpu_seconds: Limit of the processor time (s); None for no limit.
    """

    files_confined: bool
    network_closed: bool
    own_session: bool
    no_new_privileges: bool
    memory: int | None
    open_files: int | None
    file_size: int | None
    cpu_seconds: int | None


def find_available_sandboxes() -> AvailableSandboxes:
    """Return the sandboxes that this machine supports."""
    return AvailableSandboxes(
        landlock.abi_version(), system_call_filter.is_available(), find_bubblewrap()
    )


def probe_restrictions() -> ActiveRestrictions:
    """Determine the restrictions in force by trying to open the root folder and a socket."""
    return ActiveRestrictions(
        files_confined=_is_root_unreadable(),
        network_closed=_is_socket_denied(),
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


def _is_socket_denied() -> bool:
    try:
        socket.socket().close()
    except PermissionError:
        return True
    return False


def _soft_limit(kind: int) -> int | None:
    soft, _ = resource.getrlimit(kind)
    return None if soft == resource.RLIM_INFINITY else soft
