"""What the run loop hands over: the recorded signals of one run, column by column."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Recording:
    """Signals sampled at the recorded communication points.

    `time` (s) has shape (rows,); two rows may carry one time at an event. `columns` maps the name of each signal to its
    values, shape (rows,), in recorded order and in the signal's own type: float64, integers, bool, object for strings.
    `units` holds the unit of each signal in Modelica syntax, "" where it is unknown.
    """

    time: np.ndarray
    columns: Mapping[str, np.ndarray]
    units: Mapping[str, str]

    @classmethod
    def empty(cls) -> Recording:
        """No rows and no columns."""
        return cls(np.empty(0), {}, {})
