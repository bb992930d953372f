"""Texts of scenarios, callers and other programs.

Limits of length, forbidden characters, escape sequences for printing.
"""

import re

#: longest text that is accepted (characters)
MAX_TEXT_LENGTH = 1 << 20
#: stands for each forbidden character
REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
#: longest quotation of a value in a message (characters)
MAX_QUOTATION_LENGTH = 200
#: spaces of texts in any language: tab, no-break spaces and the ideographic space
SPACES = "\t\u00a0\u202f\u3000"

#: NUL ends a text in C and is not allowed in file names; surrogates are not allowed in UTF-8
_FORBIDDEN_CHARACTERS = re.compile("[\0\ud800-\udfff]")


def text_problem(text: str) -> str:
    r"""Return the reason why a text cannot be stored in an FMU or a file; "" if it can.

    >>> text_problem("a\0"), text_problem("a")
    ('the character U+0000 is not allowed', '')
    """
    if len(text) > MAX_TEXT_LENGTH:
        return (
            f"a text of {len(text)} characters is not allowed, expected at most {MAX_TEXT_LENGTH}"
        )
    match = _FORBIDDEN_CHARACTERS.search(text)
    return f"the character U+{ord(match.group()):04X} is not allowed" if match else ""


def acceptable_text(text: str) -> str:
    """Return a text, shortened and without forbidden characters if `text_problem` refuses it."""
    return _FORBIDDEN_CHARACTERS.sub(
        REPLACEMENT, text if len(text) <= MAX_TEXT_LENGTH else shorten(text)
    )


def count_noun(count: int, noun: str) -> str:
    """Return a count with its noun in singular or plural.

    >>> count_noun(1, "row"), count_noun(0, "row")
    ('1 row', '0 rows')
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def shorten(text: str, length: int = MAX_QUOTATION_LENGTH) -> str:
    """Return the first `length` characters of a text, and the number of the others.

    >>> shorten("abcdef", 4), shorten("abcd", 4)
    ('abcd ... and 2 characters more', 'abcd')
    """
    rest = len(text) - length
    return text if rest <= 0 else f"{text[:length]} ... and {count_noun(rest, 'character')} more"


def escape_control_characters(text: str, keep: str = "") -> str:
    r"""Return a text with control characters, also line breaks, as escape sequences such as \x1b.

    Marks of the direction of writing are escaped too. These characters could move the cursor of a
    terminal, change its title, reorder text or fake lines of a log.

    Args:
        text: The text.
        keep: Characters that stay as they are.
    """
    if text.isprintable():
        return text
    escaped = ""
    for c in text:
        if not (c.isprintable() or c in keep):
            c = c.encode("unicode_escape", "surrogatepass").decode("ascii")
        escaped += c
    return escaped
