"""FMU file on disk: checked, described, extracted and loaded once for all its instances."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable
from contextlib import suppress
from copy import copy
from dataclasses import dataclass
from functools import cached_property
from hashlib import file_digest
from pathlib import Path
from typing import Any, NamedTuple

from ...core.errors import InputError, join_alternatives
from ...process.journal import current_journal, suspending_deadline
from ...process.temporary_folders import FMU_PREFIX, LockedFolder
from .description import FmuDescription, build_description
from .preflight import Examination, examine, extract
from .preflight.archive import Archive, open_regular_file
from .preflight.binary import WINDOWS, list_platforms
from .preflight.findings import RUN_WARNINGS, raise_errors
from .preflight.model_description import Interface
from .preflight.platforms import current_platform

#: largest number of FMU contents, and of extracted folders on the disk
_MAX_CONTENTS, _MAX_FOLDERS = 256, 32

#: paths with type, size, inode and times of the files in a folder
Listing = list[tuple[str, int, int, int, int, int]]


class FileKey(NamedTuple):
    """FMU file with this content."""

    path: Path
    sha256: str


class ExtractedFolder(NamedTuple):
    """Folder of an extracted FMU, and its files as they were extracted."""

    folder: LockedFolder
    listing: Listing


#: description and findings of the preflight check, by the content of the file; the last used one is
#: the last one
_known_contents: dict[Any, Any] = {}
#: folders that no run uses; a run has a folder of its own, because a library that is loaded twice
#: shares its static variables
_idle_folders: dict[FileKey, ExtractedFolder] = {}


def take_folder(key: FileKey) -> ExtractedFolder | None:
    """Return the folder of an FMU from an earlier run.

    None if there is none, or if its files have changed.
    """
    extracted = _idle_folders.pop(key, None)
    if extracted is None:
        return None
    with suppress(OSError):  # another program has removed the folder
        if list_files(extracted.folder.name) == extracted.listing:
            return extracted
    extracted.folder.cleanup()
    return None


def keep_folder(key: FileKey, extracted: ExtractedFolder, library: str) -> None:
    """Keep the folder for the next run.

    It is removed if the operating system has kept the FMU's library with its static variables.
    """
    # no other run follows in a supervised process, which ends without finalizers
    if current_journal():
        extracted.folder.cleanup()
        return
    with suppress(OSError):
        ctypes.CDLL(library, mode=os.RTLD_NOLOAD | os.RTLD_NOW)
        extracted.folder.cleanup()
        return
    if key in _idle_folders:
        _idle_folders.pop(key).folder.cleanup()
    _idle_folders[key] = extracted
    if len(_idle_folders) > _MAX_FOLDERS:
        oldest = next(iter(_idle_folders))
        _idle_folders.pop(oldest).folder.cleanup()


def list_files(folder: str) -> Listing:
    """Return the files below a folder, with all that changes when one of them is written."""
    listing: Listing = []
    folders = [folder]
    while folders:
        with os.scandir(folders.pop()) as entries:
            for entry in entries:
                status = entry.stat(follow_symlinks=False)
                times = status.st_mtime_ns, status.st_ctime_ns
                listing.append((entry.path, status.st_mode, status.st_size, status.st_ino, *times))
                if entry.is_dir(follow_symlinks=False):
                    folders.append(entry.path)
    return sorted(listing)


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_idle_folders.clear)  # they belong to the parent


@dataclass(frozen=True)
class _BorrowedFolder:
    """Folder of an extracted FMU that another process owns and removes."""

    name: str

    def cleanup(self) -> None:
        """Do nothing: the folder is not owned."""


class FmuFile:
    """FMU file with its extracted folder and its loaded library, shared by all instances.

    Each instance calls `acquire` before it uses the folder and `release` afterwards. The last
    `release` unloads the library, and keeps the folder for the next run in this process. The FMU
    passes the preflight check before anything is extracted. Neither is repeated in a process while
    the content of the file is the same.
    """

    def __init__(self, path: Path, interface: Interface | None = None):
        """Prepare access to an FMU; the file is not opened yet.

        Args:
            path: The FMU.
            interface: Interface of all instances; by default Co-Simulation if the FMU has it, else
                Model Exchange.
        """
        self.path, self._interface = path, interface
        self._folder: LockedFolder | _BorrowedFolder | None = None
        self._extracted: ExtractedFolder | None = None
        self._reference_count = 0
        #: FMPy's slave object with the loaded library, None while no instance has loaded it
        self.library: Any = None
        #: an instance returned fatal: no function of this FMU may be called any more (FMI 3.0
        #: section 2.2.3)
        self.has_fatal_error = False

    @cached_property
    def examination(self) -> Examination:
        """Result of the preflight check."""
        examination: Examination = self._remember("examination", lambda: examine(self.path))
        return examination

    @cached_property
    def description(self) -> FmuDescription:
        """Model description; InputError if the preflight check found errors."""
        description: FmuDescription = self._remember(
            f"description {self._interface}", self._build_description
        )
        return description

    def _remember(self, part: str, read: Callable[[], Any]) -> Any:
        """Return what is read from the file; read it only if its content is new."""
        if not self._key:
            return read()
        key = (part, self._key)
        known = _known_contents.pop(key, None)
        if known is None:
            known = read()
            if self._find_key() != self._key:  # the file has changed meanwhile
                return known
        _known_contents[key] = known
        if len(_known_contents) > _MAX_CONTENTS:
            del _known_contents[next(iter(_known_contents))]
        return known

    @cached_property
    def _key(self) -> FileKey | None:
        return self._find_key()

    def _find_key(self) -> FileKey | None:
        """Return the path with the hash of the present content; None if the file cannot be read."""
        try:
            with open_regular_file(self.path) as file:
                return FileKey(self.path, file_digest(file, "sha256").hexdigest())
        except (OSError, InputError):
            return None

    def _build_description(self) -> FmuDescription:
        raise_errors(self.path, self.examination.findings)
        model = self.examination.model
        assert model is not None  # otherwise the examination has found an error
        preferred, selected = next(iter(model.interfaces)), self._interface
        interface = preferred if selected is None else selected
        if interface not in model.interfaces:
            raise InputError(
                f'"{self.path}": has no interface for {interface}, only for '
                f"{join_alternatives(model.interfaces)}"
            )
        return build_description(model, interface, list_platforms(self.examination.members))

    @property
    def has_binary(self) -> bool:
        """True for an FMU with a binary for this platform."""
        return (
            current_platform().binary_folder(self.description.major) in self.description.platforms
        )

    @property
    def has_windows_binary(self) -> bool:
        """True for an FMU with a DLL for 64-bit Windows."""
        return WINDOWS.binary_folder(self.description.major) in self.description.platforms

    @property
    def must_be_compiled(self) -> bool:
        """True for an FMU that has sources but no binary for this platform."""
        return not self.has_binary and "c-code" in self.description.platforms

    @property
    def run_warning(self) -> str:
        """The first finding that may change the results of a run, and the number of the others.

        "" if there are none.
        """
        found = [finding for finding in self.examination.findings if finding.rule in RUN_WARNINGS]
        if not found:
            return ""
        more = f", and {len(found) - 1} more" if len(found) > 1 else ""
        return f'"{self.path}": {found[0]}{more}; `cosim validate` lists all findings'

    @cached_property
    def sha256(self) -> str:
        """SHA-256 of the file, in hexadecimal."""
        if self._key:
            return self._key.sha256
        with open_regular_file(self.path) as file:
            return file_digest(file, "sha256").hexdigest()

    def read_members(self) -> dict[str, bytes]:
        """Return the contents of all files in the archive by name."""
        with open_regular_file(self.path) as content:
            archive = Archive(content)
            names = [name for name in archive.members if not name.endswith("/")]
            return {name: archive.read(name) for name in names}

    def check_binary(self) -> None:
        """Check that the FMU can be loaded on this platform.

        Raises:
            InputError: The FMU has errors, no binary for this platform, or one that cannot be
                loaded.
        """
        raise_errors(self.path, self.examination.findings)
        raise_errors(self.path, self.examination.binary_findings[self.description.interface])

    def acquire(self) -> Path:
        """Extract the FMU if necessary and return the folder.

        The folder exists until the matching `release`.

        Raises:
            InputError: The FMU does not pass the preflight check or cannot be extracted.
        """
        if self._folder is None:
            self.check_binary()
            with (
                suspending_deadline()
            ):  # extracting a large archive must not count as time of the component
                self._extracted = (take_folder(self._key) if self._key else None) or self._extract()
            self._folder = self._extracted.folder
        self._reference_count += 1
        return Path(self._folder.name)

    def _extract(self) -> ExtractedFolder:
        folder = LockedFolder(FMU_PREFIX)
        try:
            extract(self.path, self.examination, Path(folder.name))
            return ExtractedFolder(folder, list_files(folder.name))
        except OSError as error:
            folder.cleanup()
            raise InputError(
                f'"{self.path}" cannot be extracted: {error.strerror or error}'
            ) from None
        except InputError:
            folder.cleanup()
            raise

    def share(self) -> FmuFile:
        """Return a copy for a worker process.

        It uses the same extracted folder but loads the library itself.
        """
        assert self._folder is not None
        other = copy(self)
        other._folder = _BorrowedFolder(self._folder.name)
        other._extracted = None
        other._reference_count = 0
        other.library, other.has_fatal_error = None, False
        return other

    def release(self) -> None:
        """Give up one use of the folder.

        The last one unloads the library and keeps the folder for the next run.
        """
        self._reference_count -= 1
        library = None
        if self._reference_count == 0 and self.library is not None and not self.has_fatal_error:
            library = self.library.dll._name
            self.library.freeLibrary()
            self.library = None
        if self._reference_count == 0 and self._folder is not None:
            if library and self._extracted and self._key and self._find_key() == self._key:
                keep_folder(self._key, self._extracted, library)
            else:
                self._folder.cleanup()
            self._folder = self._extracted = None


def open_fmu(
    path: Path, interface: Interface | None, add_binary: Callable[[FmuFile], Path | None]
) -> FmuFile:
    """Open an FMU; without a binary for this machine, open a copy that has one.

    Args:
        path: The FMU.
        interface: Interface of its instances; None: the preferred one of the FMU.
        add_binary: Writes a copy of an FMU with a binary for this machine, and returns its path;
            None if it has neither sources nor a library for Windows.

    Raises:
        InputError: The FMU cannot be read, or the copy cannot be made.
    """
    file = FmuFile(path, interface)
    copied = None if file.has_binary else add_binary(file)
    return FmuFile(copied, interface) if copied else file
