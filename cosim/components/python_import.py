"""Import of users' Python files, as members of their package where they have one.

A file without a package can import the files beside it as a script does: relatively, and absolutely
(`import pid`). Python would find an absolutely imported module in `sys.path` and store it under one
name for all folders. Therefore absolute imports of modules in the folder are rewritten as relative
ones, and two folders can have modules of the same name.
"""

import ast
import importlib
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cache
from hashlib import sha256
from importlib.abc import MetaPathFinder
from importlib.machinery import FileFinder, ModuleSpec, SourceFileLoader
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

from ..core import resources
from ..core.errors import (
    PASS_THROUGH_EXCEPTIONS,
    InputError,
    Problem,
    describe_exception,
    did_you_mean,
    nearest_file,
)
from ..core.paths import is_file, resolve_path

#: beginning of the names of the namespace packages below which users' files are imported
_NAMESPACE_PREFIX = "_cosim_"


def load_object(reference: str, folder: Path) -> Any:
    """Import a Python file and return one of its attributes.

    Args:
        reference: File and name as "file.py:name".
        folder: Folder that a relative file path starts from.

    Raises:
        InputError: The reference is malformed, the file is missing or cannot be imported, or it
            does not define the name.
    """
    file, separator, name = reference.rpartition(":")
    if not separator or not file.endswith(".py") or not name.isidentifier():
        raise InputError(f'expected "file.py:name", found "{reference}"')
    path = resolve_path(folder / file)
    if not is_file(path):
        raise InputError(f'file "{file}" does not exist{nearest_file(path)}')
    module = _import_file(path)
    if not hasattr(module, name):
        public_names = [
            key
            for key, value in vars(module).items()
            if getattr(value, "__module__", None) == module.__name__
        ]
        raise InputError(Problem(f'"{file}" defines no "{name}"{did_you_mean(name, public_names)}'))
    return getattr(module, name)


def package_root(path: Path) -> Path:
    """Return the folder with a file's outermost package, or its own folder if it is in none."""
    root = path.parent
    while (root / "__init__.py").is_file():
        root = root.parent
    return root


def package_files(paths: Iterable[Path]) -> set[Path]:
    """Return Python files and the files that they can use.

    These are the imported files of their folder, or all modules and JSON files of their outermost
    package.
    """
    files = {path.resolve() for path in paths}
    used, packages = set(files), set()
    for path in files:
        root = package_root(path)
        if root != path.parent:
            packages.add(root / path.relative_to(root).parts[0])
            continue
        with suppress(OSError, ValueError, SyntaxError):  # its import reports them
            used.update(with_imported_siblings(path))
    return used.union(*map(_modules_and_data, packages))


def _modules_and_data(package: Path) -> list[Path]:
    """Return all Python and JSON files below a folder.

    One walk takes a third of the time of two `rglob`.
    """
    files: list[Path] = []
    for folder, _, names in os.walk(package):
        files += [Path(folder, name) for name in names if name.endswith((".py", ".json"))]
    return files


def import_shipped(module: str) -> ModuleType:
    """Import a module of a package that cosim ships.

    Args:
        module: Name with the package, as in an import statement.
    """
    return _import_file(resources.root().joinpath(*module.split(".")).with_suffix(".py"))


def _import_file(path: Path) -> ModuleType:
    """Import a file by its own name if cosim ships its package, else by a unique name.

    So users import the same classes of the shipped plant that runs use, while their copy of it
    elsewhere is another package.
    """
    root = package_root(path)
    parts = path.relative_to(root).with_suffix("").parts
    is_shipped = root == resources.root() and len(parts) > 1 and _is_importable(root / parts[0])
    name = ".".join(parts) if is_shipped else _unique_name(root, parts)
    try:
        return importlib.import_module(name)
    except PASS_THROUGH_EXCEPTIONS:
        raise
    except BaseException as error:
        raise InputError(
            f'"{path.name}" cannot be imported: {describe_exception(error)}'
        ) from error


@cache
def _is_importable(package: Path) -> bool:
    """Return whether the name of a package means this one; make it so if the name is free."""
    name = package.name
    if name not in sys.modules and find_spec(name) is None:
        spec = spec_from_file_location(name, package / "__init__.py")
        assert spec is not None
        assert spec.loader is not None
        sys.modules[name] = module = module_from_spec(spec)
        spec.loader.exec_module(module)
    return resolve_path(Path(importlib.import_module(name).__path__[0])) == package


