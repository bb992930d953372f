"""What is wanted to know about a shared library, whatever its format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class Damaged(Exception):
    """The file is no library that could be loaded; says why."""


@dataclass(frozen=True, slots=True)
class Library:
    """Exported functions, libraries it needs, and folders where it looks for them."""

    exports: frozenset[str]
    needed: Sequence[str] = ()
    search: Sequence[str] = ()
