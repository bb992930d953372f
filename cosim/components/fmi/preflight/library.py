"""Result of reading a shared library, common to ELF, PE and Mach-O."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class InvalidLibraryError(Exception):
    """Reason why a file is not a shared library that the loader of a platform accepts."""


@dataclass(frozen=True, slots=True)
class SharedLibrary:
    """Dynamic linking information of a shared library.

    Attributes:
        exports: Names of the exported functions.
        needed_libraries: Names of the libraries that it depends on.
        search_folders: Folders in which the loader searches for them.
    """

    exports: frozenset[str]
    needed_libraries: Sequence[str] = ()
    search_folders: Sequence[str] = ()
