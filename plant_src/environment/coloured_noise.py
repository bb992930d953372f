"""Random generators by seed and name, and coloured noise on a fixed time grid.

The noise is a pure function of seed, name and grid index.

A channel is white noise filtered by (1 + b T s) / (1 + T s)^2, or 1 / (1 + T s), discretised
exactly: on the grid it has the variance, autocorrelation and joint distribution of the continuous
process, for any T. With

    T x1' = -x1 + white,  T x2' = -x2 + x1,  y = b x1 + (1 - b) x2      (b = 1: first order)

the covariances are P11 = p, P12 = P22 = p / 2, and the variance of y is b^2 p + (1 - b)^2 p / 2 + b
(1 - b) p.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """Return the random number generator of `seed` and `names`.

    Other seeds and names give statistically independent numbers. PCG64 and its seeding are fixed,
    so equal arguments give equal numbers on all machines.
    """
    key = int.from_bytes("/".join(names).encode(), "big")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, key])))


#: time step of the grid, over which a value is constant (s)
GRID_STEP = 0.01

#: number of grid points that are computed together
BLOCK_LENGTH = 256


@dataclass(frozen=True)
class Channel:
    """Noise with a standard deviation, a time constant T (s) and a lead b.

    With b = 1 the filter is of first order.
    """

    deviation: float
    time_constant: float
    lead: float = 1.0


class ColouredNoise:
    """Several channels of noise for each of several names.

    `noise[k]` holds the values from k GRID_STEP to (k + 1) GRID_STEP.

    A step of the grid is x1 <- a x1 + n1, x2 <- a (x2 + g x1) + n2, with correlated white noises n1
    and n2.

    Args:
        seed: Seed of all random numbers of the world.
        names: Names, which have independent noise; that of a name does not depend on the others.
        channels: Filters of each name.
    """

    def __init__(self, seed: int, names: Sequence[str], channels: Sequence[Channel]):
        self._seed, self._names, self._channel_count = seed, names, len(channels)
        filters = [(c.deviation, c.time_constant, c.lead) for c in channels] * len(names)
        deviation, time_constant, lead = np.array(filters).T[:, :, None]
        p = deviation**2 / (lead**2 + (1 - lead) ** 2 / 2 + lead * (1 - lead))
        # Exact discretisation (Van Loan): a step multiplies the states x1, x2 by the matrix
        # exponential, and noise with the covariance P - propagated P keeps P stationary. The
        # Cholesky factor of that covariance makes such a noise from two white ones.
        self._g = g = GRID_STEP / time_constant
        self._a = a = np.exp(-g)
        self._lead = lead
        propagated = a**2 * np.array(
            [p, p * (g + 1 / 2), p * (g**2 + g + 1 / 2)]
        )  # P11, P12, P22 after a step without noise
        self._noise_root = _covariance_root(*(np.array([p, p / 2, p / 2]) - propagated))
        white = self._white_noise((), 1)
        #: x1 and x2 at the start of each block computed so far
        self._block_start_states = [_correlated(_covariance_root(p, p / 2, p / 2), white)]
        self._block_number, self._values = -1, [()]

    def __getitem__(self, index: int) -> tuple[float, ...]:
        number, row = divmod(index, BLOCK_LENGTH)
        return self.values_in_block(number)[row]

    def values_in_block(self, number: int) -> Sequence[tuple[float, ...]]:
        """Return the values of a block: all names and channels, a tuple for each grid index.

        It begins at the grid index `number` BLOCK_LENGTH.
        """
        if number != self._block_number:
            for missing in range(len(self._block_start_states) - 1, number):
                self._compute(missing)
            self._compute(number)
        return self._values

    def _compute(self, number: int) -> None:
        """Compute one block, whose start states must be known."""
        # White noise follows from seed, name and block number, so a block is repeated at any time
        # from the states at its start, of which all computed blocks keep two numbers.
        n1, n2 = _correlated(self._noise_root, self._white_noise((str(number),), BLOCK_LENGTH))
        start1, start2 = self._block_start_states[number]
        x1 = _first_order_recursion(self._a, start1, n1)
        x2 = _first_order_recursion(self._a, start2, self._a * self._g * x1[:, :-1] + n2)
        if number + 1 == len(self._block_start_states):
            self._block_start_states.append(np.array([x1[:, -1:], x2[:, -1:]]))
        values = self._lead * x1[:, :-1] + (1 - self._lead) * x2[:, :-1]
        self._block_number, self._values = (
            number,
            list(zip(*self._map_channels(values).tolist(), strict=True)),
        )

    def _white_noise(self, part: Sequence[str], count: int) -> np.ndarray:
        """Return two white noises of all names and channels, shape (2, names x channels, count)."""
        shape = (2, self._channel_count, count)
        return np.concatenate(
            [generator(self._seed, name, *part).standard_normal(shape) for name in self._names],
            axis=1,
        )

    def _map_channels(self, values: np.ndarray) -> np.ndarray:
        """Map channel values, shape (names x channels, BLOCK_LENGTH), to the published values.

        A hook for subclasses.
        """
        return values


def _covariance_root(c11: np.ndarray, c12: np.ndarray, c22: np.ndarray) -> tuple[np.ndarray, ...]:
    """Return r11, r21, r22 of the Cholesky factor of each channel's covariance matrix (2, 2)."""
    r11 = np.sqrt(c11)
    r21 = np.divide(c12, r11, out=np.zeros_like(r11), where=r11 > 0)
    return r11, r21, np.sqrt(np.maximum(c22 - r21**2, 0))


def _correlated(root: Sequence[np.ndarray], white: np.ndarray) -> np.ndarray:
    """Return two noises with the covariance of `root` from two white ones.

    Both have the shape (2, channels, n).
    """
    r11, r21, r22 = root
    return np.array([r11 * white[0], r21 * white[0] + r22 * white[1]])


def _first_order_recursion(a: np.ndarray, start: np.ndarray, forcing: np.ndarray) -> np.ndarray:
    """Return x[k + 1] = a x[k] + forcing[k] with x[0] = start along the last axis.

    The doubling scan needs log2(n) array operations: in step s each x[k] takes a^(2^s) x[k - 2^s],
    so that it then holds the forcings of 2^(s + 1) predecessors.
    """
    x, reach, power = np.concatenate([start, forcing], axis=1), 1, a
    while reach < x.shape[1]:
        x[:, reach:] += power * x[:, :-reach]
        reach, power = 2 * reach, power**2
    return x
