"""Formatting of C code and search for identifiers in it."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator

_WIDTH = 118


def function_definition(head: str, body: Iterable[str]) -> str:
    """Return a C function definition with the given signature and unindented lines of its body."""
    return "\n".join([head, "{", *wrap_lines(body), "}"])


def wrap_lines(lines: Iterable[str]) -> Iterator[str]:
    """Yield the lines indented by one level.

    Long lines are wrapped, except those with text in quotation marks.
    """
    for line in lines:
        if '"' in line:
            yield "    " + line
            continue
        indent = " " * (8 + len(line) - len(line.lstrip()))
        yield from textwrap.wrap(
            "    " + line,
            _WIDTH,
            subsequent_indent=indent,
            break_long_words=False,
            break_on_hyphens=False,
            drop_whitespace=True,
        ) or [""]


def uses_variable(name: str, lines: Iterable[str]) -> bool:
    """Return whether a C variable with this name (not a struct member) occurs in the lines."""
    return any(re.search(rf"(?<![\w>.]){re.escape(name)}\b", line) for line in lines)
