"""Selection of the Modelica files that a model needs, by the names that occur in their code.

A class can only be used by its name. So a file of a package is needed if its package is needed, and
its name occurs in the code of a needed file. Names that occur for another reason add files, but no
file that the model needs is left out. The selection depends on the contents of the needed files
only: files beside them that are not used change nothing.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

_PACKAGE_FILE = "package.mo"
#: comments and strings without the resources that annotations name
_HIDDEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?!modelica://)(?:[^"\\]|\\.)*"', re.DOTALL)
_NAME = re.compile(r"[A-Za-z_]\w*")


def select_used_files(path: Path, packages: Sequence[Path], declaration: str = "") -> list[Path]:
    """Return the file of a model, then the files of packages that it needs, sorted within each package.

    Args:
        path: The file of the model.
        packages: Folders of the top-level packages that it may use.
        declaration: Text of a further class that uses the model.
    """
    candidates = [
        file for package in packages for file in sorted(package.rglob("*.mo")) if file != path
    ]
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
