"""Texts that scenarios, callers and other programs pass in, and the limits of them."""

from __future__ import annotations

import re

#: longest text that is accepted (characters)
MAX_TEXT_LENGTH = 1 << 20
#: stands for each forbidden character
REPLACEMENT = "\N{REPLACEMENT CHARACTER}"
#: longest quotation of a value in a message (characters)
MAX_QUOTATION_LENGTH = 200

#: NUL ends a text in C and is not allowed in file names; surrogates are not allowed in UTF-8
_FORBIDDEN_CHARACTERS = re.compile("[\0\ud800-\udfff]")


def text_problem(text: str) -> str:
    r"""Return the reason why a text cannot be stored in an FMU or a file; "" if they can.

    >>> text_problem("a\0"), text_problem("a")
    ('the character U+0000 is not allowed', '')
    """
    if len(text) > MAX_TEXT_LENGTH:
        return f"a text of {len(text)} characters is not allowed, expected at most {MAX_TEXT_LENGTH}"
    match = _FORBIDDEN_CHARACTERS.search(text)
    return f"the character U+{ord(match.group()):04X} is not allowed" if match else ""


def acceptable_text(text: str) -> str:
    """Return a text, shortened and without forbidden characters if `text_problem` refuses it."""
    return _FORBIDDEN_CHARACTERS.sub(REPLACEMENT, text if len(text) <= MAX_TEXT_LENGTH else shorten(text))


def shorten(text: str, length: int = MAX_QUOTATION_LENGTH) -> str:
    """Return the first `length` characters of a text, and the number of the others.

    >>> shorten("abcdef", 4), shorten("abcd", 4)
    ('abcd ... and 2 characters more', 'abcd')
    """
    rest = len(text) - length
    return text if rest <= 0 else f"{text[:length]} ... and {rest} character{'' if rest == 1 else 's'} more"
