"""Recorded signals of one run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Recording:
    """Signals sampled at the recorded communication points.

    Attributes:
        time: Time of each row (s), shape (rows,); at an event two rows may have the same time.
        columns: Values of each signal by name, shape (rows,), in the type of the signal; strings
            have the dtype object.
        units: Unit of each signal by name, in Modelica syntax; "" if unknown.
    """

    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]

    @classmethod
    def empty(cls) -> Recording:
        """Return a recording without rows and columns."""
        return cls(np.empty(0), {}, {})
