"""For-equations that the front end has left rolled up: it writes down the first points and a template for all of them.

The other points stand in its list of equations as placeholders such as `der(x[3]) = 0.0`, whose left sides alone are true.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

from .expression_reader import Json


def unroll_equations(json: Json, section: str) -> Iterator[tuple[int, Json]]:
    """For every equation that may be a placeholder, its place in the list of equations and what stands there in truth."""
    for family in json[section]:
        if not family["interiors_materialized"]:
            yield from _unroll(family)


def _unroll(family: Json) -> Iterator[tuple[int, Json]]:
    """All combinations of the loop indices, the last one running fastest."""
    binders = family["domain"]["binders"]
    ranges = [range(b["lower"], b["upper"] + (1 if b["step"] > 0 else -1), b["step"]) for b in binders]
    bodies = family["template"]["body"]
    for number, (indices, body) in enumerate(product(product(*ranges), bodies)):
        yield (
            family["first_equation_index"] + number,
            _substitute_indices(body, dict(zip(_index_names(binders), indices, strict=True))),
        )


def _index_names(binders: list[Json]) -> list[str]:
    return [binder["display_name"] for binder in binders]


def _substitute_indices(node: Any, indices: Mapping[str, int]) -> Any:
    """The tree with numbers in the place of loop indices."""
    if isinstance(node, list):
        return [_substitute_indices(item, indices) for item in node]
    if not isinstance(node, dict):
        return node
    if "VarRef" in node and (number := indices.get(node["VarRef"]["name"]["name"])) is not None:
        return {"Literal": {"value": {"Integer": number}}}
    return {key: _substitute_indices(value, indices) for key, value in node.items()}
