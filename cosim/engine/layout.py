"""Where values lie: one array per dtype for all components, each component's values in one piece of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..component import Ports, Variable
from ..system import Endpoint

Dtype = np.dtype[Any]


class Slot(NamedTuple):
    """Where a value lies: in the array of its dtype, at this place."""

    dtype: Dtype
    offset: int


@dataclass(frozen=True, eq=False)
class Layout:
    """The arrays, each component's part of them, and the place of every slot."""

    arrays: Mapping[Dtype, np.ndarray]
    ports: Mapping[str, Ports]
    places: Mapping[Endpoint, Slot]


def lay_out(variables: Mapping[str, Sequence[Variable]]) -> Layout:
    """Lay out the given variables of each component, in the given order."""
    places: dict[Endpoint, Slot] = {}
    extents: dict[Dtype, int] = defaultdict(int)
    parts: dict[str, dict[Dtype, slice]] = defaultdict(dict)
    for name, owned in variables.items():
        for dtype in {variable.dtype: None for variable in owned}:
            first = extents[dtype]
            for slot in (slot for variable in owned if variable.dtype == dtype for slot in variable.slots):
                places[Endpoint(name, slot)] = Slot(dtype, extents[dtype])
                extents[dtype] += 1
            parts[name][dtype] = slice(first, extents[dtype])
    arrays = {dtype: _blank(dtype, extent) for dtype, extent in extents.items()}
    ports = {
        name: Ports(tuple(owned), {dtype: arrays[dtype][part] for dtype, part in parts[name].items()})
        for name, owned in variables.items()
    }
    return Layout(arrays, ports, places)


def _blank(dtype: Dtype, size: int) -> np.ndarray:
    return np.full(size, "", dtype) if dtype.hasobject else np.zeros(size, dtype)
