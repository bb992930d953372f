"""Settings of the worker process of an isolated FMU."""

from __future__ import annotations

import ctypes
import sys
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from ....process.journal import Deadlines

_CLONE_NEWUSER, _CLONE_NEWNET = 0x10000000, 0x40000000


@dataclass(frozen=True)
class Isolation:
    """Settings of a worker process.

    Attributes:
        deadlines: Largest wall times of calls into the FMU (s).
        sandbox: Restrict the worker process: it reads only its own files and libraries, writes only to its temporary folder and
            has no network. Where user namespaces are not permitted, only TCP is blocked.
    """

    deadlines: Deadlines = field(default_factory=Deadlines)
    sandbox: bool = False

    def worker_setup(self, fmu: Path, temporary: Path, importer: int) -> Callable[[], None]:
        """Create the function that a worker process calls before it loads foreign code.

        Args:
            fmu: Folder of the extracted FMU.
            temporary: Folder for temporary files of the FMU.
            importer: Process id of the importer; the worker process ends with it.

        Returns:
            A function that enters the sandbox. It raises InputError if this system does not support the required restrictions.
        """
        from ....process.sandbox import SandboxSettings, enter_sandbox, interpreter_folders, landlock

        readable = (fmu, *interpreter_folders()) if self.sandbox else ()
        confine: Literal["required", "never"] = "required" if self.sandbox else "never"
        settings = SandboxSettings(readable=readable, writable=(temporary,), confine=confine, parent=importer)

        def enter() -> None:
            has_no_network = self.sandbox and _unshare_network()
            # without any network, older kernels that lack Landlock's network rules are sufficient
            enter_sandbox(replace(settings, network=has_no_network and landlock.abi_version() < landlock.NETWORK_ABI))

        return enter


def _unshare_network() -> bool:
    """Move this process into a network namespace without devices; return False if that is not permitted."""
    return sys.platform == "linux" and bool(ctypes.CDLL(None).unshare(_CLONE_NEWUSER | _CLONE_NEWNET) == 0)
