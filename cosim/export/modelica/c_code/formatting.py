"""Lines of C: wrapping, and what occurs in them."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator

_WIDTH = 118


def function_definition(head: str, body: Iterable[str]) -> str:
    """A C function from its head and the unindented lines of its body."""
    return "\n".join([head, "{", *wrap_lines(body), "}"])


def wrap_lines(lines: Iterable[str]) -> Iterator[str]:
    """The lines indented by one level; those that are too long go on in the next one."""
    for line in lines:
        indent = " " * (8 + len(line) - len(line.lstrip()))
        yield from textwrap.wrap(
            "    " + line, _WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False, drop_whitespace=True
        ) or [""]


def uses_variable(name: str, lines: Iterable[str]) -> bool:
    """Whether a C variable of this name (not a member) occurs."""
    return any(re.search(rf"(?<![\w>.]){re.escape(name)}\b", line) for line in lines)
