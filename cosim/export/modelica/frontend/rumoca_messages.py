"""Conversion of the front end's messages to problems with file and line."""

import re
from collections.abc import Container, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ....core.errors import Problem
from ..model.builtin_functions import CLOCKED_OPERATORS, PRE_OPERATORS
from ..model.syntax_tree import SourceLocation
from .class_search import models_hint
from .model_files import ModelicaSources

_QUOTED = re.compile(r"['`]([\w.]+(?: = [\w.]+)?)['`]")
_DIMENSION = re.compile(r"component dimension for ([\w.]+)")

#: beginnings of messages that name a part of the front end
_PHASE = re.compile(
    r"^(?:parse error: |\w+ failed: \S+ failed in \w+: (?:unsupported Flat semantic owner "
    r"`[^`]*`: |"
    r"unsupported runtime operator `[^`]+`: |canonical DAE construction rejected an invalid "
    r"operation: )?)"
)

#: operators that a message may name without quotes
_OPERATORS = (*CLOCKED_OPERATORS, *PRE_OPERATORS, "sample", "der", "delay")
_OPERATOR = re.compile(rf"\b({'|'.join(_OPERATORS)}|return|reinit|terminate)\b")

#: messages that do not name their cause -> their meaning
_MEANINGS = {
    "must name a coordinate classified as a continuous state": (
        "der() needs a variable with a derivative: inputs, discrete variables and parameters have "
        "none; filter an input u first, T*der(x) = u - x, and use der(x)"
    ),
    "component binding type compatibility": "the type of the binding does not fit the declaration",
    "a non-guarded nested return": (
        "return inside a loop or a branch is not supported; write one assignment for each branch"
    ),
    "a proved finite arithmetic-series form": (
        "break inside a loop is not supported; write its condition after while"
    ),
    (
        "range and subscript must cover one declared array axis exactly"
    ): "the range of a loop in an algorithm differs from the "
    "declared size of an array that it subscripts",
    "expression shape mismatch": "expression shape mismatch: the sizes of the operands differ",
}
_COUNTS = re.compile(r"; unknowns\[.*$")
_NOT_FOUND = " could not be compiled because resolve/parse failed"
_LOCATION_SUFFIX = re.compile(r"\[(?P<file>[^\[\]]+):(?P<line>\d+):\d+\]$")
_PANIC = re.compile(
    r'detail: "(?P<what>[^"]+)", span: Span \{ source: SourceId\((?P<source>\d+)\), start: '
    r"BytePos\((?P<start>\d+)\)"
)
_SYNTAX_ERROR = re.compile(r"×\s*(?P<what>.+?)\n[^\n]*╭─\[[^\]]*:(?P<line>\d+):\d+\]", re.DOTALL)
_LINE_BREAK = re.compile(r"\s*\n[\s│]*")
_EXPECTED = re.compile(r"help: expected one of: (?P<tokens>.*)", re.DOTALL)

#: words that are no names (Modelica Language Specification 3.6, section 2.3.3)
_RESERVED = re.compile(
    "algorithm|and|annotation|block|break|class|connect|connector|constant|"
    "constrainedby|der|discrete|each|else|elseif|elsewhen|encapsulated|end|enumeration|"
    "equation|expandable|extends|external|false|final|flow|for|function|if|import|"
    "impure|in|initial|inner|input|loop|model|not|operator|or|outer|output|package|"
    "parameter|partial|protected|public|pure|record|redeclare|replaceable|return|stream|"
    "then|true|type|when|while|within"
)


def to_syntax_problem(file: str, line: int, message: str) -> Problem:
    """Convert a syntax error."""
    detail = _SYNTAX_ERROR.search(message)
    if not detail:
        return Problem(message, f"{file}:{line}")
    what = _LINE_BREAK.sub(" ", detail["what"])
    word = what.removeprefix("unexpected ").strip("`")
    if _RESERVED.fullmatch(word) and _is_in_place_of_name(word, message):
        what = (
            f"`{word}` is a reserved keyword in Modelica (MLS §2.3.3) and cannot be used as an "
            "identifier"
        )
    return Problem(what, f"{file}:{detail['line']}")


def _is_in_place_of_name(word: str, message: str) -> bool:
    """Return whether a word stands in a declaration after its type.

    A type may go on with "." or ".*", a term also with "+".
    """
    expected = _EXPECTED.search(message)
    tokens = expected["tokens"].replace("\n", " ").split(", ") if expected else []
    tokens = [token.strip() for token in tokens]
    ends_declaration = re.search(rf"\b{word}\s*[;=(\[,\"]", message)
    return "dotstar" in tokens and "+" not in tokens and ends_declaration is not None


def to_problems(
    answer: Mapping[str, Any], name: str, path: Path, sources: ModelicaSources
) -> list[Problem]:
    """Convert a message of `rumoca_process` to problems, one for each informative line."""
    error = answer["error"]
    if panic := _PANIC.search(error):
        return [
            Problem(
                _shorten(panic["what"]),
                str(sources.locate({key: int(panic[key]) for key in ("source", "start")}) or path),
            )
        ]
    lines = [line.rpartition("[Resolve]:")[2].strip(" -") for line in error.splitlines()]
    reasons = [
        line for line in dict.fromkeys(lines) if line and not line.startswith("Related failures")
    ]
    if any(line.startswith("unresolved extends base class") for line in reasons):
        reasons = [line for line in reasons if not line.startswith("base class not found")]
    if [line for line in reasons if not line.endswith(_NOT_FOUND)] == []:
        reasons = [f"the file contains no model with the name {name}{models_hint(name, path)}"]
    specific = [line for line in reasons if " could not be compiled: " not in line] or reasons
    if not specific or answer["panicked"]:
        specific = [f"the Modelica front end failed on the model {name}: {' '.join(lines)}"]
    return list(
        dict.fromkeys(
            _to_problem(reason, name, path, sources, answer["lines"]) for reason in specific
        )
    )


