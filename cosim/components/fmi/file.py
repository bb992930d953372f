"""An FMU file: examined and described once, extracted once, however many instances it has."""

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
from .preflight import DEFAULT_LIMITS, Examination, PreflightLimits, examine, extract, open_regular_file, raise_errors


@dataclass(frozen=True)
class _BorrowedFolder:
    """An extracted FMU that somebody else removes."""

    name: str

    def cleanup(self) -> None:
        pass


class FmuFile:
    """One FMU on disk. Instances `acquire` the extracted folder and `release` it; the last one unloads and removes it.

    Nothing of the FMU is extracted before it was examined and found to be good; `limits` bound what that may cost.
    """

    def __init__(self, path: Path, limits: PreflightLimits = DEFAULT_LIMITS):
        self.path, self.limits = path, limits
        self._folder: LockedFolder | _BorrowedFolder | None = None
        self._reference_count = 0
        #: FMPy's object with the loaded library, which all instances share
        self.library: Any = None
        #: an instance reported a fatal error: nothing of this FMU may be called any more
        self.has_fatal_error = False

    @cached_property
    def examination(self) -> Examination:
        return examine(self.path, self.limits)

    @cached_property
    def description(self) -> FmuDescription:
        return build_description(self.path, self.examination)

    @cached_property
    def sha256(self) -> str:
        with open_regular_file(self.path) as file:
            return file_digest(file, "sha256").hexdigest()

    def check_binary(self) -> None:
        """Raises InputError when the FMU has no binary for this machine, or one that cannot be loaded."""
        raise_errors(self.path, [*self.examination.findings, *self.examination.binary_findings])

    def acquire(self) -> Path:
        """The folder with the extracted FMU, until it is released. Raises InputError when it cannot be extracted."""
        if self._folder is None:
            self.check_binary()
            folder = LockedFolder(FMU_PREFIX)
            try:
                with suspending_deadline():  # a large archive takes its time, which is no fault of the component
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
        """The same extracted FMU for another process, which loads the library itself."""
        assert self._folder is not None
        other = copy(self)
        other._folder, other._reference_count, other.library, other.has_fatal_error = (
            _BorrowedFolder(self._folder.name),
            0,
            None,
            False,
        )
        return other

    def release(self) -> None:
        self._reference_count -= 1
        if self._reference_count == 0 and self.library is not None and not self.has_fatal_error:
            self.library.freeLibrary()
            self.library = None
        if self._reference_count == 0 and self._folder is not None:
            self._folder.cleanup()
            self._folder = None
