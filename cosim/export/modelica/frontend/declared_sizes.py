"""Comparison of the sizes of arrays with those that the source text declares.

The front end enlarges an array of the model if a loop assigns elements beyond its size.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from ..model.syntax_tree import raise_model_error
from .sources import ModelicaSources

_SUBSCRIPTS = r"\[([^\[\]]*)\]\s*"


def check_declared_sizes(json: Mapping[str, Any], sources: ModelicaSources) -> None:
    """Raise InputError for the first variable of the model whose size is not the declared one.

    Sizes that are neither integers nor parameters with an integer as their value are not compared.
    """
    variables = json["variables"]
    for name, node in variables.items():
        declared = _declared_sizes(name, node, sources) if node["dims"] and "." not in name else []
        for text, size in zip(declared, node["dims"], strict=False):
            expected = _integer(text.strip(), variables)
            if expected is not None and len(declared) == len(node["dims"]) and expected != size:
                where = sources.locate(node["source_span"])
                raise_model_error(f"{name}: declared with size {expected}, but a loop assigns elements up to {size}", where)


def _declared_sizes(name: str, node: Mapping[str, Any], sources: ModelicaSources) -> list[str]:
    """Return the texts of the subscripts in a declaration, which stand before or after the name."""
    begin, end = sources.read(node["source_span"])
    before = re.search(rf"{_SUBSCRIPTS}{re.escape(name)}$", begin)
    after = re.match(rf"\s*{_SUBSCRIPTS}", end)
    return [] if bool(before) == bool(after) else (before or after)[1].split(",")  # type: ignore[index]


def _integer(text: str, variables: Mapping[str, Any]) -> int | None:
    """Return the value of an integer, or of a parameter that is bound to one; None for any other text."""
    if text.isdecimal():
        return int(text)
    match variables.get(text, {}).get("binding"):
        case {"Literal": {"value": {"Integer": int(value)}}}:
            return value
    return None
