"""Connection from plant to controllers of the published simulator."""

from __future__ import annotations

from typing import Any

from .fmu_base import ReplicaFmu
from .interface import OUTPUTS


class Bus(ReplicaFmu):
    """Delay of one sample for all 22 signals.

    The first outputs are zero, as in the published handshake.

    It is stepped before the controllers, which therefore receive the plant's signals of 10 ms ago.
    A connection with "delay": 1 differs only in the first sample.
    """

    description = "Delay of one sample that starts at zero"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self._names = [variable.name for variable in OUTPUTS]
        self.declare_inputs(*(f"plant.{name}" for name in self._names))
        self.declare_states(**{f"stored.{name}": 0.0 for name in self._names})
        self.declare_outputs(*self._names)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Output the stored signals and store the present ones."""
        value = self.values
        for name in self._names:
            value[name] = value[f"stored.{name}"]
            value[f"stored.{name}"] = value[f"plant.{name}"]
        return True
