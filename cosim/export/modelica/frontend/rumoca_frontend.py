"""Invocation of the front end rumoca, which flattens a model and returns it as JSON.

Names are looked up in the file itself, in every package folder (a folder with `package.mo`) beside
it, and in libraries (`libraries.py`). Other files beside it are never read. A file that belongs to
a package (`within P;`) is loaded as a member of this package.
"""

import gzip
import json
import re
import shutil
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from pathlib import Path
from secrets import token_hex
from typing import Any

from ....core.errors import CosimError, InputError, Problem, did_you_mean, write_error
from ....core.resources import cache_directory
from ....results.files import writing_atomically
from .libraries import Library, find_libraries, library_folders
from .model_files import (
    ModelicaSources,
    _is_member,
    _with_package_files,
    display_name,
    find_packages,
    model_name,
    read_source,
    replace_terminate,
    select_used_files,
)
from .rumoca_client import run_rumoca
from .rumoca_messages import to_problems, to_syntax_problem

RUMOCA_VERSION = "0.10.2"

#: name of a model with values of parameters; it extends the model of the file
MODIFIED_MODEL = "CosimModifiedModel"
_REFERENCE = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")


@dataclass(frozen=True)
class ModelicaOptions:
    """Options of the compilation of a Modelica model.

    Attributes:
        library_path: Folders that are searched for libraries before those of MODELICAPATH.
        values: Values of parameters by name, as JSON values or texts of Modelica expressions; also
            of structural parameters.
        supplement: Modelica text of further declarations and equations of the model.
    """

    library_path: Sequence[Path] = ()
    values: Mapping[str, Any] = field(default_factory=dict)
    supplement: str = ""


DEFAULT_OPTIONS = ModelicaOptions()


def flatten_model(
    path: Path, model: str | None, options: ModelicaOptions = DEFAULT_OPTIONS
) -> tuple[dict[str, Any], ModelicaSources]:
    """Flatten a Modelica model with rumoca.

    Args:
        path: The Modelica file.
        model: Name of the model. None selects the model with the name of the file.
        options: Libraries and values of parameters.

    Returns:
        The flat model as rumoca's JSON, and its sources.

    Raises:
        InputError: The front end reports errors, for example syntax errors and unknown names, or a
            library is not found.
    """
    path = path.resolve()
    text = read_source(path)
    available, name = find_packages(path, text), model_name(path, text, model)
    declaration = modified_model(name, options.values, options.supplement)
    used = select_used_files(path, available, declaration)
    libraries = find_libraries(
        used, library_folders(options.library_path), [package.name for package in available]
    )
    of_libraries = set[str]().union(*(library.uses for library in libraries))
    packages = []
    for folder in available:
        if folder.name in of_libraries or any(f.is_relative_to(folder) for f in used):
            packages.append(folder)
    files = _with_package_files(path, packages)
    links = link_libraries(libraries) if libraries else None
    sources = ModelicaSources(
        files, libraries, links, None if _is_member(path, text) else replace_terminate(text), used
    )
    if not libraries:
        flat = json.loads(_flatten(sources, packages, name, declaration))
    else:
        contents = [(str(file), sha256(file.read_bytes()).hexdigest()) for file in files]
        key = [
            RUMOCA_VERSION,
            name,
            declaration,
            contents,
            [(str(library.path), library.digest) for library in libraries],
        ]
        document = read_document(key)
        if document is None:
            document = _flatten(sources, packages, name, declaration)
            store_document(key, document)
        flat = json.loads(document)
    _check_names(flat, options.values, name)
    return flat, sources


def _check_names(flat: Mapping[str, Any], values: Mapping[str, Any], model: str) -> None:
    """Raise InputError if the model has no such parameters.

    The front end ignores modifiers without a component.
    """
    known = [
        name
        for name, variable in flat["variables"].items()
        if "Parameter" in variable["variability"]
    ]
    problems = []
    for name in values:
        if name not in known and not any(each.startswith(f"{name}.") for each in known):
            text = f'the model {model} has no parameter "{name}"{did_you_mean(name, known)}'
            problems.append(Problem(text))
    if problems:
        raise InputError(problems)


