"""Runs the front end rumoca: Modelica files in, one flat model (JSON) out.

Names resolve deterministically: the file itself, plus every package folder (a folder with `package.mo`) beside it. Other files
beside it are never read. A file that belongs to a package (`within P;`) is loaded as that member of its package.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ....core.errors import InputError, Problem
from ..model.flat_model import SourceLocation

RUMOCA_VERSION = "0.10.2"
_WITHIN = re.compile(r"^\s*within\s+([\w.]+)\s*;", re.MULTILINE)
_QUOTED = re.compile(r"'([\w.]+)'")
_LOCATION_SUFFIX = re.compile(r"\[(?P<file>[^\[\]]+):(?P<line>\d+):\d+\]$")
_PANIC = re.compile(
    r'detail: "(?P<what>[^"]+)", span: Span \{ source: SourceId\((?P<source>\d+)\), start: BytePos\((?P<start>\d+)\)'
)
_SYNTAX_ERROR = re.compile(r"×\s*(?P<what>.+?)\n.*?\[[^\]]*:(?P<line>\d+):\d+\]", re.DOTALL)


@dataclass(frozen=True)
class ModelicaSources:
    """The Modelica files that were given to the front end, and how its spans (file hash, byte offset) map to lines."""

    files: Sequence[Path]
    _by_hash: Mapping[int, Path]

    @classmethod
    def from_files(cls, files: Sequence[Path]) -> ModelicaSources:
        """The model's own file comes first."""
        own = {_fnv1a(_display_name(file)): file for file in files[:1]}
        return cls(files, own | {_fnv1a(str(file)): file for file in files})

    def find(self, name: str) -> Path | None:
        """The file of this name, as the front end writes it."""
        return self._by_hash.get(_fnv1a(name))

    def locate(self, span: Mapping[str, int] | None) -> SourceLocation | None:
        """The line at which a span starts; None for what the front end made itself."""
        path = self._by_hash.get(span["source"]) if span else None
        if span is None or path is None:
            return None
        return SourceLocation(path, path.read_bytes().count(b"\n", 0, span["start"]) + 1)


def flatten_model(path: Path, model: str | None) -> tuple[dict[str, Any], ModelicaSources]:
    """The flat model `model` (default: the file's stem) of the file as rumoca's JSON, and its sources.

    Raises InputError for syntax errors, unknown names and everything else that the front end refuses.
    """
    path = path.resolve()
    rumoca = _import_rumoca()
    if not path.is_file():
        raise InputError(Problem("no such Modelica file", str(path)))
    text = path.read_text(encoding="utf-8")
    packages = find_packages(path, text)
    sources = ModelicaSources.from_files(
        [path, *(file for package in packages for file in sorted(package.rglob("*.mo")) if file != path)]
    )
    _check_syntax(rumoca, sources.files)
    name = model_name(path, text, model)
    session = rumoca.Session(roots=[str(package) for package in packages])
    try:
        compiled = session.load(str(path), model=name) if _WITHIN.search(text) else _load_text(session, path, text, name)
        return json.loads(compiled.to_json("flat")), sources
    except (KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # rumoca's panics are not Exceptions
        raise InputError(_to_problems(error, name, path, sources)) from error


def _load_text(session: Any, path: Path, text: str, name: str) -> Any:
    """Loads the text under a name that lies in no folder: rumoca reads all siblings of an existing file."""
    return session.loads(text, model=name, filename=_display_name(path))


def _display_name(path: Path) -> str:
    return f"<{path.name}>"


def _import_rumoca() -> Any:
    try:
        import rumoca
    except ImportError as error:
        raise InputError('Modelica needs the compiler front end rumoca: pip install "fmi-cosim[build]"') from error
    if (found := rumoca.version()) != RUMOCA_VERSION:
        raise InputError(
            f"rumoca {found} is installed, but only {RUMOCA_VERSION} is known to work: pip install rumoca=={RUMOCA_VERSION}"
        )
    return rumoca


def model_name(path: Path, text: str, model: str | None) -> str:
    """The full name of a model of a file, by default of the one that is named as the file."""
    within = _WITHIN.search(text)
    return model or (f"{within[1]}.{path.stem}" if within else path.stem)


def find_packages(path: Path, text: str) -> list[Path]:
    """The package folders whose names the file may use."""
    folder = path.parent
    if _WITHIN.search(text):
        while (folder / "package.mo").is_file():
            folder = folder.parent
    return sorted(child for child in folder.iterdir() if (child / "package.mo").is_file())


def _check_syntax(rumoca: Any, files: Sequence[Path]) -> None:
    """Syntax errors with file and line; when loading, the front end reports only their consequences."""
    problems = []
    for file in files:
        for found in rumoca.validate_source(file.read_text(encoding="utf-8"), filename=str(file)):
            if found.rule == "syntax-error":
                detail = _SYNTAX_ERROR.search(found.message)
                line = int(detail["line"]) if detail else found.line
                problems.append(Problem(detail["what"] if detail else found.message, f"{file}:{line}"))
    if problems:
        raise InputError(problems)


def _to_problems(error: BaseException, name: str, path: Path, sources: ModelicaSources) -> list[Problem]:
    """One problem per line of the front end's message that says something."""
    if panic := _PANIC.search(str(error)):
        return [Problem(panic["what"], str(sources.locate({key: int(panic[key]) for key in ("source", "start")}) or path))]
    lines = [line.rpartition("[Resolve]:")[2].strip(" -") for line in str(error).splitlines()]
    reasons = [line for line in dict.fromkeys(lines) if line and not line.startswith("Related failures")]
    specific = [line for line in reasons if " could not be compiled: " not in line] or reasons
    if not specific or not isinstance(error, Exception):
        specific = [f"the Modelica front end failed on the model {name}: {' '.join(lines) or type(error).__name__}"]
    return [_locate_problem(reason, path, sources) for reason in specific]


def _locate_problem(reason: str, path: Path, sources: ModelicaSources) -> Problem:
    """A reason with the place that it ends with or, since most have none, with the line that holds the name it quotes."""
    if ending := _LOCATION_SUFFIX.search(reason):
        where = SourceLocation(sources.find(ending["file"]) or path, int(ending["line"]))
        return Problem(reason[: ending.start()].rstrip(), str(where))
    return Problem(reason, str(_find_quoted_name(reason, sources) or path))


def _find_quoted_name(reason: str, sources: ModelicaSources) -> SourceLocation | None:
    """The first line that holds the name which the message quotes: rumoca's own messages carry no place."""
    quoted = _QUOTED.search(reason)
    if quoted is None:
        return None
    word = re.compile(rf"(?<![\w.]){re.escape(quoted[1])}(?![\w])")
    for file in sources.files:
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
            if word.search(line):
                return SourceLocation(file, number)
    return None


def _fnv1a(text: str) -> int:
    """The 64-bit FNV-1a hash, by which rumoca names source files."""
    value = 0xCBF29CE484222325
    for byte in text.encode():
        value = (value ^ byte) * 0x100000001B3 & 0xFFFFFFFFFFFFFFFF
    return value
