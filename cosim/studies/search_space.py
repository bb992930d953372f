"""Parameters of a search as coordinates in the unit cube."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from .design import interpolate
from .schema import ParameterSpec


def parameter_values(
    parameters: Sequence[ParameterSpec], point: Sequence[float]
) -> dict[str, float]:
    """Return the values of parameters by name at a point in the unit cube.

    They are within their bounds and rounded to 12 digits, so that they are equal on all machines.
    """
    return {spec.name: _value(spec, float(x)) for spec, x in zip(parameters, point, strict=True)}


def parameter_settings(
    parameters: Sequence[ParameterSpec], values: Mapping[str, float]
) -> dict[str, float]:
    """Return the settings of the scenario for values of parameters."""
    return {path: values[each.name] for each in parameters for path in each.set}


def start_coordinates(parameters: Sequence[ParameterSpec]) -> list[float]:
    """Return the start of the search in the unit cube.

    A parameter without a start value begins in the middle.
    """
    return [0.5 if each.start is None else _coordinate(each, each.start) for each in parameters]


def _value(spec: ParameterSpec, coordinate: float) -> float:
    value = interpolate(coordinate, spec.min, spec.max, spec.scale == "log")
    if spec.whole:
        return min(max(round(value), math.ceil(spec.min)), math.floor(spec.max))
    if unit := spec.multiple_of:
        count = min(
            max(round(value / unit), math.ceil(spec.min / unit)), math.floor(spec.max / unit)
        )
        return float(f"{count * unit:.12g}")
    return min(max(float(f"{value:.12g}"), spec.min), spec.max)


def _coordinate(spec: ParameterSpec, value: float) -> float:
    if spec.scale == "log":
        return math.log(value / spec.min) / math.log(spec.max / spec.min)
    return (value - spec.min) / (spec.max - spec.min)
