"""Random numbers that depend on nothing but a seed and a name."""

from __future__ import annotations

import numpy as np


def generator(seed: int, *names: str) -> np.random.Generator:
    """A generator of its own for everything that is random: other names and other seeds give unrelated numbers.

    PCG64 and the way it is seeded are fixed, so equal arguments give equal numbers on every machine.
    """
    key = int.from_bytes("/".join(names).encode(), "big")
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence([seed, key])))
