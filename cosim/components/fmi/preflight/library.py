"""Result of reading a shared library, common to ELF, PE and Mach-O."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

#: text that each function for the version and the platform of FMI must return
EXPECTED_TEXTS = {
    "fmi2GetVersion": b"2.0",
    "fmi2GetTypesPlatform": b"default",
    "fmi3GetVersion": b"3.0",
}


class InvalidLibraryError(Exception):
    """Reason why a file is not a shared library that the loader of a platform accepts."""


@dataclass(frozen=True, slots=True)
class SharedLibrary:
    """Dynamic linking information of a shared library.

    Attributes:
        exports: Names of the exported functions.
        constant_texts: Texts that exported functions return, for those whose code only returns a
            constant text.
        needed_libraries: Names of the libraries that it depends on.
        search_folders: Folders in which the loader searches for them.
    """

    exports: frozenset[str]
    needed_libraries: Sequence[str] = ()
    search_folders: Sequence[str] = ()
    constant_texts: Mapping[str, bytes] = field(default_factory=dict)
