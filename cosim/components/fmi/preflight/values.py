"""Numbers in the lexical forms of XML Schema.

Python accepts more forms, such as "1_000" and "nan".
"""

from __future__ import annotations

import re

_FLOAT = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN")
_INTEGER = re.compile(r"[+-]?[0-9]{1,20}")
_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}


def parse_value(word: str, kind: str) -> float | int | bool:
    """Parse one value of a numeric FMI type.

    Args:
        word: The text.
        kind: FMI 3.0 type name: a float or integer type, Boolean or Enumeration.

    Raises:
        ValueError: The text is not a value of the type.
    """
    if kind == "Boolean":
        if word not in _BOOLEANS:
            raise ValueError(word)
        return _BOOLEANS[word]
    return parse_float(word) if kind.startswith("Float") else _parse_integer(word, kind)


def parse_float(word: str) -> float:
    """Parse a floating-point number, which may be infinite or NaN.

    Raises:
        ValueError: The text is not a number.
    """
    if not _FLOAT.fullmatch(word.strip()):
        raise ValueError(word)
    return float(word)


def _parse_integer(word: str, kind: str) -> int:
    if not _INTEGER.fullmatch(word.strip()):
        raise ValueError(word)
    bits = 64 if kind == "Enumeration" else int(kind.removeprefix("U").removeprefix("Int"))
    low, high = (
        (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    )
    if not low <= int(word) <= high:
        raise ValueError(word)
    return int(word)
