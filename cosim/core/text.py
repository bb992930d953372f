"""Texts that scenarios, callers and other programs pass in, and the limits of them."""

from __future__ import annotations

import re

#: longest text that is accepted (characters)
MAX_TEXT_LENGTH = 1 << 20
#: stands for each forbidden character
REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
#: longest quotation of a value in a message (characters)
_MAX_QUOTATION_LENGTH = 200

#: NUL ends a text in C and is not allowed in file names; surrogates are not allowed in UTF-8
_FORBIDDEN_CHARACTERS = re.compile("[\0\ud800-\udfff]")


def text_problem(text: str) -> str:
    r"""Return the reason why neither an FMU nor a file can hold a text; "" if they can.

    >>> text_problem("a\0"), text_problem("a")
    ('the character U+0000 is not allowed', '')
    """
    if len(text) > MAX_TEXT_LENGTH:
        return f"a text of {len(text)} characters is not allowed, expected at most {MAX_TEXT_LENGTH}"
    match = _FORBIDDEN_CHARACTERS.search(text)
    return f"the character U+{ord(match.group()):04X} is not allowed" if match else ""


def acceptable_text(text: str) -> str:
    """Return a text without the characters and the length that `text_problem` refuses."""
    return _FORBIDDEN_CHARACTERS.sub(REPLACEMENT, text[:MAX_TEXT_LENGTH])


def shorten(text: str) -> str:
    """Return the begin of a text that is long, for messages.

    >>> shorten("short")
    'short'
    """
    return text if len(text) <= _MAX_QUOTATION_LENGTH else f"{text[:_MAX_QUOTATION_LENGTH]} ... ({len(text)} characters)"
