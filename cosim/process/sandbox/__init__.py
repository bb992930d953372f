"""Restrictions that a worker process imposes on itself before it loads foreign code.

    enter_sandbox(SandboxSettings(readable=(fmu_folder, *interpreter_folders()), writable=(temporary,), confine="required"))

Always in force:

- limits of memory, open files, file size and processor time; no core file
- a separate session (unless the process already leads a process group) that ends with the parent
- empty standard input
- no way to gain privileges

With `confine` (Landlock, Linux 5.13):

- files are read and programs executed only below `readable`
- files are written only below `writable`
- TCP is closed unless `network` is set (Linux 6.7)

Not prevented: Landlock does not block UDP, raw sockets and named Unix sockets, nor reading names, sizes and modes of files, nor
changing the modes of the user's files. `bubblewrap_command` (strict mode) hides all other files, all processes and the network. A
worker can exhaust its limits, leave children in other sessions, which the parent has to kill, and return wrong outputs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ...core.errors import InputError
from .. import limits
from . import landlock
from .bubblewrap import bubblewrap_command, find_bubblewrap
from .folders import interpreter_folders
from .status import ActiveRestrictions, AvailableSandboxes, find_available_sandboxes, probe_restrictions

__all__ = [
    "ActiveRestrictions",
    "AvailableSandboxes",
    "SandboxSettings",
    "bubblewrap_command",
    "enter_sandbox",
    "find_available_sandboxes",
    "find_bubblewrap",
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
        network: Permit TCP.
        confine: Confine access to the listed files: "never", if "available", or "required".
        parent: Process id of the parent, with which the worker ends; None for no check that it still exists.
    """

    memory: int = 2 * GIBIBYTE
    open_files: int = 256
    file_size: int = GIBIBYTE
    cpu_seconds: int | None = None
    readable: tuple[Path, ...] = ()
    writable: tuple[Path, ...] = ()
    network: bool = False
    confine: Literal["never", "available", "required"] = "available"
    parent: int | None = None


def enter_sandbox(settings: SandboxSettings) -> None:
    """Apply the restrictions to this process, irrevocably.

    Args:
        settings: The restrictions.

    Raises:
        InputError: The process is to be confined, but a listed path does not exist, the process has several threads, or the
            kernel does not support the required confinement. Nothing was changed.
    """
    confined = settings.confine == "required" or (settings.confine == "available" and landlock.abi_version() > 0)
    if confined and (reason := _unmet_requirement(settings)):
        raise InputError(f"the sandbox cannot be entered: {reason}")
    limits.detach(settings.parent)
    limits.set_limits(settings.memory, settings.open_files, settings.file_size, settings.cpu_seconds)
    if confined:
        landlock.confine(settings.readable, settings.writable, network=settings.network)


def _unmet_requirement(settings: SandboxSettings) -> str:
    """Return the reason why the process cannot be confined; "" if it can."""
    missing = [str(path) for path in (*settings.readable, *settings.writable) if not path.exists()]
    if missing:
        return f"{', '.join(missing)} does not exist"
    available = landlock.abi_version()
    if not available:
        return "Landlock is needed (Linux 5.13 or newer, enabled); this kernel has none"
    if settings.confine == "required" and not settings.network and available < landlock.NETWORK_ABI:
        return f"closing the network needs Landlock {landlock.NETWORK_ABI} (Linux 6.7); this kernel has {available}"
    if limits.thread_count() > 1:
        return "the process has more than one thread, and the others would not be confined"
    return ""
