"""Relative imports of a Python file."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path


def with_relative_imports(path: Path) -> list[Path]:
    """Return a file and all files that it imports relatively, directly or indirectly.

    A file that is not a Python file has no imports.

    Raises:
        SyntaxError: A Python file cannot be parsed.
    """
    files, new = [path], [path] if path.suffix == ".py" else []
    while new:
        imported = {file.resolve() for known in new for file in _relative_imports(known)}
        new = sorted(imported - {file.resolve() for file in files})
        files += new
    return files


def _relative_imports(path: Path) -> Iterator[Path]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.resolve().parents[node.level - 1]
            base = folder.joinpath(*(node.module or "").split("."))
            submodules = (base / alias.name for alias in node.names)
            modules = (file for module in (base, *submodules) if (file := module.with_suffix(".py")).is_file())
            yield from modules
            yield from _package_files(folder, base)


def _package_files(folder: Path, base: Path) -> Iterator[Path]:
    """Yield the `__init__.py` of every package below `folder` that contains `base`."""
    for package in (base, *base.parents):
        if package == folder:
            return
        if (package / "__init__.py").is_file():
            yield package / "__init__.py"
