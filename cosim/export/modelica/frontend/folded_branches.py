"""Detection of if-equations in when-clauses that the front end has folded.

Inside a when-clause rumoca silently replaces `if p then ... else ... end if` by one branch if the
condition can be evaluated with default values. A parameter that is set later would have no effect.
The flat model does not record this. Therefore the nesting depths are compared: an equation inside
fewer `if` in the flat model than in the source file has lost one.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from .model_files import ModelicaSources

_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])*\'|[A-Za-z_]\w*|\d[\w.]*|\S', re.DOTALL
)
_SECTIONS = {"algorithm", "equation", "public", "protected", "initial", "external"}
_BODY_TERMINATORS = {"end", "else", "elseif", "elsewhen"} | _SECTIONS


@dataclass(frozen=True)
class _IfEquation:
    """An if-equation inside a when-clause, from the source file."""

    #: byte range
    start: int
    end: int
    #: byte range of the when-clause
    when: tuple[int, int]
    #: all identifiers in the conditions
    identifiers: frozenset[str]


def folded_parameters(json: Mapping[str, Any], sources: ModelicaSources) -> frozenset[str]:
    """Return the parameters whose values have selected the branch of an if-equation.

    They are structural.

    Args:
        json: rumoca's document of the flat model.
        sources: The Modelica files.
    """
    found: set[str] = set()
    settable = {name.rpartition(".")[2] for name in json["variables"] if _is_settable(json, name)}
    for file, flat_equations in _equations_by_file(json, sources).items():
        text = file.read_bytes()
        for statement, depth in _Scanner(text.decode("latin-1")).if_equations():
            names = statement.identifiers & settable
            if names and _is_folded(statement, depth, flat_equations):
                found |= names
    return frozenset(
        name
        for name in json["variables"]
        if name.rpartition(".")[2] in found and _is_settable(json, name)
    )


def _is_settable(json: Mapping[str, Any], name: str) -> bool:
    variability = json["variables"][name]["variability"]
    return (
        isinstance(variability, dict)
        and "Parameter" in variability
        and not json["variable_final_flags"].get(name)
    )


def _is_folded(statement: _IfEquation, depth: int, flat_equations: list[tuple[int, int]]) -> bool:
    """Return whether an equation has lost an `if`, or all are missing from a when-clause."""
    depths = [
        flat_depth
        for start, flat_depth in flat_equations
        if statement.start <= start < statement.end
    ]
    when_exists = any(statement.when[0] <= start < statement.when[1] for start, _ in flat_equations)
    return when_exists and (not depths or min(depths) < depth)


def _equations_by_file(
    json: Mapping[str, Any], sources: ModelicaSources
) -> dict[Path, list[tuple[int, int]]]:
    """Return offset (bytes) and depth in `if` of all when-equations, by source file."""
    result: dict[Path, list[tuple[int, int]]] = {}
    for chain in json["when_chains"]:
        for block in (chain["first"], *chain["else_when"]):
            for span, depth in _equation_spans(block["equations"], 0):
                if location := sources.locate(span):
                    result.setdefault(location.path, []).append((span["start"], depth))
    return result


def _equation_spans(
    nodes: list[Mapping[str, Any]], depth: int
) -> Iterator[tuple[Mapping[str, int], int]]:
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
    """Scanner for the if-equations of a Modelica file.

    It tokenizes the file and skips all other parts of the language.
    """

    def __init__(self, text: str):
        matches = [m for m in _TOKEN.finditer(text) if not m[0].startswith(("//", "/*"))]
        self._tokens = [m[0] for m in matches] + ["end"]
        self._offsets = [m.start() for m in matches] + [len(text)]
        self._next = 0
        self._found: list[tuple[_IfEquation, int]] = []

    def if_equations(self) -> list[tuple[_IfEquation, int]]:
        """Return all if-equations in when-clauses with their nesting depth, 1 for the outermost."""
        while self._next < len(self._tokens) - 1:
            self._next += 1
            if self._tokens[self._next - 1] == "equation":
                self._body(0, None)
        return self._found

    def _body(self, depth: int, when: int | None) -> None:
        """Scan equations up to the keyword that ends them.

        `when` is the token index of the enclosing when-clause.
        """
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
            self._found[begin:] = [
                (_IfEquation(s.start, s.end, span, s.identifiers), d)
                for s, d in self._found[begin:]
            ]

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
        """Advance past the `then` that ends a condition.

        A `then` of an if-expression inside it does not end it.
        """
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
        """Advance past the next occurrence of a symbol outside brackets.

        A matrix may contain semicolons.
        """
        brackets = 0
        while self._next < len(self._tokens) - 1:
            self._next += 1
            symbol = self._tokens[self._next - 1]
            brackets += (symbol == "[") - (symbol == "]")
            if symbol == word and brackets == 0:
                return
