"""How the pure Python executor moves values."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from .transfer_plan import Transfer

TransferCall = Callable[[], object]

#: up to so many values, or runs of neighbours, are faster copied one by one than by numpy
MAX_SINGLE_COPIES = 4


def contiguous_views(gather: Transfer) -> list[tuple[memoryview, memoryview]] | None:
    """(target, source) for every run of neighbours; None when they are many or when there is more to do than to copy them."""
    if gather.delay or gather.factor is not None or gather.source.dtype != gather.target.dtype or gather.source.dtype.hasobject:
        return None
    to, from_ = gather.target_indices, gather.source_indices
    breaks = np.flatnonzero((np.diff(to) != 1) | (np.diff(from_) != 1)) + 1
    runs = [slice(begin, end) for begin, end in pairwise([0, *breaks.tolist(), len(to)])]
    if len(runs) > MAX_SINGLE_COPIES:
        return None
    return [(_contiguous_view(gather.target, to[run]), _contiguous_view(gather.source, from_[run])) for run in runs]


def _contiguous_view(array: np.ndarray, neighbours: np.ndarray) -> memoryview:
    return array[neighbours[0] : neighbours[-1] + 1].data


def compile_transfer(gather: Transfer) -> TransferCall:
    """The gather, its delay left aside, as one call that allocates as little as numpy allows."""
    first, count = int(gather.target_indices[0]), len(gather.target_indices)
    together = np.array_equal(gather.target_indices, np.arange(first, first + count))
    if count <= MAX_SINGLE_COPIES and gather.factor is None and _is_safe_cast(gather.source.dtype, gather.target.dtype):
        places = list(zip(gather.target_indices.tolist(), gather.source_indices.tolist(), strict=True))
        return partial(_copy_items, gather.target.data, gather.source.data, places)
    if gather.factor is not None or gather.source.dtype != gather.target.dtype or not together:
        return partial(_scatter, gather, gather.source, gather.source_indices)
    return partial(gather.source.take, gather.source_indices, None, gather.target[first : first + count], "clip")


def _is_safe_cast(source: np.dtype[Any], target: np.dtype[Any]) -> bool:
    """Whether every value of `source` may be assigned through a memoryview, which refuses what does not fit."""
    return not source.hasobject and (target.kind == "b" or bool(np.can_cast(source, target, "safe")))


def _copy_items(target: memoryview, source: memoryview, places: Sequence[tuple[int, int]]) -> None:
    for i, j in places:
        target[i] = source[j]


def _scatter(gather: Transfer, source: np.ndarray, indices: np.ndarray) -> None:
    values: Any = source[indices]
    if gather.factor is not None:
        values = gather.factor * values + gather.offset
    gather.target[gather.target_indices] = values


class DelayLine:
    """A gather whose values arrive `delay` macro steps late; until then the initial outputs do."""

    def __init__(self, gather: Transfer):
        self.transfer = gather
        #: one row per macro step of delay
        self.ring = np.empty((gather.delay, len(gather.source_indices)), gather.source.dtype)
        self._oldest = 0
        self._all = np.arange(len(gather.source_indices))

    def fill(self) -> None:
        """Take the present values as those of all steps before."""
        self.ring[:] = self.transfer.source[self.transfer.source_indices]

    def align_ring(self, moves: int) -> None:
        """Put the rows in the order of their age, after so many moves that someone else has made."""
        self.ring[:] = np.roll(self.ring, -moves, 0)

    def apply(self) -> None:
        oldest = self.ring[self._oldest]
        _scatter(self.transfer, oldest, self._all)
        oldest[:] = self.transfer.source[self.transfer.source_indices]
        self._oldest = (self._oldest + 1) % len(self.ring)
