"""Check of values against the variables to which a scenario or a Python caller assigns them."""

import json
import sys
from collections.abc import Sequence
from functools import partial
from itertools import chain
from typing import Any

import numpy as np

from ..core.component import Variable
from ..core.errors import did_you_mean
from ..core.json_values import parse_binary
from ..core.text import shorten, text_problem
from .schema_types import hint_at_quotes

_REALS = ("Float64", "Float32")


def check_value(variable: Variable, value: Any, all_elements: bool = False) -> Any:
    """Return a value, in the type of the variable, that can be assigned to it.

    Of an array the elements in row-major order.

    Args:
        variable: The variable.
        value: The value from the scenario or from a Python caller.
        all_elements: Refuse a list that is shorter than the array. By default the other elements
            keep their start values.

    Raises:
        ValueError: The variable does not accept the value.
    """
    if (
        variable.causality not in ("parameter", "structuralParameter", "input")
        and variable.start is None
    ):
        raise ValueError(
            f'"{variable.name}" is of causality {variable.causality} and cannot be set'
        )
    if variable.variability == "constant":
        description = variable.description and f": {variable.description}"
        raise ValueError(f'"{variable.name}" is a constant and cannot be set{description}')
    if variable.causality == "structuralParameter" and value != variable.start:
        raise ValueError(
            f'"{variable.name}" is a structural parameter, which is set before the start to a '
            "positive integer: it stays "
            f"{json.dumps(variable.start)}, found {quote_value(value)}"
        )
    if not variable.shape:
        return _scalar_value(variable, value)
    size = len(variable.scalar_names)
    if not isinstance(value, list):
        raise ValueError(
            f'"{variable.name}" is an array of {size} values, expected a list, found '
            f"{quote_value(value)}"
        )
    elements = _flatten(variable, value)
    if len(elements) > size or (all_elements and len(elements) < size):
        raise ValueError(
            f'"{variable.name}" takes {"" if all_elements else "at most "}{size} values, found '
            f"{len(elements)}"
        )
    return [
        *(_scalar_value(variable, element) for element in elements),
        *start_values(variable)[len(elements) :],
    ]


def _flatten(variable: Variable, value: list[Any]) -> list[Any]:
    """Return the elements of a list in row-major order.

    Nested lists must have the shape of the array.
    """
    if not any(isinstance(row, list) for row in value):
        return value
    if _nested_shape(value) != variable.shape:
        text = " x ".join(map(str, variable.shape))
        raise ValueError(
            f'"{variable.name}" is an array of {text} values, found {quote_value(value)}'
        )
    rows = value
    for _ in variable.shape[1:]:
        rows = list(chain.from_iterable(rows))
    return rows


def _nested_shape(value: Any) -> tuple[int, ...]:
    """Return the shape of nested lists; () if they are not rectangular."""
    if not isinstance(value, list):
        return ()
    shapes = {_nested_shape(row) for row in value}
    return (len(value), *shapes.pop()) if len(shapes) == 1 else ()


def start_values(variable: Variable) -> Sequence[Any]:
    """Return the start values of all elements of an array."""
    start, size = variable.start, len(variable.scalar_names)
    if variable.type == "Binary":
        is_list = isinstance(start, tuple)
        start = tuple(map(parse_binary, start)) if is_list else parse_binary(start or "")
    if start is None:
        start = {"String": "", "Binary": b""}.get(variable.type, 0)
    return start if isinstance(start, tuple) else (start,) * size


def _scalar_value(variable: Variable, value: Any) -> Any:
    """Return a scalar in the type of the variable.

    Raise ValueError if its type does not fit or it is out of range.
    """
    if isinstance(value, str) and (problem := text_problem(value)):
        raise ValueError(f'"{variable.name}": {problem}')
    if variable.items:
        items = dict(variable.items)
        if value in items:
            return items[value]
        if value in items.values() and not isinstance(value, bool):
            return value
        valid = ", ".join(f"{name} ({number})" for name, number in items.items())
        hint = did_you_mean(value, items) if isinstance(value, str) else ""
        raise ValueError(f'"{variable.name}" is one of {valid}, found {quote_value(value)}{hint}')
    if variable.type == "Binary" and isinstance(value, str):
        try:
            return parse_binary(value)
        except ValueError as error:
            raise ValueError(f'"{variable.name}" is of type Binary: {error}') from None
    if not _type_accepts(variable.type, value):
        hint = hint_at_quotes(value, partial(_type_accepts, variable.type))
        raise ValueError(
            f'"{variable.name}" is of type {variable.type}, found {quote_value(value)}{hint}'
        )
    low, high = _limits(variable)
    if (low is not None and value < low) or (high is not None and value > high):
        span = f"{'-inf' if low is None else low} ... {'inf' if high is None else high}"
        raise ValueError(f'"{variable.name}" must lie in {span}, found {quote_value(value)}')
    return float(value) if variable.type in _REALS else value


def quote_value(value: Any) -> str:
    """Return a value as JSON where that is possible, shortened."""
    return shorten(json.dumps(value, default=repr))


def _limits(variable: Variable) -> tuple[float | None, float | None]:
    """Return the variable's minimum and maximum, narrowed to the range of its data type."""
    low, high = variable.minimum, variable.maximum
    smallest: float
    largest: float
    if variable.dtype.kind in "iu":
        smallest, largest = np.iinfo(variable.dtype).min, np.iinfo(variable.dtype).max
    elif variable.type == "Float32":
        largest = float(np.finfo(np.float32).max)
        smallest = -largest
    else:
        return low, high
    lower = smallest if low is None else max(low, smallest)
    return lower, largest if high is None else min(high, largest)


def _type_accepts(kind: str, value: Any) -> bool:
    if kind == "Boolean" or isinstance(value, bool):
        return kind == "Boolean" and isinstance(value, bool)
    if kind in ("String", "Binary"):
        return isinstance(value, str if kind == "String" else bytes)
    return (
        isinstance(value, int | float) and abs(value) <= sys.float_info.max
        if kind in _REALS
        else isinstance(value, int)
    )
