"""Check that connected outputs are finite."""

from __future__ import annotations

import ctypes

import numpy as np

from ..core.errors import ComponentError
from .plan import Plan

_FLOAT_DTYPES = (np.dtype(np.float64), np.dtype(np.float32))


class FiniteCheck:
    """Check of the connected float outputs for NaN and infinity; does nothing if the settings allow these."""

    def __init__(self, plan: Plan, current_time: ctypes.c_double):
        self._plan, self._current_time, self._enabled = plan, current_time, plan.settings.require_finite

    @property
    def monitored_floats(self) -> list[np.ndarray]:
        """Arrays to monitor after each macro step; a value in them that is not finite requires a call of `run`."""
        arrays = self._plan.outputs.arrays
        return [arrays[dtype] for dtype in _FLOAT_DTYPES if dtype in arrays and self._enabled]

    def run(self, function: str = "do_step") -> None:
        """Check the source of every connection.

        Args:
            function: the function that computed the outputs, for the message.

        Raises:
            ComponentError: a connected output is NaN or infinite.
        """
        if not self._enabled:
            return
        outputs = self._plan.outputs
        for connection in self._plan.system.connections:
            position = outputs.positions[connection.source]
            if position.dtype in _FLOAT_DTYPES and not np.isfinite(value := outputs.arrays[position.dtype][position.offset]):
                text = f'the output "{connection.source.scalar}" is {value}, and {connection.target} reads it'
                raise ComponentError(connection.source.component, function, text, self._current_time.value)
