"""Settings of the worker process of an isolated FMU."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

from ....process.journal import Deadlines


@dataclass(frozen=True)
class Isolation:
    """Settings of a worker process.

    Attributes:
        deadlines: Largest wall times of calls into the FMU (s).
        sandbox: Restrict the worker process: it reads only its own files and libraries, writes only
            to its temporary folder, and has no network and no other processes.
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
            A function that enters the sandbox. It raises InputError if this system does not support
            the required restrictions.
        """
        from ....process.sandbox import SandboxSettings, enter_sandbox, interpreter_folders

        readable = (fmu, *interpreter_folders()) if self.sandbox else ()
        settings = SandboxSettings(
            readable=readable, writable=(temporary,), confine=self.sandbox, parent=importer
        )
        return partial(enter_sandbox, settings)
