"""Conversion of the front end's messages to problems with file and line."""

from __future__ import annotations

import re
from pathlib import Path

from ....core.errors import Problem
from ..model.syntax_tree import SourceLocation
from .sources import ModelicaSources

_QUOTED = re.compile(r"['`]([\w.]+(?: = [\w.]+)?)['`]")
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
#: messages that do not name their cause -> their meaning
_MEANINGS = {
    "function-call assignment must retain at least one output": "terminate() and functions without results are not supported in "
    "algorithms of packages; write terminate() in a when-equation",
}
_COUNTS = re.compile(r"; unknowns\[.*$")
_NOT_FOUND = " could not be compiled because resolve/parse failed"
_LOCATION_SUFFIX = re.compile(r"\[(?P<file>[^\[\]]+):(?P<line>\d+):\d+\]$")
_PANIC = re.compile(
    r'detail: "(?P<what>[^"]+)", span: Span \{ source: SourceId\((?P<source>\d+)\), start: BytePos\((?P<start>\d+)\)'
)
_SYNTAX_ERROR = re.compile(r"×\s*(?P<what>.+?)\n.*?\[[^\]]*:(?P<line>\d+):\d+\]", re.DOTALL)


def to_syntax_problem(file: str, line: int, message: str) -> Problem:
    """Convert a syntax error."""
    detail = _SYNTAX_ERROR.search(message)
    return Problem(detail["what"] if detail else message, f"{file}:{detail['line'] if detail else line}")


def to_problems(error: str, panicked: bool, name: str, path: Path, sources: ModelicaSources) -> list[Problem]:
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
    for message, meaning in _MEANINGS.items():
        if message in reason:
            return meaning
    return _COUNTS.sub("", _PHASE.sub("", reason))


def _locate_problem(reason: str, name: str, path: Path, sources: ModelicaSources) -> Problem:
    """Add a location to a reason: the one at its end, else the first line with a name that it quotes, else that of the model."""
    if ending := _LOCATION_SUFFIX.search(reason):
        where = SourceLocation(sources.find(ending["file"]) or path, int(ending["line"]))
        return Problem(_shorten(reason[: ending.start()].rstrip()), str(where))
    meaning = _shorten(reason)
    return Problem(meaning, str(_find_quoted_name(f"{reason} {meaning}", sources) or sources.locate_class(name)))


def _find_quoted_name(reason: str, sources: ModelicaSources) -> SourceLocation | None:
    """Return the first source line with a name that a message quotes, or with an operator that it names."""
    for quoted in (*_QUOTED.findall(reason), *_OPERATOR.findall(reason)):
        word = re.compile(rf"(?<![\w.]){re.escape(quoted)}(?![\w])")
        for file in sources.files:
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                if word.search(line):
                    return SourceLocation(file, number)
    return None
