"""Parts of a Modelica text that are changed in order to find the one that the front end refuses.

Equations, values, bindings.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

_TOKEN = re.compile(
    r'(?P<comment>//[^\n]*|/\*.*?\*/)|(?P<string>"(?:[^"\\]|\\.)*")|(?P<word>[A-Za-z_]\w*)|(?P<symbol>:=|==|<=|>=|<>|\S)',
    re.DOTALL,
)
_SECTIONS = ("equation", "algorithm")
_COMPOUND = ("if", "for", "while", "when")
_OPEN, _CLOSE = ("(", "[", "{"), (")", "]", "}")

Token = tuple[str, int, int]


def removable_parts(text: str) -> list[tuple[int, int]]:
    """Return begin and end of each equation or statement of a Modelica text, and then of each binding of a declaration.

    >>> text = "model M Real x = 1; equation y = x; end M;"
    >>> [text[begin:end] for begin, end in removable_parts(text)]
    ['y = x;', '= 1']
    """
    tokens = _tokens(text)
    equations: list[tuple[int, int]] = []
    bindings: list[tuple[int, int]] = []
    k = 0
    while k < len(tokens):
        in_section = tokens[k][0] in _SECTIONS
        k = (
            _read_section(tokens, k + 1, equations)
            if in_section
            else _read_declaration(tokens, k, bindings)
        )
    return equations + bindings


def assigned_values(text: str) -> list[tuple[int, int]]:
    """Return begin and end of the right side of each assignment, also inside loops and branches, and then of each equation.

    >>> text = "model M Real x; algorithm if a then x := 1; end if; equation y = x; end M;"
    >>> [text[begin:end] for begin, end in assigned_values(text)]
    ['1', 'x']
    """
    tokens = _tokens(text)
    sides: dict[str, list[tuple[int, int]]] = {":=": [], "=": []}
    for begin, end in removable_parts(text):
        inside = [k for k, token in enumerate(tokens) if begin <= token[1] < end]
        for k in _outside_of_parentheses(tokens, inside[0], inside[-1]):
            if tokens[k][0] in sides and k > inside[0]:
                sides[tokens[k][0]].append((tokens[k + 1][1], tokens[_end_of_simple(tokens, k)][1]))
    return sides[":="] + sides["="]


def _tokens(text: str) -> list[Token]:
    return [(m[0], m.start(), m.end()) for m in _TOKEN.finditer(text) if m.lastgroup != "comment"]


def _read_section(tokens: Sequence[Token], k: int, parts: list[tuple[int, int]]) -> int:
    """Append the statements of a section that begins at a token.

    Return the number of the token after it.
    """
    while k < len(tokens) and tokens[k][0] not in (
        "end",
        "public",
        "protected",
        "initial",
        "annotation",
        "external",
        *_SECTIONS,
    ):
        last = (
            _end_of_compound(tokens, k) if tokens[k][0] in _COMPOUND else _end_of_simple(tokens, k)
        )
        parts.append((tokens[k][1], tokens[last][2]))
        k = last + 1
    return k


def _read_declaration(tokens: Sequence[Token], k: int, parts: list[tuple[int, int]]) -> int:
    """Append the binding of the declaration that begins at a token, if it has one.

    Return the number of the token after it.
    """
    last = _end_of_simple(tokens, k)
    for j in _outside_of_parentheses(tokens, k, last):
        if tokens[j][0] in _SECTIONS:
            return j
        if tokens[j][0] == "=":
            stop = next(
                (
                    i
                    for i in _outside_of_parentheses(tokens, j, last)
                    if tokens[i][0] in ("annotation", "if")
                ),
                last,
            )
            while tokens[stop - 1][0].startswith('"') and stop - 2 > j:
                stop -= 1
            parts.append((tokens[j][1], tokens[stop - 1][2]))
            break
    return last + 1


def _outside_of_parentheses(tokens: Sequence[Token], first: int, last: int) -> Iterator[int]:
    depth = 0
    for k in range(first, last):
        depth += (tokens[k][0] in _OPEN) - (tokens[k][0] in _CLOSE)
        if depth == 0:
            yield k


def _end_of_simple(tokens: Sequence[Token], first: int) -> int:
    """Return the number of the next semicolon outside of parentheses, or of the last token."""
    depth = 0
    for k in range(first, len(tokens)):
        depth += (tokens[k][0] in _OPEN) - (tokens[k][0] in _CLOSE)
        if tokens[k][0] == ";" and depth <= 0:
            return k
    return len(tokens) - 1


def _end_of_compound(tokens: Sequence[Token], first: int) -> int:
    """Return the number of the semicolon after the `end if` or similar that belongs to a token."""
    depth = 0
    for k in range(first, len(tokens) - 2):
        word = tokens[k][0]
        if word == "end" and tokens[k + 1][0] in _COMPOUND:
            depth -= 1
            if depth == 0:
                return k + 2
        elif (
            word in _COMPOUND
            and tokens[k - 1][0] in (";", "then", "else", "loop", *_SECTIONS)
            and (depth or k == first)
        ):
            depth += 1
    return _end_of_simple(tokens, first)
