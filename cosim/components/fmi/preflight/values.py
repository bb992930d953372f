"""Numbers as XML Schema writes them; Python would read more ("1_000", "nan", other digits) than other tools do."""

from __future__ import annotations

import re

_FLOAT = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?|[+-]?INF|NaN")
_INTEGER = re.compile(r"[+-]?[0-9]{1,20}")
_BOOLEANS = {"true": True, "1": True, "false": False, "0": False}


def parse_value(word: str, kind: str) -> float | int | bool:
    """The value of one word for an FMI type. Raises ValueError when the type has no such value."""
    if kind == "Boolean":
        if word not in _BOOLEANS:
            raise ValueError(word)
        return _BOOLEANS[word]
    return parse_float(word) if kind.startswith("Float") else _parse_integer(word, kind)


def parse_float(word: str) -> float:
    """A floating-point number, which may be infinite or NaN. Raises ValueError."""
    if not _FLOAT.fullmatch(word.strip()):
        raise ValueError(word)
    return float(word)


def _parse_integer(word: str, kind: str) -> int:
    if not _INTEGER.fullmatch(word.strip()):
        raise ValueError(word)
    bits = 64 if kind == "Enumeration" else int(kind.removeprefix("U").removeprefix("Int"))
    low, high = (0, 2**bits - 1) if kind.startswith("U") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
    if not low <= int(word) <= high:
        raise ValueError(word)
    return int(word)
