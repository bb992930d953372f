"""FMU file on disk: checked, described, extracted and loaded once for all its instances."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property
from hashlib import file_digest
from pathlib import Path
from typing import Any

from ...core.errors import InputError
from ...process.journal import suspending_deadline
from ...process.temporary_folders import FMU_PREFIX, LockedFolder
from .description import FmuDescription, build_description
from .preflight import (
    DEFAULT_LIMITS,
    RUN_WARNINGS,
    Examination,
    Interface,
    PreflightLimits,
    examine,
    extract,
    open_regular_file,
    raise_errors,
)
from .preflight.fmu_platform import current_platform


@dataclass(frozen=True)
class _BorrowedFolder:
    """Folder of an extracted FMU that another process owns and removes."""

    name: str

    def cleanup(self) -> None:
        """Do nothing: the folder is not owned."""


class FmuFile:
    """FMU file with its extracted folder and its loaded library, shared by all instances.

    Each instance calls `acquire` before it uses the folder and `release` afterwards; the last `release` unloads the library and
    removes the folder. The FMU passes the preflight check before anything is extracted.
    """

    def __init__(self, path: Path, limits: PreflightLimits = DEFAULT_LIMITS, interface: Interface | None = None):
        """Prepare access to an FMU; the file is not opened yet.

        Args:
            path: The FMU.
            limits: Limits of the preflight check.
            interface: Interface of all instances; by default Co-Simulation if the FMU has it, else Model Exchange.
        """
        self.path, self.limits, self._interface = path, limits, interface
        self._folder: LockedFolder | _BorrowedFolder | None = None
        self._reference_count = 0
        #: FMPy's slave object with the loaded library, None while no instance has loaded it
        self.library: Any = None
        #: an instance returned fatal: no function of this FMU may be called any more (FMI 3.0 section 2.2.3)
        self.has_fatal_error = False

    @cached_property
    def examination(self) -> Examination:
        """Result of the preflight check."""
        return examine(self.path, self.limits)

    @cached_property
    def description(self) -> FmuDescription:
        """Model description; InputError if the preflight check found errors."""
        return build_description(self.path, self.examination, self._interface)

    @property
    def must_be_compiled(self) -> bool:
        """True for an FMU of FMI 2.0 or 3.0 that has sources but no binary for this platform."""
        description = self.description
        has_binary = current_platform().binary_folder(description.major) in description.platforms
        return not has_binary and "c-code" in description.platforms and description.major > 1

    @property
    def run_warning(self) -> str:
        """The first finding that may change the results of a run, and the number of the others; "" if there are none."""
        found = [finding for finding in self.examination.findings if finding.rule in RUN_WARNINGS]
        if not found:
            return ""
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        return f'"{self.path}": {found[0]}{more}; `cosim validate` lists all findings'

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file, in hexadecimal."""
        with open_regular_file(self.path) as file:
            return file_digest(file, "sha256").hexdigest()

    def check_binary(self) -> None:
        """Check that the FMU can be loaded on this platform.

        Raises:
            InputError: The FMU has errors, no binary for this platform, or one that cannot be loaded.
        """
        raise_errors(self.path, self.examination.findings)
        raise_errors(self.path, self.examination.binary_findings[self.description.interface])

    def acquire(self) -> Path:
        """Extract the FMU if necessary and return the folder, which exists until the matching `release`.

        Raises:
            InputError: The FMU does not pass the preflight check or cannot be extracted.
        """
        if self._folder is None:
            self.check_binary()
            folder = LockedFolder(FMU_PREFIX)
            try:
                with suspending_deadline():  # extracting a large archive must not count as time of the component
                    extract(self.path, self.examination, Path(folder.name), self.limits)
            except OSError as error:
                folder.cleanup()
                raise InputError(f'"{self.path}" cannot be extracted: {error.strerror or error}') from None
            except InputError:
                folder.cleanup()
                raise
            self._folder = folder
        self._reference_count += 1
        return Path(self._folder.name)

    def share(self) -> FmuFile:
        """Return a copy for a worker process: it uses the same extracted folder but loads the library itself."""
        assert self._folder is not None
        other = copy(self)
        other._folder, other._reference_count = _BorrowedFolder(self._folder.name), 0
        other.library, other.has_fatal_error = None, False
        return other

    def release(self) -> None:
        """Give up one use of the folder; the last one unloads the library and removes the folder."""
        self._reference_count -= 1
        if self._reference_count == 0 and self.library is not None and not self.has_fatal_error:
            self.library.freeLibrary()
            self.library = None
        if self._reference_count == 0 and self._folder is not None:
            self._folder.cleanup()
            self._folder = None
