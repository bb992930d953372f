"""Types and units of variables that a connection can convert."""

from __future__ import annotations

import numpy as np

from .component import Variable

INTEGER_TYPES = frozenset(
    {"Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64", "UInt64"}
)
FLOAT_TYPES = frozenset({"Float64", "Float32"})


def incompatibility(source: Variable, target: Variable, convert: bool = False) -> str:
    """Return the reason why values of `source` cannot be converted to `target`; "" if they can.

    Args:
        source: The output.
        target: The input.
        convert: Booleans and all integers are converted to floating-point numbers.
    """
    on_request = target.type in FLOAT_TYPES and source.type in INTEGER_TYPES | {"Boolean"}
    if not (_is_convertible(source, target) or (convert and on_request)):
        hint = ' unless the connection has "convert": true' if on_request else ""
        return f"type {source.type} cannot be converted to {target.type}{hint}"
    return unit_conflict(source, target)


def unit_conflict(source: Variable, target: Variable) -> str:
    """Return the reason why the units of two variables cannot be converted; "" if they can."""
    if source.unit and target.unit and not source.unit.converts_to(target.unit):
        return f'units "{source.unit.name}" and "{target.unit.name}" measure different quantities'
    return ""


def _is_convertible(source: Variable, target: Variable) -> bool:
    if source.type == target.type:
        return source.type != "Clock"
    if target.type in FLOAT_TYPES:
        exact = source.type in INTEGER_TYPES and source.dtype.itemsize < target.dtype.itemsize
        return source.type in FLOAT_TYPES or source.type == "Enumeration" or exact
    if source.type == "Enumeration":  # its values are small, whatever their type
        return target.type in ("Int32", "Int64")
    if target.type == "Enumeration":
        return source.type in INTEGER_TYPES - {"UInt64"}
    return {source.type, target.type} <= INTEGER_TYPES and bool(
        np.can_cast(source.dtype, target.dtype, "safe")
    )
