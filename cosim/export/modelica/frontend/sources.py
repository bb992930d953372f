"""Files of a Modelica model, and the conversion of the front end's locations to lines of these files."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ..model.syntax_tree import SourceLocation
from .libraries import Library
from .library_search import find_class, find_operator

_CLASS = r"^[^/\n]*\b(?:model|block|class|function|package|record|connector|type)\s+{}\b"


@dataclass(frozen=True)
class ModelicaSources:
    """The Modelica files that the front end has read, and the conversion of its spans (file hash, byte offset) to lines.

    Attributes:
        files: Files of the model and of the packages beside it, the file of the model first.
        libraries: Libraries that the model uses.
        links: Folder with a link to each library, through which the front end reads them; None without libraries.
        text: Text of the model's file as the front end reads it; None if it reads the file itself.
        used: Those of the files that the model needs, the file of the model first.
    """

    files: Sequence[Path]
    libraries: Sequence[Library] = ()
    links: Path | None = None
    text: str | None = None
    used: Sequence[Path] = ()

    @cached_property
    def _by_hash(self) -> Mapping[int, Path]:
        """Files by rumoca's hash of their names."""
        names = {display_name(file): file for file in self.files[:1]} | {
            str(file): file for file in self.files
        }
        for library in self.libraries:
            link = str(self.links and self.links / library.link_name)
            names |= {
                link + str(file).removeprefix(str(library.path)): file for file in library.files
            }
        return {_fnv1a(name): file for name, file in names.items()}

    @property
    def packages(self) -> dict[str, Path]:
        """Folders of the top-level packages by their names."""
        tops = (
            file.parent
            for file in self.files
            if file.name == "package.mo" and not (file.parent.parent / "package.mo").is_file()
        )
        return {folder.name: folder for folder in tops} | {
            library.name: library.package_file.parent for library in self.libraries
        }

    def find(self, name: str) -> Path | None:
        """Return the file with the name that the front end uses in messages, or None."""
        return self._by_hash.get(_fnv1a(name))

    def locate_class(self, name: str) -> SourceLocation:
        """Return the line with the declaration of a class in the file of the model, or the first line of this file."""
        path = self.files[0]
        text = path.read_text(encoding="utf-8")
        declaration = re.search(
            _CLASS.format(re.escape(name.rpartition(".")[2])), text, re.MULTILINE
        )
        return SourceLocation(
            path, text.count("\n", 0, declaration.end()) + 1 if declaration else 1
        )

    def locate_library_class(self, names: Iterable[str]) -> SourceLocation | None:
        """Return the declaration of the first class of a library, or of a package beside the model, among full names."""
        for name in names:
            folder = self.packages.get(name.partition(".")[0])
            if folder and "." in name and (place := find_class(folder, name.split(".")[1:])):
                return place[0]
        return None

    def locate_in_libraries(self, operators: Iterable[str]) -> SourceLocation | None:
        """Return the first place of an operator in the classes of libraries that the model uses."""
        packages = {
            library.name: library.path for library in self.libraries if library.path.is_dir()
        }
        code = self.files[0].read_text(encoding="utf-8")
        return next(
            (
                place
                for word in operators
                if packages and (place := find_operator(word, code, packages))
            ),
            None,
        )

    def locate(self, span: Mapping[str, int] | None) -> SourceLocation | None:
        """Return the line at which a span starts, or None for a span that is not in these files."""
        path = self._by_hash.get(span["source"]) if span else None
        if span is None or path is None:
            return None
        content = (
            path.read_bytes() if self.text is None or path != self.files[0] else self.text.encode()
        )
        return SourceLocation(path, content.count(b"\n", 0, span["start"]) + 1)


def display_name(path: Path) -> str:
    """Return the name under which the text of a file is loaded."""
    return f"<{path.name}>"


def _fnv1a(text: str) -> int:
    """Return the 64-bit FNV-1a hash, by which rumoca identifies source files."""
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value
