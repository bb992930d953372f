"""Restrictions that a worker process imposes on itself before it loads foreign code.

    readable = (fmu_folder, *interpreter_folders())
    enter_sandbox(SandboxSettings(readable, writable=(temporary,), confine="required"))

Always in force:

- limits of memory, open files, file size and processor time; no core file
- a separate session (unless the process already leads a process group) that ends with the parent
- empty standard input
- no way to gain privileges

With `confine` (Landlock, Linux 5.13, and a system call filter):

- files are read only below `readable`
- files are written only below `writable`
- no network, no sockets, no new processes and programs, no signals to other processes
- owners, modes, times and attributes of files, shared objects, keys, priorities and mounts stay as
  they are
- all environment variables but a few are removed

Not prevented: names, sizes and modes of files can be read. A worker can exhaust its limits and
return wrong outputs. `bubblewrap_command` (strict mode) hides all other files and processes from a
whole command.
"""

import os
import resource
import socket
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from ...core.errors import InputError
from .. import limits
from . import landlock, system_call_filter
from .bubblewrap import bubblewrap_command, find_bubblewrap
from .child_environment import KEPT_VARIABLES, clear_environment, interpreter_folders

__all__ = [
    "KEPT_VARIABLES",
    "ActiveRestrictions",
    "AvailableSandboxes",
    "SandboxSettings",
    "bubblewrap_command",
    "clear_environment",
    "enter_sandbox",
    "find_available_sandboxes",
    "interpreter_folders",
    "probe_restrictions",
]

GIBIBYTE = 1 << 30


@dataclass(frozen=True)
class SandboxSettings:
    """Restrictions of a worker process.

    Attributes:
        memory: Address space in addition to the present one (bytes).
        open_files: Number of open files.
        file_size: Size of a written file (bytes).
        cpu_seconds: Processor time of the process (s); None for no limit.
        readable: Existing folders and files that may be read.
        writable: Existing folders and files that may be read and written.
        confine: Confine the process to the listed files and to itself.
        parent: Process id of the parent, with which the worker ends; None for no check that it
            still exists.
    """

    memory: int = 2 * GIBIBYTE
    open_files: int = 256
    file_size: int = GIBIBYTE
    cpu_seconds: int | None = None
    readable: tuple[Path, ...] = ()
    writable: tuple[Path, ...] = ()
    confine: bool = True
    parent: int | None = None


def enter_sandbox(settings: SandboxSettings) -> None:
    """Apply the restrictions to this process, irrevocably.

    Args:
        settings: The restrictions.

    Raises:
        InputError: The process is to be confined, but a listed path does not exist, the process has
            several threads, or this system does not support the confinement. Nothing was changed.
    """
    if settings.confine and (reason := _unmet_requirement(settings)):
        raise InputError(f"the sandbox cannot be entered: {reason}")
    limits.detach(settings.parent)
    limits.lower_limit(resource.RLIMIT_AS, limits.mapped_size() + settings.memory)
    limits.lower_limit(resource.RLIMIT_NOFILE, settings.open_files)
    limits.lower_limit(resource.RLIMIT_FSIZE, settings.file_size)
    limits.lower_limit(resource.RLIMIT_CORE, 0)
    limits.lower_limit(resource.RLIMIT_CPU, settings.cpu_seconds)
    # The order matters. The kernel demands that a process that confines itself gives up privileges
    # first. The environment is cleared before Landlock hides /proc, and the system call filter is
    # last, because it denies the calls by which session and limits are set.
    if settings.confine:
        clear_environment()
        landlock.confine(settings.readable, settings.writable)
        system_call_filter.enter_filter()


def _unmet_requirement(settings: SandboxSettings) -> str:
    """Return the reason why the process cannot be confined; "" if it can."""
    missing = [str(path) for path in (*settings.readable, *settings.writable) if not path.exists()]
    if missing:
        return f"{', '.join(missing)} does not exist"
    if not landlock.abi_version():
        return "Landlock is needed (Linux 5.13 or newer, enabled); this kernel has none"
    if not system_call_filter.is_available():
        return (
            "a system call filter is needed (Linux with seccomp, on x86_64 or aarch64); this "
            "system has none"
        )
    if limits.thread_count() > 1:
        return "the process has more than one thread, and the others would not be confined"
    return ""


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
        # Landlock forbids to open the root folder, which everyone else may read
        files_confined=_is_denied(lambda: os.close(os.open("/", os.O_RDONLY | os.O_DIRECTORY))),
        network_closed=_is_denied(lambda: socket.socket().close()),
        own_session=os.getsid(0) == os.getpid(),
        no_new_privileges=limits.no_new_privileges(),
        memory=_soft_limit(resource.RLIMIT_AS),
        open_files=_soft_limit(resource.RLIMIT_NOFILE),
        file_size=_soft_limit(resource.RLIMIT_FSIZE),
        cpu_seconds=_soft_limit(resource.RLIMIT_CPU),
    )


def _is_denied(attempt: Callable[[], object]) -> bool:
    try:
        attempt()
    except PermissionError:
        return True
    return False


def _soft_limit(kind: int) -> int | None:
    soft, _ = resource.getrlimit(kind)
    return None if soft == resource.RLIM_INFINITY else soft
