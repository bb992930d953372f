"""Invocation of the front end rumoca, which flattens a model and returns it as JSON.

Names are looked up in the file itself, in every package folder (a folder with `package.mo`) beside it, and in libraries
(`libraries.py`). Other files beside it are never read. A file that belongs to a package (`within P;`) is loaded as a member of
this package.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from ....core.errors import InputError, Problem, did_you_mean
from ..model.syntax_tree import SourceLocation
from .flat_cache import link_libraries, read_document, store_document
from .libraries import Library, find_libraries, library_folders
from .rumoca_client import run_rumoca

RUMOCA_VERSION = "0.10.2"
#: largest Modelica file (bytes)
MAX_SOURCE_SIZE = 1 << 24

#: name of a model with values of parameters; it extends the model of the file
MODIFIED_MODEL = "CosimModifiedModel"

_REFERENCE = re.compile(r"[A-Za-z_]\w*(\.[A-Za-z_]\w*)*")
_WITHIN = re.compile(r"^\s*within\s+([\w.]+)\s*;", re.MULTILINE)
_QUOTED = re.compile(r"['`]([\w.]+(?: = [\w.]+)?)['`]")
_CLASS = r"^[^/\n]*\b(?:model|block|class|function|package|record|connector|type)\s+{}\b"
#: beginnings of messages that name a part of the front end
_PHASE = re.compile(
    r"^(?:parse error: |\w+ failed: \S+ failed in \w+: (?:unsupported Flat semantic owner `[^`]*`: |"
    r"unsupported runtime operator `[^`]+`: |canonical DAE construction rejected an invalid operation: )?)"
)
#: operators that a message may name without quotes
_OPERATOR = re.compile(
    r"\b(sample|hold|previous|subSample|superSample|shiftSample|backSample|noClock|interval|firstTick|Clock|"
    r"der|pre|edge|change|delay|return|reinit|terminate)\b"
)
_COUNTS = re.compile(r"; unknowns\[.*$")
_NOT_FOUND = " could not be compiled because resolve/parse failed"
_LOCATION_SUFFIX = re.compile(r"\[(?P<file>[^\[\]]+):(?P<line>\d+):\d+\]$")
_PANIC = re.compile(
    r'detail: "(?P<what>[^"]+)", span: Span \{ source: SourceId\((?P<source>\d+)\), start: BytePos\((?P<start>\d+)\)'
)
_SYNTAX_ERROR = re.compile(r"×\s*(?P<what>.+?)\n.*?\[[^\]]*:(?P<line>\d+):\d+\]", re.DOTALL)


@dataclass(frozen=True)
class ModelicaSources:
    """The Modelica files that the front end has read, and the conversion of its spans (file hash, byte offset) to lines.

    Attributes:
        files: Files of the model and of the packages beside it, the file of the model first.
        libraries: Libraries that the model uses.
        links: Folder with a link to each library, through which the front end reads them; None without libraries.
    """

    files: Sequence[Path]
    libraries: Sequence[Library] = ()
    links: Path | None = None

    @cached_property
    def _by_hash(self) -> Mapping[int, Path]:
        """Files by rumoca's hash of their names."""
        names = {_display_name(file): file for file in self.files[:1]} | {str(file): file for file in self.files}
        for library in self.libraries:
            link = str(self.links and self.links / library.link_name)
            names |= {link + str(file).removeprefix(str(library.path)): file for file in library.files}
        return {_fnv1a(name): file for name, file in names.items()}

    @property
    def packages(self) -> dict[str, Path]:
        """Folders of the top-level packages by their names."""
        tops = (
            file.parent for file in self.files if file.name == "package.mo" and not (file.parent.parent / "package.mo").is_file()
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
        declaration = re.search(_CLASS.format(re.escape(name.rpartition(".")[2])), text, re.MULTILINE)
        return SourceLocation(path, text.count("\n", 0, declaration.end()) + 1 if declaration else 1)

    def locate(self, span: Mapping[str, int] | None) -> SourceLocation | None:
        """Return the line at which a span starts, or None for a span that is not in these files."""
        path = self._by_hash.get(span["source"]) if span else None
        if span is None or path is None:
            return None
        return SourceLocation(path, path.read_bytes().count(b"\n", 0, span["start"]) + 1)


@dataclass(frozen=True)
class ModelicaOptions:
    """Options of the compilation of a Modelica model.

    Attributes:
        library_path: Folders that are searched for libraries before those of MODELICAPATH.
        values: Values of parameters by name, as JSON values or texts of Modelica expressions; also of structural parameters.
    """

    library_path: Sequence[Path] = ()
    values: Mapping[str, Any] = field(default_factory=dict)


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
        InputError: The front end reports errors, for example syntax errors and unknown names, or a library is not found.
    """
    path = path.resolve()
    text = read_source(path)
    packages, name = find_packages(path, text), model_name(path, text, model)
    files = [path, *(file for package in packages for file in sorted(package.rglob("*.mo")) if file != path)]
    libraries = find_libraries(files, library_folders(options.library_path), [package.name for package in packages])
    declaration = modified_model(name, options.values)
    sources = ModelicaSources(files, libraries, link_libraries(libraries) if libraries else None)
    if not libraries:
        flat = json.loads(_flatten(sources, packages, name, text, declaration))
    else:
        contents = [(str(file), sha256(file.read_bytes()).hexdigest()) for file in files]
        key = [RUMOCA_VERSION, name, declaration, contents, [(str(library.path), library.digest) for library in libraries]]
        document = read_document(key)
        if document is None:
            document = _flatten(sources, packages, name, text, declaration)
            store_document(key, document)
        flat = json.loads(document)
    _check_names(flat, options.values, name)
    return flat, sources


def _check_names(flat: Mapping[str, Any], values: Mapping[str, Any], model: str) -> None:
    """Raise InputError if the model has no such parameters; the front end ignores modifiers without a component."""
    known = [name for name, variable in flat["variables"].items() if "Parameter" in variable["variability"]]
    problems = [
        Problem(f'the model {model} has no parameter "{name}"{did_you_mean(name, known)}')
        for name in values
        if name not in known and not any(each.startswith(f"{name}.") for each in known)
    ]
    if problems:
        raise InputError(problems)


def modified_model(name: str, values: Mapping[str, Any]) -> str:
    """Return the declaration of the model MODIFIED_MODEL with values of parameters, "" without values.

    Raises:
        InputError: A name is not that of a component, or a value cannot be one of a parameter.
    """
    problems = [Problem("expected the name of a parameter", each) for each in values if not _REFERENCE.fullmatch(each)]
    if problems:
        raise InputError(problems)
    modifiers = ", ".join(_modifier(*each) for each in values.items())
    return f"model {MODIFIED_MODEL} extends {name}({modifiers}); end {MODIFIED_MODEL};" if modifiers else ""


def _modifier(name: str, value: Any) -> str:
    """Return a modifier: `a(b = 1)` for the parameter b of the component a."""
    first, dot, rest = name.partition(".")
    return f"{first}({_modifier(rest, value)})" if dot else f"{first} = {_expression(name, value)}"


def _expression(name: str, value: Any) -> str:
    """Return the Modelica expression of a JSON value; a text that is a name in Modelica stands for itself."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, list) and value:
        return "{" + ", ".join(_expression(name, each) for each in value) + "}"
    if isinstance(value, str):
        return value if _REFERENCE.fullmatch(value) and "." in value else json.dumps(value, ensure_ascii=False)
    raise InputError(Problem(f"found {value!r}, expected a number, true, false, a text or a list", name))


def _flatten(sources: ModelicaSources, packages: Sequence[Path], name: str, text: str, declaration: str) -> str:
    """Return the flat model as JSON text."""
    path, roots = sources.files[0], [*packages, *([sources.links] if sources.links else [])]
    display_name = None if _WITHIN.search(text) else _display_name(path)
    flattened = MODIFIED_MODEL if declaration else name
    answer = run_rumoca(RUMOCA_VERSION, sources.files, roots, flattened, display_name, declaration)
    if "version" in answer:
        raise InputError(_version_problem(answer["version"]))
    if "syntax_errors" in answer:
        raise InputError(_to_syntax_problem(*error) for error in answer["syntax_errors"])
    if "error" in answer:
        raise InputError(_to_problems(answer["error"], answer["panicked"], name, path, sources))
    flat: str = answer["flat"]
    return flat


def read_source(path: Path) -> str:
    """Return the text of a Modelica file.

    Raises:
        InputError: There is no such file, it is too large, or it is not UTF-8 text.
    """
    if not path.is_file():
        raise InputError(Problem("no such Modelica file", str(path)))
    if (size := path.stat().st_size) > MAX_SOURCE_SIZE:
        raise InputError(Problem(f"the file has {size} bytes, expected at most {MAX_SOURCE_SIZE}", str(path)))
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(Problem(f"the file is not UTF-8 text: {error.reason} at byte {error.start}", str(path))) from None


def _display_name(path: Path) -> str:
    return f"<{path.name}>"


def _version_problem(found: str | None) -> str:
    if found is None:
        return 'Modelica needs the compiler front end rumoca: pip install "fmi-cosim[build]"'
    return f"found rumoca {found}, but only {RUMOCA_VERSION} is supported: pip install rumoca=={RUMOCA_VERSION}"


def model_name(path: Path, text: str, model: str | None) -> str:
    """Return the full name of a model; the default is the model with the name of the file.

    Args:
        path: The Modelica file.
        text: Its contents.
        model: The name of the model, or None.
    """
    within = _WITHIN.search(text)
    return model or (f"{within[1]}.{path.stem}" if within else path.stem)


def find_packages(path: Path, text: str) -> list[Path]:
    """Return the folders of the packages that a file may use, for the file and its contents `text`."""
    folder = path.parent
    if _WITHIN.search(text):
        while (folder / "package.mo").is_file():
            folder = folder.parent
    return sorted(child for child in folder.iterdir() if (child / "package.mo").is_file())


def _to_syntax_problem(file: str, line: int, message: str) -> Problem:
    detail = _SYNTAX_ERROR.search(message)
    return Problem(detail["what"] if detail else message, f"{file}:{detail['line'] if detail else line}")


def _to_problems(error: str, panicked: bool, name: str, path: Path, sources: ModelicaSources) -> list[Problem]:
    """Convert the front end's message to problems, one for each informative line."""
    if panic := _PANIC.search(error):
        return [Problem(panic["what"], str(sources.locate({key: int(panic[key]) for key in ("source", "start")}) or path))]
    lines = [line.rpartition("[Resolve]:")[2].strip(" -") for line in error.splitlines()]
    reasons = [line for line in dict.fromkeys(lines) if line and not line.startswith("Related failures")]
    if any(line.startswith("unresolved extends base class") for line in reasons):
        reasons = [line for line in reasons if not line.startswith("base class not found")]
    if [line for line in reasons if not line.endswith(_NOT_FOUND)] == []:
        reasons = [f"the file contains no model with the name {name}"]
    specific = [line for line in reasons if " could not be compiled: " not in line] or reasons
    if not specific or panicked:
        specific = [f"the Modelica front end failed on the model {name}: {' '.join(lines)}"]
    return [_locate_problem(reason, name, path, sources) for reason in specific]


def _shorten(reason: str) -> str:
    """Return a reason without the phase of the front end and without counts of its internal kinds of equations."""
    return _COUNTS.sub("", _PHASE.sub("", reason))


def _locate_problem(reason: str, name: str, path: Path, sources: ModelicaSources) -> Problem:
    """Add a location to a reason: the one at its end, else the first line with a name that it quotes, else that of the model."""
    if ending := _LOCATION_SUFFIX.search(reason):
        where = SourceLocation(sources.find(ending["file"]) or path, int(ending["line"]))
        return Problem(_shorten(reason[: ending.start()].rstrip()), str(where))
    return Problem(_shorten(reason), str(_find_quoted_name(reason, sources) or sources.locate_class(name)))


def _find_quoted_name(reason: str, sources: ModelicaSources) -> SourceLocation | None:
    """Return the first source line with a name that a message quotes, or with an operator that it names."""
    for quoted in (*_QUOTED.findall(reason), *_OPERATOR.findall(reason)):
        word = re.compile(rf"(?<![\w.]){re.escape(quoted)}(?![\w])")
        for file in sources.files:
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                if word.search(line):
                    return SourceLocation(file, number)
    return None


def _fnv1a(text: str) -> int:
    """Return the 64-bit FNV-1a hash, by which rumoca identifies source files."""
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value