def _unique_name(root: Path, parts: Sequence[str]) -> str:
    """Return the name of a module below the namespace package of its root folder."""
    unique = f"{_NAMESPACE_PREFIX}{sha256(str(root).encode()).hexdigest()[:12]}"
    if unique not in sys.modules:
        namespace = ModuleType(unique)
        namespace.__path__ = [str(root)]
        sys.modules[unique] = namespace
    if not any(isinstance(finder, _FolderFinder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _FolderFinder())
    return ".".join((unique, *parts))


class _FolderFinder(MetaPathFinder):
    """Finder of files for `_import_file`."""

    def find_spec(
        self, name: str, path: Sequence[str] | None, _target: object = None
    ) -> ModuleSpec | None:
        """Return the spec of a Python file; None for what Python's own finder finds."""
        if not name.startswith(_NAMESPACE_PREFIX) or not path:
            return None
        spec = FileFinder(path[0], (_PackageLoader, [".py"])).find_spec(name)
        if spec is None or spec.origin is None:
            return None
        is_in_package = (Path(path[0]) / "__init__.py").is_file()
        if not is_in_package and not spec.submodule_search_locations:
            spec.loader = _SiblingLoader(name, spec.origin)
        return spec


class _PackageLoader(SourceFileLoader):
    """Loader that uses compiled files only if they are newer than their source.

    Python compares whole seconds and sizes, and would run old code after a quick change.
    """

    def get_data(self, path: str) -> bytes:
        """Read a source or compiled file."""
        if (
            path != self.path
            and Path(path).stat().st_mtime_ns <= Path(self.path).stat().st_mtime_ns
        ):
            raise OSError(f"{path} is older than its source")
        return super().get_data(path)


class _SiblingLoader(SourceFileLoader):
    """Loader that makes imports of files beside the loaded one relative.

    It uses no compiled files, which do not have this.
    """

    def get_code(self, fullname: str) -> CodeType:
        """Compile the file."""
        namespace = sys.modules[fullname.partition(".")[0]]
        text = read_with_relative_imports(Path(self.path), Path(namespace.__path__[0]))
        code: CodeType = compile(text, self.path, "exec", dont_inherit=True)
        return code


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
        imported: set[Path] = set()
        for known in new:
            imported.update(file.resolve() for file in _imported_files(known, path.parent))
        new = sorted(imported - {file.resolve() for file in files})
        files += new
    return files


def read_with_relative_imports(path: Path, root: Path) -> str:
    """Return the text of a Python file with relative imports of the modules of the folder `root`.

    All statements keep their lines. Modules of the standard library, cosim and PythonFMU take
    precedence over files of the same name. A file in a package (a folder with `__init__.py`) is not
    changed.

    Raises:
        SyntaxError: The file cannot be parsed.
    """
    root, path = root.resolve(), path.resolve()
    text = path.read_text(encoding="utf-8") + "\n"
    lines = text.encode().splitlines(keepends=True)  # the columns of `ast` count bytes
    is_changed = path.is_relative_to(root) and not (path.parent / "__init__.py").is_file()
    dots = "." * len(path.relative_to(root).parts) if is_changed else ""
    nodes = []
    for node in ast.walk(ast.parse(text, str(path))):
        if dots and isinstance(node, ast.Import | ast.ImportFrom) and _imports_sibling(node, root):
            nodes.append(node)
    # from the end, so that the places of earlier statements stay as they are
    for node in sorted(nodes, key=lambda node: (node.lineno, node.col_offset), reverse=True):
        first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
        before, after = lines[first][: node.col_offset], lines[last][node.end_col_offset :]
        statements = _relative_statements(node, dots, root).encode()
        lines[first] = before + statements + b" \\\n" * (last - first) + after
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
    statements = []
    for alias in node.names:
        if _is_sibling(alias.name, root):
            statements.append(_relative_import(alias, dots))
        else:
            statements.append(ast.unparse(ast.Import([alias])))
    return "; ".join(statements)


def _relative_import(alias: ast.alias, dots: str) -> str:
    package, _, module = alias.name.rpartition(".")
    if alias.asname or not package:
        renamed = f" as {alias.asname}" if alias.asname else ""
        return f"from {dots}{package} import {module}{renamed}"
    top = package.partition(".")[0]
    return f"from {dots} import {top}; from {dots}{package} import {module} as _{module}"


def _imported_files(path: Path, root: Path) -> Iterator[Path]:
    for node in ast.walk(ast.parse(read_with_relative_imports(path, root), str(path))):
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = path.resolve().parents[node.level - 1]
            base = folder.joinpath(*(node.module or "").split("."))
            candidates = []
            for module in (base, *(base / alias.name for alias in node.names)):
                if module != folder:
                    candidates.append(module.with_suffix(".py"))
            # the packages below the folder that contain the module
            for package in (base, *base.parents):
                if package == folder:
                    break
                candidates.append(package / "__init__.py")
            yield from filter(Path.is_file, candidates)
