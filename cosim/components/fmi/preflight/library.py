"""What is wanted to know about a shared library, whatever its format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class InvalidLibrary(Exception):
    """The file is no library that could be loaded; says why."""


@dataclass(frozen=True, slots=True)
class SharedLibrary:
    """Exported functions, libraries it needs, and folders where it looks for them."""

    exports: frozenset[str]
    needed_libraries: Sequence[str] = ()
    search_folders: Sequence[str] = ()
