"""Speed loop: from speed reference to the thrust of a vessel."""

from __future__ import annotations

from typing import Any

from .fleet.speed_control import SpeedControl


class SpeedController(SpeedControl):
    """Surge speed control; the same in controllers/modelica/SpeedController.mo."""

    description = "Speed loop: from speed reference to the thrust of a vessel"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.input("speed_reference", 0.0, "m/s", "Forward")

    def tick(self, time: float) -> None:
        """Compute the thrust."""
        self.control_speed(self.speed_reference)
