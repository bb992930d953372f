"""Imports of a Python file from its own folder.

Relative ones, and absolute ones as in a script (`import pid`).

Python would find an absolutely imported module in `sys.path` and store it under one name for all
folders. Therefore absolute imports of modules in the folder are rewritten as relative ones, and two
folders can have modules of the same name.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

#: modules that are never those of a folder
_OTHER_MODULES = {*sys.stdlib_module_names, "cosim", "pythonfmu"}


def with_imported_siblings(path: Path) -> list[Path]:
    """Return a file and all files of its folder that it imports, directly or indirectly.

    Relative imports may also lead out of the folder. A file that is not a Python file has no
    imports.

    Raises:
        SyntaxError: A Python file cannot be parsed.
    """
    files, new = [path], [path] if path.suffix == ".py" else []
    while new:
        imported = {file.resolve() for known in new for file in _imported_files(known, path.parent)}
        new = sorted(imported - {file.resolve() for file in files})
        files += new
    return files


def read_with_relative_imports(path: Path, root: Path) -> str:
    """Return the text of a Python file in which absolute imports of modules of the folder `root` are relative.

    All statements keep their lines. Modules of the standard library, cosim and PythonFMU take precedence over files of the same
    name. A file in a package (a folder with `__init__.py`) is not changed.

    Raises:
        SyntaxError: The file cannot be parsed.
    """
    root, path = root.resolve(), path.resolve()
    text = path.read_text(encoding="utf-8") + "\n"
    lines = text.encode().splitlines(keepends=True)  # the columns of `ast` count bytes
    is_changed = path.is_relative_to(root) and not (path.parent / "__init__.py").is_file()
    dots = "." * len(path.relative_to(root).parts) if is_changed else ""
    nodes = [
        node
        for node in ast.walk(ast.parse(text, str(path)))
        if isinstance(node, ast.Import | ast.ImportFrom)
    ]
    for node in (
        sorted(nodes, key=lambda node: (node.lineno, node.col_offset), reverse=True) if dots else ()
    ):
        if _imports_sibling(node, root):
            first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
            before, after = lines[first][: node.col_offset], lines[last][node.end_col_offset :]
            lines[first] = (
                before
                + _relative_statements(node, dots, root).encode()
                + b" \\\n" * (last - first)
                + after
            )
            del lines[first + 1 : last + 1]
    return b"".join(lines).decode()[:-1]


def _imports_sibling(node: ast.Import | ast.ImportFrom, root: Path) -> bool:
    if isinstance(node, ast.ImportFrom):
        return node.level == 0 and _is_sibling(node.module or "", root)
    return any(_is_sibling(alias.name, root) for alias in node.names)


def _is_sibling(module: str, root: Path) -> bool:
    """Return whether an absolute module name means a file or a package in `root`."""
    top = root / module.partition(".")[0]
    if top.name in _OTHER_MODULES:
        return False
    candidates = (
        top.with_suffix(".py"),
        top / "__init__.py",
        root.joinpath(*module.split(".")).with_suffix(".py"),
    )
    return any(file.is_file() for file in candidates)


def _relative_statements(node: ast.Import | ast.ImportFrom, dots: str, root: Path) -> str:
    if isinstance(node, ast.ImportFrom):
        return ast.unparse(ast.ImportFrom(f"{dots}{node.module}", node.names, 0))
    return "; ".join(
        _relative_import(alias, dots) if _is_sibling(alias.name, root) else _import(alias)
        for alias in node.names
    )


def _import(alias: ast.alias) -> str:
    return ast.unparse(ast.Import([alias]))


def _relative_import(alias: ast.alias, dots: str) -> str:
    package, _, module = alias.name.rpartition(".")
    if alias.asname or not package:
        return f"from {dots}{package} import {module}" + (
            f" as {alias.asname}" if alias.asname else ""
        )
    top = package.partition(".")[0]
    return f"from {dots} import {top}; from {dots}{package} import {module} as _{module}"


def _imported_files(path: Path, root: Path) -> Iterator[Path]:
    for node in ast.walk(ast.parse(read_with_relative_imports(path, root), str(path))):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.resolve().parents[node.level - 1]
            base = folder.joinpath(*(node.module or "").split("."))
            submodules = (base / alias.name for alias in node.names)
            named = (module for module in (base, *submodules) if module != folder)
            modules = (file for module in named if (file := module.with_suffix(".py")).is_file())
            yield from modules
            yield from _package_files(folder, base)


def _package_files(folder: Path, base: Path) -> Iterator[Path]:
    """Yield the `__init__.py` of every package below `folder` that contains `base`."""
    for package in (base, *base.parents):
        if package == folder:
            return
        if (package / "__init__.py").is_file():
            yield package / "__init__.py"
