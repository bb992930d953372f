"""Text of foreign code (FMUs, scenarios, KPI functions) for terminals and log files."""

from __future__ import annotations

from unicodedata import category


def escape_control_characters(text: str, keep: str = "") -> str:
    r"""Return a text with line breaks, control and direction characters as escape sequences such as \x1b.

    These characters could move the cursor of a terminal, change its title, reorder text or fake lines of a log. Spaces of any
    width (category Zs) stay.

    Args:
        text: The text.
        keep: Characters that stay as they are.
    """
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() or c in keep or category(c) == "Zs" else _escape(c) for c in text)


def _escape(character: str) -> str:
    return character.encode("unicode_escape", "surrogatepass").decode("ascii")
