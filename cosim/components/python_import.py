"""Import of users' Python files, as members of their package where they have one."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from ..core.errors import PASS_THROUGH_EXCEPTIONS, InputError, Problem, did_you_mean
from ..core.paths import is_file, resolve_path


def load_object(reference: str, folder: Path) -> Any:
    """Import a Python file and return one of its attributes.

    Args:
        reference: File and name as "file.py:name".
        folder: Folder that a relative file path starts from.

    Raises:
        InputError: The reference is malformed, the file is missing or cannot be imported, or it does not define the name.
    """
    file, separator, name = reference.rpartition(":")
    if not separator or not file.endswith(".py") or not name.isidentifier():
        raise InputError(f'expected "file.py:name", found "{reference}"')
    path = resolve_path(folder / file)
    if not is_file(path):
        raise InputError(f'file "{file}" does not exist')
    module = _import_file(path)
    if not hasattr(module, name):
        public_names = [key for key in vars(module) if not key.startswith("_")]
        raise InputError(Problem(f'"{file}" defines no "{name}"{did_you_mean(name, public_names)}'))
    return getattr(module, name)


def package_root(path: Path) -> Path:
    """Return the folder that contains a file's outermost package, or the file's own folder if it is in no package."""
    root = path.parent
    while (root / "__init__.py").is_file():
        root = root.parent
    return root


def package_files(paths: Iterable[Path]) -> set[Path]:
    """Return Python files and all modules that they can import relatively: the modules of their outermost packages."""
    files = {path.resolve() for path in paths}
    packages = {root / path.relative_to(root).parts[0] for path in files if (root := package_root(path)) != path.parent}
    return files.union(*(package.rglob("*.py") for package in packages))


def _import_file(path: Path) -> ModuleType:
    """Import a file below a namespace package whose name is derived from the path of its root folder."""
    root = package_root(path)
    unique = f"_cosim_{sha256(str(root).encode()).hexdigest()[:12]}"
    if unique not in sys.modules:
        namespace = ModuleType(unique)
        namespace.__path__ = [str(root)]
        sys.modules[unique] = namespace
    name = ".".join((unique, *path.relative_to(root).with_suffix("").parts))
    try:
        return importlib.import_module(name)
    except PASS_THROUGH_EXCEPTIONS:
        raise
    except BaseException as error:
        raise InputError(f'"{path.name}" cannot be imported: {type(error).__name__}: {error}') from error