def modified_model(name: str, values: Mapping[str, Any], supplement: str = "") -> str:
    """Return the declaration of MODIFIED_MODEL, "" without values and supplement.

    Raises:
        InputError: A name is not that of a component, or a value cannot be one of a parameter.
    """
    problems = [
        Problem("expected the name of a parameter", each)
        for each in values
        if not _REFERENCE.fullmatch(each)
    ]
    if problems:
        raise InputError(problems)
    modifiers = ", ".join(_modifier(*each) for each in values.items())
    base = f"{name}({modifiers})" if modifiers else name
    return (
        f"model {MODIFIED_MODEL} extends {base}; {supplement} end {MODIFIED_MODEL};"
        if modifiers or supplement
        else ""
    )


def _modifier(name: str, value: Any) -> str:
    """Return a modifier: `a(b = 1)` for the parameter b of the component a."""
    first, dot, rest = name.partition(".")
    return f"{first}({_modifier(rest, value)})" if dot else f"{first} = {_expression(name, value)}"


def _expression(name: str, value: Any) -> str:
    """Return the Modelica expression of a JSON value.

    A text that is a name in Modelica stands for itself.
    """
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list) and value:
        return "{" + ", ".join(_expression(name, each) for each in value) + "}"
    if isinstance(value, str):
        return (
            value
            if _REFERENCE.fullmatch(value) and "." in value
            else json.dumps(value, ensure_ascii=False)
        )
    raise InputError(
        Problem(f"found {value!r}, expected a number, true, false, a text or a list", name)
    )


def _flatten(
    sources: ModelicaSources, packages: Sequence[Path], name: str, declaration: str
) -> str:
    """Return the flat model as JSON text."""
    path, roots = sources.files[0], [*packages, *([sources.links] if sources.links else [])]
    text = None if sources.text is None else (display_name(path), sources.text)
    flattened = MODIFIED_MODEL if declaration else name
    answer = run_rumoca(RUMOCA_VERSION, sources.files, roots, flattened, text, declaration)
    if "version" in answer:
        raise InputError(_version_problem(answer["version"]))
    if "syntax_errors" in answer:
        raise InputError(to_syntax_problem(*error) for error in answer["syntax_errors"])
    if "out_of_bounds" in answer:
        found = dict.fromkeys(
            (reason, sources.locate(span) or path) for reason, span in answer["out_of_bounds"]
        )
        raise InputError(Problem(reason, str(place)) for reason, place in found)
    if "error" in answer:
        raise InputError(to_problems(answer, name, path, sources))
    flat: str = answer["flat"]
    return flat


def _version_problem(found: str | None) -> str:
    if found is None:
        return 'Modelica needs the compiler front end rumoca: pip install "fmi-cosim[build]"'
    return (
        f"found rumoca {found}, but only {RUMOCA_VERSION} is supported: pip install "
        f"rumoca=={RUMOCA_VERSION}"
    )


def read_document(key: Sequence[Any]) -> str | None:
    """Return the flat model with a key as JSON text, None if the cache lacks it or is damaged."""
    with suppress(OSError, EOFError, ValueError):
        return gzip.decompress(_document_file(key).read_bytes()).decode()
    return None


def store_document(key: Sequence[Any], document: str) -> None:
    """Store a flat model under a key, if the cache can be written."""
    with suppress(CosimError), writing_atomically(_document_file(key)) as temporary:
        temporary.write_bytes(gzip.compress(document.encode(), compresslevel=1, mtime=0))


def link_libraries(libraries: Sequence[Library]) -> Path:
    """Return a folder that contains a link to each library under its plain name and nothing else.

    The folder depends on names and places of the libraries only, so that names of files in messages
    of the front end are the same in each call.

    Raises:
        InputError: The cache cannot be written.
        OutputError: The disk is full or defective.
    """
    links = {library.link_name: str(library.path) for library in libraries}
    folder = _folder() / f"libraries-{_digest(links)}"
    if folder.is_dir():
        return folder
    temporary = folder.with_name(f"{folder.name}.{token_hex(8)}")
    try:
        temporary.mkdir(parents=True)
        for name, target in links.items():
            (temporary / name).symlink_to(target)
        with suppress(OSError):  # another process has created it
            temporary.rename(folder)
    except OSError as error:
        raise write_error(f"cannot write {temporary}: {error}", error) from error
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return folder


def _folder() -> Path:
    return cache_directory() / "modelica"


def _document_file(key: Sequence[Any]) -> Path:
    return _folder() / f"{_digest(key)}.json.gz"


def _digest(value: Any) -> str:
    return sha256(json.dumps(value).encode()).hexdigest()[:24]
