"""How an FMU is kept apart."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

from ....process.journal import Deadlines

_CLONE_NEWUSER, _CLONE_NEWNET = 0x10000000, 0x40000000


@dataclass(frozen=True)
class Isolation:
    """How long calls into the FMU may take; with `sandbox` it reads only its own files and libraries, writes only to its
    temporary folder, and has no network (where user namespaces are forbidden: no TCP)."""

    deadlines: Deadlines = field(default_factory=Deadlines)
    sandbox: bool = False

    def worker_setup(self, fmu: Path, temporary: Path, importer: int) -> Callable[[], None]:
        """What a worker of the process `importer` does before it loads foreign code; raises InputError where it cannot."""
        from ....process.sandbox import SandboxSettings, enter_sandbox, interpreter_folders, landlock

        readable = (fmu, *interpreter_folders()) if self.sandbox else ()
        confine = "required" if self.sandbox else "never"
        settings = SandboxSettings(readable=readable, writable=(temporary,), confine=confine, parent=importer)  # type: ignore[arg-type]

        def entrance() -> None:
            left = self.sandbox and _unshare_network()
            # no kernel is refused for rules about a network that is not there
            enter_sandbox(replace(settings, network=left and landlock.abi_version() < landlock.NETWORK_ABI))

        return entrance


def _unshare_network() -> bool:
    """From now on this process has a network of its own, without any device; where that is forbidden, nothing changes."""
    return sys.platform == "linux" and ctypes.CDLL(None).unshare(_CLONE_NEWUSER | _CLONE_NEWNET) == 0
