"""Random number generators that depend only on a seed and names."""

from __future__ import annotations

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """Return the random number generator of `seed` and `names`.

    Other seeds and names give statistically independent numbers. PCG64 and its seeding are fixed,
    so equal arguments give equal numbers on all machines.
    """
    key = int.from_bytes("/".join(names).encode(), "big")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, key])))
