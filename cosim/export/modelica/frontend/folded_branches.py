"""Finds if-equations that the front end has decided on its own, with the default value of a parameter.

Inside a when-clause rumoca silently replaces `if p then ... else ... end if` by one of its branches when it can compute the
condition from defaults; a parameter set later would have no effect. The flat model keeps no trace of it, but the sources do:
an equation that stands in fewer `if` in the flat model than in the file has lost one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..model.flat_model import SourceLocation, raise_model_error
from .rumoca_frontend import ModelicaSources

_TOKEN = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|[A-Za-z_]\w*|\d[\w.]*|\S', re.DOTALL)
_SECTIONS = {"algorithm", "equation", "public", "protected", "initial", "external"}
_BODY_TERMINATORS = {"end", "else", "elseif", "elsewhen"} | _SECTIONS


@dataclass(frozen=True)
class _IfEquation:
    """An if-equation inside a when-clause: byte range of it and of the when, and the identifiers in its conditions."""

    start: int
    end: int
    when: tuple[int, int]
    identifiers: frozenset[str]


def check_folded_branches(json: Mapping[str, Any], sources: ModelicaSources) -> None:
    """Raises InputError at the first if-equation on a settable parameter that is missing from the flat model."""
    settable = {name.rpartition(".")[2] for name in json["variables"] if _is_settable(json, name)}
    for file, found in _equations_by_file(json, sources).items():
        text = file.read_bytes()
        for statement, depth in _Scanner(text.decode("latin-1")).if_equations():
            names = ", ".join(sorted(statement.identifiers & settable))
            if names and _is_folded(statement, depth, found):
                where = SourceLocation(file, text.count(b"\n", 0, statement.start) + 1)
                remedy = "write an if-expression or an algorithm"
                raise_model_error(f"the front end would decide this if-equation by the default of {names}; {remedy}", where)


def _is_settable(json: Mapping[str, Any], name: str) -> bool:
    variability = json["variables"][name]["variability"]
    return isinstance(variability, dict) and "Parameter" in variability and not json["variable_final_flags"].get(name)


def _is_folded(statement: _IfEquation, depth: int, found: list[tuple[int, int]]) -> bool:
    """Whether equations of the statement have lost an `if` around them, or all are gone though their when-clause is there."""
    inside = [level for start, level in found if statement.start <= start < statement.end]
    used = any(statement.when[0] <= start < statement.when[1] for start, _ in found)
    return used and (not inside or min(inside) < depth)


def _equations_by_file(json: Mapping[str, Any], sources: ModelicaSources) -> dict[Path, list[tuple[int, int]]]:
    """Byte offset and depth of `if` of every equation in the when-clauses of the flat model."""
    result: dict[Path, list[tuple[int, int]]] = {}
    for chain in json["when_chains"]:
        for block in (chain["first"], *chain["else_when"]):
            for span, depth in _equation_spans(block["equations"], 0):
                if place := sources.locate(span):
                    result.setdefault(place.path, []).append((span["start"], depth))
    return result


def _equation_spans(nodes: list[Mapping[str, Any]], depth: int) -> Iterator[tuple[Mapping[str, int], int]]:
    for node in nodes:
        ((kind, payload),) = node.items()
        if kind == "Conditional":
            for body in (*(body for _, body in payload["branches"]), payload["else_branch"] or []):
                yield from _equation_spans(body, depth + 1)
        elif kind == "Assert":
            ((_, condition),) = payload["condition"].items()
            yield condition["span"], depth
        else:
            yield payload["span"], depth


class _Scanner:
    """Finds the if-equations in a file without understanding the rest of the language."""

    def __init__(self, text: str):
        matches = [m for m in _TOKEN.finditer(text) if not m[0].startswith(("//", "/*"))]
        self._tokens = [m[0] for m in matches] + ["end"]
        self._offsets = [m.start() for m in matches] + [len(text)]
        self._next = 0
        self._found: list[tuple[_IfEquation, int]] = []

    def if_equations(self) -> list[tuple[_IfEquation, int]]:
        """All if-equations in when-clauses, each with its depth: 1 for those directly in the when-clause."""
        while self._next < len(self._tokens) - 1:
            self._next += 1
            if self._tokens[self._next - 1] == "equation":
                self._body(0, None)
        return self._found

    def _body(self, depth: int, when: int | None) -> None:
        """Equations up to the word that ends them; `when` is the place of the when-clause around them in the result."""
        while (word := self._tokens[self._next]) not in _BODY_TERMINATORS:
            if word == "if":
                self._if(depth, when)
            elif word in ("when", "for"):
                self._clause(word, depth, when)
            else:
                self._skip(";")

    def _clause(self, word: str, depth: int, when: int | None) -> None:
        first, begin = self._next, len(self._found)
        self._skip("then" if word == "when" else "loop")
        self._body(0 if word == "when" else depth, first if word == "when" else when)
        while self._tokens[self._next] == "elsewhen":
            self._skip("then")
            self._body(0, first)
        self._skip(";")
        if word == "when":
            span = (self._offsets[first], self._offsets[self._next - 1])
            self._found[begin:] = [(_IfEquation(s.start, s.end, span, s.identifiers), d) for s, d in self._found[begin:]]

    def _if(self, depth: int, when: int | None) -> None:
        first, identifiers = self._next, set[str]()
        while self._tokens[self._next] in ("if", "elseif", "else"):
            start = self._next
            if self._tokens[start] == "else":
                self._next += 1
            else:
                self._condition()
            identifiers |= set(self._tokens[start : self._next])
            self._body(depth + 1, when)
        self._skip(";")
        if when is not None:
            span = (self._offsets[first], self._offsets[self._next - 1])
            self._found.append((_IfEquation(*span, span, frozenset(identifiers)), depth + 1))

    def _condition(self) -> None:
        """Past the `then` of a condition; those of if-expressions inside do not count."""
        open_ifs = 0
        while True:
            self._next += 1
            word = self._tokens[self._next - 1]
            if word in ("if", "elseif"):
                open_ifs += 1
            elif word == "then":
                open_ifs -= 1
                if open_ifs == 0:
                    return

    def _skip(self, word: str) -> None:
        """Past the next such word; semicolons in a matrix do not count."""
        brackets = 0
        while self._next < len(self._tokens) - 1:
            self._next += 1
            found = self._tokens[self._next - 1]
            brackets += (found == "[") - (found == "]")
            if found == word and brackets == 0:
                return
