"""Views of variables in arrays that hold the values of several variables."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from cosim.core.component import Ports, Variable


def variable_views(
    variables: Sequence[Variable], arrays: Mapping[np.dtype[Any], np.ndarray]
) -> Iterator[tuple[Variable, np.ndarray]]:
    """Yield each variable with a view of its values.

    Each array holds the variables of its dtype in order.
    """
    ends = dict.fromkeys(arrays, 0)
    for variable in variables:
        first = ends[variable.dtype]
        ends[variable.dtype] = first + len(variable.scalar_names)
        yield variable, arrays[variable.dtype][first : ends[variable.dtype]]


def views_in_parts(
    variables: Sequence[Variable], parts: Sequence[np.ndarray]
) -> Iterator[tuple[Variable, np.ndarray]]:
    """Yield each variable with a view of its values; the parts hold the variables in order."""
    remaining, part, first = iter(parts), np.zeros(0), 0
    for variable in variables:
        if first == len(part):
            part, first = next(remaining), 0
        end = first + len(variable.scalar_names)
        yield variable, part[first:end]
        first = end


def recorded_others(outputs: Ports) -> list[tuple[str, np.ndarray]]:
    """Return name and view of each recorded variable that is no output."""
    views = variable_views(outputs.variables, outputs.arrays)
    return [(variable.name, view) for variable, view in views if variable.causality != "output"]
