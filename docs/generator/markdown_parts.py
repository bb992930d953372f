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
    rows = [tuple(_BAR.sub(r"\|", " ".join(cell.split())) for cell in row) for row in rows]
    used = [i for i in range(len(header)) if any(row[i] for row in rows)]
    lines = [
        [header[i] for i in used],
        ["---" for _ in used],
        *([row[i] for i in used] for row in rows),
    ]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n" if rows else ""


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
