"""Text of foreign code (FMUs, scenarios, KPI functions) for terminals and log files."""

from __future__ import annotations

#: spaces of texts in any language: tab, no-break spaces and the ideographic space
SPACES = "\t\u00a0\u202f\u3000"


def escape_control_characters(text: str, keep: str = "") -> str:
    r"""Return a text with line breaks, control characters and direction marks as escape sequences such as \x1b.

    These characters could move the cursor of a terminal, change its title, reorder text or fake lines of a log.

    Args:
        text: The text.
        keep: Characters that stay as they are.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep else _escape(c) for c in text)


def _escape(character: str) -> str:
    return character.encode("unicode_escape", "surrogatepass").decode("ascii")
