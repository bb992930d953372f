"""Unrolling of for-equations that the front end has unrolled only in part.

For these, rumoca's document contains the equations of the first iterations and a template for all
iterations. The equations of the other iterations are placeholders such as `der(x[3]) = 0.0`, in
which only the left side is correct.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product
from typing import Any

from .expression_reader import Json


def unroll_equations(json: Json, section: str) -> Iterator[tuple[int, Json]]:
    """Generate the equations of all for-equations that may have placeholders.

    Args:
        json: rumoca's document of the flat model.
        section: The key of the for-equations.

    Yields:
        The index in the list of equations, and the equation that belongs there.
    """
    for family in json[section]:
        if not family["interiors_materialized"]:
            yield from _unroll(family)


def _unroll(family: Json) -> Iterator[tuple[int, Json]]:
    """Generate the equations for all combinations of the loop indices.

    The last index varies fastest.
    """
    binders = family["domain"]["binders"]
    ranges = [
        range(b["lower"], b["upper"] + (1 if b["step"] > 0 else -1), b["step"]) for b in binders
    ]
    bodies = family["template"]["body"]
    for number, (indices, body) in enumerate(product(product(*ranges), bodies)):
        yield (
            family["first_equation_index"] + number,
            _substitute_indices(body, dict(zip(_index_names(binders), indices, strict=True))),
        )


def _index_names(binders: list[Json]) -> list[str]:
    return [binder["display_name"] for binder in binders]


def _substitute_indices(node: Any, indices: Mapping[str, int]) -> Any:
    """Return the tree with the loop indices replaced by numbers."""
    if isinstance(node, list):
        return [_substitute_indices(item, indices) for item in node]
    if not isinstance(node, dict):
        return node
    if "VarRef" in node and (number := indices.get(node["VarRef"]["name"]["name"])) is not None:
        return {"Literal": {"value": {"Integer": number}}}
    return {key: _substitute_indices(value, indices) for key, value in node.items()}