def _to_problem(
    reason: str, name: str, path: Path, sources: ModelicaSources, part: Sequence[int] | None
) -> Problem:
    """Convert a reason to a problem with a place.

    An operator that is not supported has a message and a place of its own. The place is else the
    first of these that exists: the one at the end of the reason; that of the class of a library
    that it names; the first line with a name that it quotes, in the `part` of the model (first and
    last line) to which the error is due; the first line of the model's file with an operator that
    it names; the first line of this part; the first line of all files with such a name; that of
    the model.
    """
    explained = explain_unsupported_operator(reason, sources)
    if explained and explained.where:
        return explained
    reason = explained.message if explained else reason
    if ending := _LOCATION_SUFFIX.search(reason):
        where = SourceLocation(sources.find(ending["file"]) or path, int(ending["line"]))
        return Problem(_shorten(reason[: ending.start()].rstrip()), str(where))
    meaning = _shorten(reason)
    place = sources.locate_library_class(_QUOTED.findall(reason))
    if place is None and part:
        place = _find_quoted_name(f"{reason} {meaning}", [path], range(part[0], part[1] + 1))
        place = (
            place or _find_name(_OPERATOR.findall(reason), [path]) or SourceLocation(path, part[0])
        )
    place = place or _find_quoted_name(f"{reason} {meaning}", sources.files)
    place = place or sources.locate_in_libraries(_OPERATOR.findall(f"{reason} {meaning}"))
    return Problem(meaning, str(place or sources.locate_class(name)))


def _shorten(reason: str) -> str:
    """Return a reason without the front end's phases and internal counts."""
    for message, meaning in _MEANINGS.items():
        if message in reason:
            return meaning
    return _COUNTS.sub("", _PHASE.sub("", reason))


def _find_quoted_name(
    reason: str, files: Iterable[Path], lines: Container[int] | None = None
) -> SourceLocation | None:
    """Return the first line with a name that a message quotes, or an operator in it."""
    return _find_name(
        (*_QUOTED.findall(reason), *_DIMENSION.findall(reason), *_OPERATOR.findall(reason)),
        files,
        lines,
    )


def _find_name(
    names: Iterable[str], files: Iterable[Path], lines: Container[int] | None = None
) -> SourceLocation | None:
    """Return the first source line with one of these names, the first name first."""
    for quoted in names:
        word = re.compile(rf"(?<![\w.]){re.escape(quoted)}(?![\w])")
        for file in files:
            for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                if (lines is None or number in lines) and word.search(line):
                    return SourceLocation(file, number)
    return None


_STATE_MACHINE = "initialState|transition|activeState|ticksInState|timeInState"
_REFUSED_STATE_MACHINE = re.compile(
    rf"state-machine lowering|unresolved function call: '(?:{_STATE_MACHINE})'"
)
_REFUSED_STATEMENT = "function-call assignment must retain at least one output"
_OPERATOR_CALL = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"|\b(?P<section>algorithm|equation)\b|'
    rf"\b(?P<name>reinit|terminate|{_STATE_MACHINE})\s*\(",
    re.DOTALL,
)
_STATE_MACHINE_TEXT = (
    "state machines ({}) are not supported; write the state as a variable of an enumeration type, "
    "which when-clauses change"
)
_STATEMENT_TEXTS = {
    "reinit": "reinit() is not supported in algorithms; write it in a when-equation "
    "(equation when ... then reinit(x, 0); end when;)",
    "terminate": (
        "terminate() is not supported in algorithms of packages; write it in a when-equation"
    ),
}
_OTHER_STATEMENT = (
    "functions without results are not supported in algorithms; write a function with a result"
)


def explain_unsupported_operator(reason: str, sources: ModelicaSources) -> Problem | None:
    """Return the problem for a reason that is due to an operator, with its place.

    The place is the first one in the file of the model, else in the other files that it needs.

    Returns:
        None for a reason that is not due to one of these operators. The place is "" if the operator
        is not found.
    """
    if _REFUSED_STATE_MACHINE.search(reason):
        calls = [
            (name, place) for name, _, place in _calls(sources) if name in _STATE_MACHINE.split("|")
        ]
        names = ", ".join(dict.fromkeys(name for name, _ in calls))
        return Problem(_STATE_MACHINE_TEXT.format(names), str(calls[0][1])) if calls else None
    if _REFUSED_STATEMENT not in reason:
        return None
    found = {
        name: place
        for name, section, place in reversed(list(_calls(sources)))
        if section == "algorithm"
    }
    # terminate() of a file outside of packages has been replaced
    own = sources.files[0] if sources.text is not None else None
    for name, text in _STATEMENT_TEXTS.items():
        if name in found and not (name == "terminate" and found[name].path == own):
            return Problem(text, str(found[name]))
    return Problem(_OTHER_STATEMENT)


def _calls(sources: ModelicaSources) -> Iterator[tuple[str, str, SourceLocation]]:
    """Yield name, section and place of each call of these operators."""
    for path in sources.used:
        yield from _calls_in(path)


def _calls_in(path: Path) -> Iterator[tuple[str, str, SourceLocation]]:
    text, section = path.read_text(encoding="utf-8", errors="replace"), ""
    for token in _OPERATOR_CALL.finditer(text):
        section = token["section"] or section
        if token["name"]:
            yield (
                token["name"],
                section,
                SourceLocation(path, text.count("\n", 0, token.start()) + 1),
            )
