"""Random numbers as a function of a seed and a sample number: the same whoever asks, whenever and however often."""

from __future__ import annotations

import math
from collections.abc import Sequence
from hashlib import sha256

import numpy as np

_BLOCK_LENGTH = 256  # rows drawn at a time


class CounterBasedNoise:
    """Standard normal numbers in rows of `width`, all independent of each other.

    Row n follows from the key and n alone: numbers come from Philox (Salmon et al., "Parallel random numbers: as easy as
    1, 2, 3", 2011), a function of a key and a counter. The key is hashed, so that neighbouring seeds and equal seeds of
    differently named sensors have nothing in common.
    """

    def __init__(self, width: int, *key: object):
        self._width = width
        self._key = int.from_bytes(sha256(repr(key).encode()).digest()[:16], "little")
        self._block, self._rows = -1, [[0.0]]

    def __getitem__(self, number: int) -> Sequence[float]:
        block, row = divmod(number, _BLOCK_LENGTH)
        if block != self._block:
            bits = np.random.Philox(key=self._key, counter=block << 64)
            self._rows = np.random.Generator(bits).standard_normal((_BLOCK_LENGTH, self._width)).tolist()
            self._block = block
        return self._rows[row]


def normal_to_uniform(normal: float) -> float:
    """A standard normal number as one that is uniform between 0 and 1."""
    return 0.5 * math.erfc(-normal / math.sqrt(2))


def gauss_markov_factors(sigma: float, correlation_time: float, elapsed: float) -> tuple[float, float]:
    """Factors (keep, drive) of x <- keep x + drive n, n standard normal: a first-order Gauss-Markov process, sampled exactly.

    Its standard deviation is `sigma` once it is stationary, its autocorrelation exp(-t / correlation_time).
    """
    keep = math.exp(-elapsed / correlation_time)
    return keep, sigma * math.sqrt(-math.expm1(-2 * elapsed / correlation_time))
