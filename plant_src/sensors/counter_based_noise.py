"""Counter-based random numbers: a pure function of a seed and a sample number."""

import math
from collections.abc import Sequence
from hashlib import sha256

import numpy as np

_BLOCK_LENGTH = 256  # rows drawn at a time


class CounterBasedNoise:
    """Rows of independent standard normal numbers; row n depends on the key and n only.

    The generator is Philox (Salmon et al., "Parallel random numbers: as easy as 1, 2, 3", 2011), a
    function of a key and a counter. A step that is repeated after a rollback therefore draws the
    same numbers, and a state contains no generator. The key is hashed, so that neighbouring seeds,
    and equal seeds of sensors with different names, give independent numbers.

    Args:
        width: Numbers per row.
        key: Values whose `repr` identifies the sequence.
    """

    def __init__(self, width: int, *key: object):
        self._width = width
        self._key = int.from_bytes(sha256(repr(key).encode()).digest()[:16], "little")
        self._block, self._rows = -1, [[0.0]]

    def __getitem__(self, number: int) -> Sequence[float]:
        block, row = divmod(number, _BLOCK_LENGTH)
        if block != self._block:
            bits = np.random.Philox(key=self._key, counter=block << 64)
            self._rows = (
                np.random.Generator(bits).standard_normal((_BLOCK_LENGTH, self._width)).tolist()
            )
            self._block = block
        return self._rows[row]


def normal_to_uniform(normal: float) -> float:
    """Return the standard normal distribution function at `normal`.

    Maps normal numbers to uniform ones in (0, 1).
    """
    return 0.5 * math.erfc(-normal / math.sqrt(2))


def gauss_markov_factors(
    sigma: float, correlation_time: float, elapsed: float
) -> tuple[float, float]:
    """Return the factors of an exactly sampled first-order Gauss-Markov process.

    The process is x <- keep x + drive n with standard normal n. Its stationary standard deviation
    is `sigma`, its autocorrelation exp(-t / correlation_time).

    Args:
        sigma: Standard deviation.
        correlation_time: Time constant of the autocorrelation (s).
        elapsed: Time since the last sample (s).

    Returns:
        The factors keep and drive.
    """
    keep = math.exp(-elapsed / correlation_time)
    return keep, sigma * math.sqrt(-math.expm1(-2 * elapsed / correlation_time))


def advance_gauss_markov(
    value: float, sigma: float, correlation_time: float, elapsed: float, normal: float
) -> float:
    """Return the next value of a process of `gauss_markov_factors` for a standard normal number.

    The first value (`elapsed` is 0) is drawn from the stationary distribution.
    """
    if not elapsed:
        return sigma * normal
    keep, drive = gauss_markov_factors(sigma, correlation_time, elapsed)
    return keep * value + drive * normal
