"""Files of external C code.

Those that a model's external functions include, and the C files beside them.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from importlib import resources
from pathlib import Path

from ..model.flat_model import Function
from ..model.syntax_tree import raise_model_error
from .calls import declarations, definitions

_INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*"([^"]+)"', re.MULTILINE)
_URI = re.compile(r"modelica://(\w+)/?(.*)")
_DEFAULT_FOLDERS = (
    "Resources/Include",
    "Resources/C-Sources",
    "Resources/Source",
    "Resources/Library",
)
_RUNTIME = ("external.c", "external.h", "ModelicaUtilities.h")
#: first lines of each C file: the Standard Library has neither files nor user tables, and its time
#: is 0 (no random results)
_OPTIONS = (
    "#define NO_FILE_SYSTEM\n#define NO_TIME\n#define NO_PID\n#define DUMMY_FUNCTION_USERTAB\n"
    "#line 1\n"
)
#: C file of the Standard Library that another one needs without including its header
_COMPANIONS = {"ModelicaStandardTables": "ModelicaStandardTablesUsertab.c"}
#: folders of the C files of a library, beside the folder of its headers
_SOURCE_FOLDERS = (".", "../C-Sources", "../Source")
#: folders of the static libraries of a library, in its LibraryDirectory or beside the folder of its
#: headers
_LIBRARY_FOLDERS = ("linux64", ".", "../Library/linux64", "../Library")


def external_files(functions: Iterable[Function], packages: Mapping[str, Path]) -> dict[str, str]:
    """Return the C files of the external functions of a model.

    Args:
        functions: The external functions.
        packages: Top-level package -> its folder.

    Returns:
        File name -> text; empty without external functions.

    Raises:
        InputError: A file or a library is not found.
    """
    functions = sorted(functions, key=lambda f: f.name)
    if not functions:
        return {}
    folder = resources.files(__package__ or "")
    files = {name: folder.joinpath(name).read_text(encoding="utf-8") for name in _RUNTIME}
    for function in functions:
        _add_files(function, packages, files)
    return files | {
        "external_calls.h": declarations(functions),
        "external_calls.c": definitions(functions),
    }


def external_archives(
    functions: Iterable[Function], packages: Mapping[str, Path]
) -> dict[str, Path]:
    """Return the static libraries (file name -> file) of the Library annotations of external functions."""
    found: dict[str, Path] = {}
    for function in sorted(functions, key=lambda f: f.name):
        assert function.external
        names = [f"lib{library}.a" for library in function.external.libraries]
        folders = [
            folder / sub for folder in _folders(function, packages) for sub in _LIBRARY_FOLDERS
        ]
        found |= {
            n: path
            for n in names
            if (path := next((f / n for f in folders if (f / n).is_file()), None))
        }
    return found


def _add_files(function: Function, packages: Mapping[str, Path], files: dict[str, str]) -> None:
    assert function.external
    folders = _folders(function, packages)
    pending = _INCLUDE.findall(function.external.include)
    required = set(pending)
    pending += [
        f"{library}{suffix}" for library in function.external.libraries for suffix in (".h", ".c")
    ]
    while pending:
        name = pending.pop()
        if Path(name).name in files:
            continue
        path = next((folder / name for folder in folders if (folder / name).is_file()), None)
        if path is None:
            if name in required:
                places = ", ".join(map(str, folders)) or "no folder"
                raise_model_error(
                    (
                        f'{function.name}: the file "{name}" of its Include annotation is not '
                        f"found in {places}"
                    ),
                    function.where,
                )
            continue
        for source in (path, *_implementations(path)):
            text = source.read_text(encoding="utf-8", errors="replace")
            files[source.name] = f"{_OPTIONS}{text}" if source.suffix == ".c" else text
            pending += _INCLUDE.findall(files[source.name])
    _check_libraries(function, packages, files)


def _check_libraries(
    function: Function, packages: Mapping[str, Path], files: Mapping[str, str]
) -> None:
    """Raise InputError if a function without Include annotation has libraries, but neither C code nor a static library."""
    assert function.external
    libraries = function.external.libraries
    if (
        function.external.include
        or not libraries
        or any(f"{n}{s}" in files for n in libraries for s in (".c", ".h"))
    ):
        return
    if not external_archives([function], packages):
        names = ", ".join(f"{name}.c, lib{name}.a" for name in libraries)
        places = ", ".join(map(str, _folders(function, packages)))
        raise_model_error(
            f"{function.name}: no file of its Library annotation ({names}) is found in {places}",
            function.where,
        )


def _implementations(header: Path) -> list[Path]:
    """Return the C file of a header, if there is one, and its companion."""
    names = [
        f"{header.stem}.c",
        *([_COMPANIONS[header.stem]] if header.stem in _COMPANIONS else []),
    ]
    candidates = (header.parent / folder / name for name in names for folder in _SOURCE_FOLDERS)
    return [path for path in candidates if header.suffix == ".h" and path.is_file()]


def _folders(function: Function, packages: Mapping[str, Path]) -> Sequence[Path]:
    """Return the folders of the C files of an external function.

    Those of its annotations, else those of its file's package.
    """
    assert function.external
    own = function.where.path.parent if function.where else Path()
    given = [
        text
        for text in (function.external.include_directory, function.external.library_directory)
        if text
    ]
    for text in given:
        if (uri := _URI.match(text)) and uri[1] not in packages:
            raise_model_error(f'{function.name}: unknown package in "{text}"', function.where)
    annotated = [
        packages[uri[1]] / uri[2] if (uri := _URI.match(text)) else own / text for text in given
    ]
    defaults = (parent / name for parent in (own, *own.parents) for name in _DEFAULT_FOLDERS)
    return annotated or [own, *(folder for folder in defaults if folder.is_dir())]
