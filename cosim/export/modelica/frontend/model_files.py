"""Files of a Modelica model: selection, text for the front end, and lines of its locations.

A class can only be used by its name. So a file of a package is needed if its package is needed, and
its name occurs in the code of a needed file. Names that occur for another reason add files, but no
file that the model needs is left out. The selection depends on the contents of the needed files
only: files beside them that are not used change nothing.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from ....core.errors import InputError, Problem
from ..model.syntax_tree import SourceLocation
from .class_search import find_class, find_operator
from .libraries import Library

_CLASS = r"^[^/\n]*\b(?:model|block|class|function|package|record|connector|type)\s+{}\b"


@dataclass(frozen=True)
class ModelicaSources:
    """Modelica files that the front end has read, and the lines of its spans.

    A span has the hash of a file's name and an offset (bytes).

    Attributes:
        files: Files of the model and of the packages beside it, the file of the model first.
        libraries: Libraries that the model uses.
        links: Folder with a link to each library, through which the front end reads them; None
            without libraries.
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
        """Return the declaration of a class in the file of the model, else its first line."""
        path = self.files[0]
        text = path.read_text(encoding="utf-8")
        declaration = re.search(
            _CLASS.format(re.escape(name.rpartition(".")[2])), text, re.MULTILINE
        )
        return SourceLocation(
            path, text.count("\n", 0, declaration.end()) + 1 if declaration else 1
        )

    def locate_library_class(self, names: Iterable[str]) -> SourceLocation | None:
        """Return the declaration of the first class of a package among full names."""
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
        for word in operators if packages else ():
            if place := find_operator(word, code, packages):
                return place
        return None

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


#: largest Modelica file (bytes)
MAX_SOURCE_SIZE = 1 << 24
_PACKAGE_FILE = "package.mo"
_WITHIN = re.compile(r"^\s*within\s+([\w.]+)\s*;", re.MULTILINE)


def read_source(path: Path) -> str:
    """Return the text of a Modelica file.

    Raises:
        InputError: There is no such file, it is too large, or it is not UTF-8 text.
    """
    if not path.is_file():
        raise InputError(Problem("no such Modelica file", str(path)))
    if (size := path.stat().st_size) > MAX_SOURCE_SIZE:
        raise InputError(
            Problem(f"the file has {size} bytes, expected at most {MAX_SOURCE_SIZE}", str(path))
        )
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(
            Problem(f"the file is not UTF-8 text: {error.reason} at byte {error.start}", str(path))
        ) from None


def model_name(path: Path, text: str, model: str | None) -> str:
    """Return the full name of a model; the default is the model with the name of the file.

    Args:
        path: The Modelica file.
        text: Its contents.
        model: The name of the model, or None.
    """
    within = _WITHIN.search(text)
    own = path.parent.name if path.name == _PACKAGE_FILE else path.stem
    return model or (f"{within[1]}.{own}" if within else own)


def _is_member(path: Path, text: str) -> bool:
    """Return whether a file belongs to a package that has further files."""
    is_package = path.name == _PACKAGE_FILE and any(
        file != path for file in path.parent.rglob("*.mo")
    )
    return is_package or _WITHIN.search(text) is not None


def readable_files(path: Path) -> list[Path]:
    """Return a Modelica file and the files of all packages that it may use."""
    path = path.resolve()
    return _with_package_files(path, find_packages(path, read_source(path)))


def needed_files(path: Path) -> list[Path]:
    """Return a Modelica file and the files of packages that its classes need.

    See `select_used_files`.
    """
    path = path.resolve()
    return select_used_files(path, find_packages(path, read_source(path)))


def _with_package_files(path: Path, packages: Sequence[Path]) -> list[Path]:
    files = [path]
    for package in packages:
        files += [file for file in sorted(package.rglob("*.mo")) if file != path]
    return files


def find_packages(path: Path, text: str) -> list[Path]:
    """Return the folders of the packages that a file with some text may use."""
    folder = path.parent
    if _is_member(path, text):
        while (folder / _PACKAGE_FILE).is_file():
            folder = folder.parent
    return sorted(child for child in folder.iterdir() if (child / _PACKAGE_FILE).is_file())


#: comments and strings without the resources that annotations name
_HIDDEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?!modelica://)(?:[^"\\]|\\.)*"', re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w*")


def select_used_files(path: Path, packages: Sequence[Path], declaration: str = "") -> list[Path]:
    """Return the file of a model, then the files of packages that it needs.

    They are sorted within each package.

    Args:
        path: The file of the model.
        packages: Folders of the top-level packages that it may use.
        declaration: Text of a further class that uses the model.
    """
    candidates = _with_package_files(path, packages)[1:]
    enclosing = {
        parent / _PACKAGE_FILE for parent in path.parents if (parent / _PACKAGE_FILE) in candidates
    }
    used = {path, *enclosing}
    names = set(_NAME.findall(declaration)).union(*map(_names, used))
    while new := [file for file in candidates if file not in used and _is_named(file, names, used)]:
        used.update(new)
        names.update(*map(_names, new))
    return [path, *(file for file in candidates if file in used)]


def _is_named(file: Path, names: set[str], used: set[Path]) -> bool:
    """Return whether the name of a file's class occurs among names, and its package is used."""
    is_package = file.name == _PACKAGE_FILE
    owner = (file.parents[1] if is_package else file.parent) / _PACKAGE_FILE
    return (file.parent.name if is_package else file.stem) in names and (
        owner in used or (is_package and not owner.is_file())
    )


def _names(file: Path) -> set[str]:
    """Return the names in the code of a file, without those in comments and strings."""
    return set(_NAME.findall(_HIDDEN.sub(" ", file.read_text(encoding="utf-8", errors="replace"))))


#: beginning of the message of an assertion that stands for terminate()
MARK = "terminate: "
_TERMINATE_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"|'
    r"\b(?P<section>algorithm|equation)\b|(?P<call>\bterminate\s*\()",
    re.DOTALL,
)


def replace_terminate(text: str) -> str:
    """Return a Modelica text with assertions instead of `terminate()` in its algorithms.

    The lines are unchanged.

    >>> replace_terminate('algorithm when b then terminate("late"); end when;')
    'algorithm when b then assert(false, "terminate: " + "late"); end when;'
    """
    section = ""

    def change(token: re.Match[str]) -> str:
        nonlocal section
        section = token["section"] or section
        return (
            f'assert(false, "{MARK}" + ' if token["call"] and section == "algorithm" else token[0]
        )

    return _TERMINATE_TOKEN.sub(change, text)
