"""Parts of generated Markdown pages."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence

_SPECIAL = re.compile(r"[*_\[\]<>|\\]")
_BAR = re.compile(r"(?<!\\)\|")
GENERATED = "*This page is generated from the code.*"


def table(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table; "" without rows.

    Columns that are empty in all rows are left out; `|` in a cell is escaped.
    """
    columns = list(zip(header, *rows, strict=True))
    used = [map(_cell, column) for column in columns if any(column[1:])]
    if not used:
        return ""
    first, *others = zip(*used, strict=True)
    lines = [first, ["---"] * len(used), *others]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def _cell(text: str) -> str:
    """Return the text of a cell in one line, with escaped bars."""
    return _BAR.sub(r"\|", " ".join(text.split()))


def code(text: object) -> str:
    """Return a text as code; "" stays empty."""
    return f"`{text}`" if str(text) else ""


def plain(text: str) -> str:
    """Return a text in which no character but those of `code` is Markdown or HTML."""
    parts = re.split(r"(`[^`]+`)", text)
    return "".join(
        part if i % 2 else _SPECIAL.sub(lambda found: f"&#{ord(found[0])};", part)
        for i, part in enumerate(parts)
    )


def page(title: str, *parts: str) -> str:
    """Return a page with a title."""
    return "\n\n".join((f"# {title}", GENERATED, *filter(None, parts))) + "\n"
