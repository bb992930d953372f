"""Arrays of all vehicles of a world in one buffer, so that one copy saves their state."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import TypeVar

import numpy as np

_Key = TypeVar("_Key", bound=Hashable)


class VehicleArrays:
    """Named arrays of all vehicles.

    Those with the same name lie side by side, in the order of the vehicles.

    Args:
        sizes: For each vehicle its arrays, as name to size.

    Attributes:
        buffer: All numbers; the other arrays are views of it.
        of_all_vehicles: For each name the numbers of all vehicles.
        of_vehicle: For each vehicle its arrays by name.
    """

    def __init__(self, sizes: Sequence[Mapping[str, int]]):
        names = dict.fromkeys(name for size in sizes for name in size)
        totals = {name: sum(size.get(name, 0) for size in sizes) for name in names}
        self.buffer = np.zeros(sum(totals.values()))
        self.of_all_vehicles = _split(self.buffer, totals)
        views = {
            name: _split(
                self.of_all_vehicles[name], {k: size.get(name, 0) for k, size in enumerate(sizes)}
            )
            for name in names
        }
        self.of_vehicle = [{name: views[name][k] for name in size} for k, size in enumerate(sizes)]


def _split(array: np.ndarray, sizes: Mapping[_Key, int]) -> dict[_Key, np.ndarray]:
    """Return consecutive views of an array."""
    ends = np.cumsum(list(sizes.values())).tolist()
    return {
        key: array[end - size : end] for (key, size), end in zip(sizes.items(), ends, strict=True)
    }
