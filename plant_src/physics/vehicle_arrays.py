"""The numbers of all vehicles of a world, in one block: to copy it is to save their state."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from typing import TypeVar

import numpy as np

_Key = TypeVar("_Key", bound=Hashable)


class VehicleArrays:
    """Named pieces; in each the numbers of the first vehicle come first, then those of the second, and so on.

    `sizes` has for each vehicle how many numbers it needs in which pieces. `whole` maps the name of a piece to the numbers of
    all vehicles, `parts` has the same for each vehicle alone. All of them are views of `block`.
    """

    def __init__(self, sizes: Sequence[Mapping[str, int]]):
        names = dict.fromkeys(name for size in sizes for name in size)
        totals = {name: sum(size.get(name, 0) for size in sizes) for name in names}
        self.buffer = np.zeros(sum(totals.values()))
        self.of_all_vehicles = _split(self.buffer, totals)
        shares = {
            name: _split(self.of_all_vehicles[name], {k: size.get(name, 0) for k, size in enumerate(sizes)}) for name in names
        }
        self.of_vehicle = [{name: shares[name][k] for name in size} for k, size in enumerate(sizes)]


def _split(array: np.ndarray, sizes: Mapping[_Key, int]) -> dict[_Key, np.ndarray]:
    """Consecutive parts of an array."""
    ends = np.cumsum(list(sizes.values())).tolist()
    return {key: array[end - size : end] for (key, size), end in zip(sizes.items(), ends, strict=True)}
