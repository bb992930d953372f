"""Messages about operators that the front end refuses without their name or their place."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

from ....core.errors import Problem
from ..model.syntax_tree import SourceLocation
from .sources import ModelicaSources

_STATE_MACHINE = "initialState|transition|activeState|ticksInState|timeInState"
_REFUSED_STATE_MACHINE = re.compile(
    rf"state-machine lowering|unresolved function call: '(?:{_STATE_MACHINE})'"
)
_REFUSED_STATEMENT = "function-call assignment must retain at least one output"
_TOKEN = re.compile(
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
    """Return the problem for a reason of the front end with the place of the operator to which it is due.

    The place is the first one in the file of the model, else in the other files that it needs.

    Returns:
        None for a reason that is not due to one of these operators. The place is "" if the operator is not found.
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
    """Yield name, section and place of the calls of these operators in the files that a model needs."""
    for path in sources.used:
        yield from _calls_in(path)


def _calls_in(path: Path) -> Iterator[tuple[str, str, SourceLocation]]:
    text, section = path.read_text(encoding="utf-8", errors="replace"), ""
    for token in _TOKEN.finditer(text):
        section = token["section"] or section
        if token["name"]:
            yield (
                token["name"],
                section,
                SourceLocation(path, text.count("\n", 0, token.start()) + 1),
            )
