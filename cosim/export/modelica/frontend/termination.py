"""Replacement of `terminate()` in algorithms, which the front end refuses, by `assert()` with a marked message."""

from __future__ import annotations

import re

#: beginning of the message of an assertion that stands for terminate()
MARK = "terminate: "

_TOKEN = re.compile(
    r'//[^\n]*|/\*.*?\*/|"(?:[^"\\]|\\.)*"|\b(?P<section>algorithm|equation)\b|(?P<call>\bterminate\s*\()',
    re.DOTALL,
)


def replace_terminate(text: str) -> str:
    """Return a Modelica text with assertions instead of `terminate()` in its algorithms.

    The lines are unchanged.

    >>> replace_terminate('algorithm when b then terminate("late"); end when;')
    'algorithm when b then assert(false, "terminate: " + "late"); end when;'
    """
    section = ""

    def change(token: re.Match[str]) -> str:
        nonlocal section
        section = token["section"] or section
        return (
            f'assert(false, "{MARK}" + ' if token["call"] and section == "algorithm" else token[0]
        )

    return _TOKEN.sub(change, text)
