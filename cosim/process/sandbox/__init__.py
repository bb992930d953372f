"""What a worker process does to itself before it loads foreign code.

    enter(Settings(readable=(fmu_folder, *interpreter_folders()), writable=(temporary,), confine="required"))

Always: limits of memory, files and processor time; no core file; a session of its own (unless it leads a group already); the
end of the parent is its own end; standard input is empty; no privileges can be gained. With `confine`: files are read, and
programs started, only below `readable`; files are written only below `writable`; TCP needs `network` (Landlock, Linux 5.13, its
TCP rules 6.7).

What remains: Landlock blocks neither UDP, raw sockets and Unix sockets that have a path, nor looking at names, sizes and modes
of files, nor changing the modes of one's own. `command` (bubblewrap, strict mode) shows no other files and processes and no
network at all. A worker can use up its limits, leave children behind in sessions of their own, which the parent has to end, and
lie in its outputs.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from ...core.errors import InputError
from . import landlock, limits
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
    """Limits of a worker process.

    `memory`: bytes of address space beyond what is mapped already; `file_size`: bytes of one written file; `cpu_seconds`:
    processor time of the process. `readable` and `writable`: folders or files that exist; what is writable is readable.
    `confine`: whether file and network access is confined to what is listed: "never", where it is "available", or "required".
    `parent`: process id without which the worker must not go on.
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
    """Put this process under the settings; nothing of it can be undone.

    To be called where the process has one thread only. Raises InputError, before anything is changed, when confinement is
    required and this kernel has none, or none for the network, or when a listed folder does not exist.
    """
    confined = settings.confine == "required" or (settings.confine == "available" and landlock.abi_version() > 0)
    if confined and (reason := _unmet_requirement(settings)):
        raise InputError(f"the sandbox cannot be entered: {reason}")
    limits.detach(settings.parent)
    limits.set_limits(settings.memory, settings.open_files, settings.file_size, settings.cpu_seconds)
    if confined:
        landlock.confine(settings.readable, settings.writable, network=settings.network)


def _unmet_requirement(settings: SandboxSettings) -> str:
    """Why the settings cannot be met; empty when they can."""
    missing = [str(path) for path in (*settings.readable, *settings.writable) if not path.exists()]
    if missing:
        return f"{', '.join(missing)} does not exist"
    found = landlock.abi_version()
    if not found:
        return "Landlock is needed (Linux 5.13 or newer, enabled); this kernel has none"
    if settings.confine == "required" and not settings.network and found < landlock.NETWORK_ABI:
        return f"to close the network needs Landlock {landlock.NETWORK_ABI} (Linux 6.7); this kernel has {found}"
    if limits.thread_count() > 1:
        return "the process has more than one thread, and the others would stay free"
    return ""
