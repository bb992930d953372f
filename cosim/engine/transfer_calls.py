"""Transfers of the pure Python executor: copies, conversions and delays as callables."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from .transfer_plan import Transfer

TransferCall = Callable[[], object]

#: number of values, or of contiguous runs, up to which copying one by one is faster than NumPy
MAX_SINGLE_COPIES = 4


def contiguous_views(transfer: Transfer) -> list[tuple[memoryview, memoryview]] | None:
    """Return (target, source) views of every contiguous run.

    None for many runs and for transfers that are not plain copies.
    """
    if (
        transfer.delay
        or transfer.factor is not None
        or transfer.source.dtype != transfer.target.dtype
        or transfer.source.dtype.hasobject
        or transfer.term_count
    ):
        return None
    targets, sources = transfer.target_indices, transfer.source_indices
    breaks = np.flatnonzero((np.diff(targets) != 1) | (np.diff(sources) != 1)) + 1
    runs = [slice(begin, end) for begin, end in pairwise([0, *breaks.tolist(), len(targets)])]
    if len(runs) > MAX_SINGLE_COPIES:
        return None
    return [
        (
            _contiguous_view(transfer.target, targets[run]),
            _contiguous_view(transfer.source, sources[run]),
        )
        for run in runs
    ]


def _contiguous_view(array: np.ndarray, indices: np.ndarray) -> memoryview:
    return array[indices[0] : indices[-1] + 1].data


def compile_transfer(transfer: Transfer) -> TransferCall:
    """Return a function that performs the transfer without its delay, with as few memory allocations as possible."""
    if transfer.term_count:
        return partial(_add_terms, transfer)
    first, count = int(transfer.target_indices[0]), len(transfer.target_indices)
    is_contiguous = np.array_equal(transfer.target_indices, np.arange(first, first + count))
    if (
        count <= MAX_SINGLE_COPIES
        and transfer.factor is None
        and _is_safe_cast(transfer.source.dtype, transfer.target.dtype)
    ):
        indices = list(
            zip(transfer.target_indices.tolist(), transfer.source_indices.tolist(), strict=True)
        )
        return partial(_copy_items, transfer.target.data, transfer.source.data, indices)
    if (
        transfer.factor is not None
        or transfer.source.dtype != transfer.target.dtype
        or not is_contiguous
    ):
        return partial(_scatter, transfer, transfer.source, transfer.source_indices)
    return partial(
        transfer.source.take,
        transfer.source_indices,
        None,
        transfer.target[first : first + count],
        "clip",
    )


def _is_safe_cast(source: np.dtype[Any], target: np.dtype[Any]) -> bool:
    """Return whether a memoryview of dtype `target` accepts every value of dtype `source`."""
    return not source.hasobject and (
        target.kind == "b" or bool(np.can_cast(source, target, "safe"))
    )


def _copy_items(target: memoryview, source: memoryview, indices: Sequence[tuple[int, int]]) -> None:
    for i, j in indices:
        target[i] = source[j]


def _scatter(transfer: Transfer, source: np.ndarray, indices: np.ndarray) -> None:
    values: Any = source[indices]
    if transfer.factor is not None:
        values = transfer.factor * values + transfer.offset
    transfer.target[transfer.target_indices] = values


def _add_terms(transfer: Transfer) -> None:
    first, *others = transfer.source_indices
    values = transfer.source[first]
    for indices in others:
        values += transfer.source[indices]
    transfer.target[transfer.target_indices] = values


class DelayLine:
    """Ring buffer of a delayed or linear transfer.

    During the first `delay` macro steps it delivers the initial outputs.
    """

    def __init__(self, transfer: Transfer):
        self.transfer = transfer
        #: source values, shape (delay, values)
        self.ring = np.empty((transfer.delay, len(transfer.source_indices)), transfer.source.dtype)
        #: duration to which the slopes of a linear transfer belong (s)
        self.step_size = transfer.step_size
        self._oldest = 0
        self._all = np.arange(len(transfer.source_indices))

    def fill(self) -> None:
        """Fill all rows with the current source values."""
        self.ring[:] = self.transfer.source[self.transfer.source_indices]

    def shorten_step(self, step_size: float | None) -> None:
        """Set the size of the present step (s), to which slopes between its ends belong.

        None: it is not shorter.
        """
        if self.transfer.interpolates:
            self.step_size = step_size or self.transfer.step_size

    def restore(self, ring: np.ndarray) -> None:
        """Restore a copy of the ring in which the oldest row comes first."""
        self.ring[:], self._oldest = ring, 0

    def align_ring(self, transfers: int) -> None:
        """Rotate the ring so that the oldest row comes first, after `transfers` transfers made by the native executor."""
        self.ring[:] = np.roll(self.ring, -(self._oldest + transfers), 0)
        self._oldest = 0

    def deliver_line(self) -> None:
        """Deliver values and slopes of a linear transfer, without storing the current source values."""
        transfer, (before,) = self.transfer, self.ring
        now = transfer.source[transfer.source_indices]
        slopes = (now - before) / self.step_size
        transfer.target[transfer.slope_indices] = (
            slopes if transfer.factor is None else transfer.factor * slopes
        )
        _scatter(transfer, before if transfer.interpolates else now, self._all)

    def apply(self) -> None:
        """Deliver the oldest values and replace them by the current source values."""
        oldest = self.ring[self._oldest]
        if self.transfer.slope_indices is None:
            _scatter(self.transfer, oldest, self._all)
        else:
            self.deliver_line()
        oldest[:] = self.transfer.source[self.transfer.source_indices]
        self._oldest = (self._oldest + 1) % len(self.ring)
