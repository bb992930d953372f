"""Speed loop of a vessel."""

from __future__ import annotations

from typing import Any

from .pid import Pid
from .sampled_controller import SampledController


class SpeedControl(SampledController):
    """Proportional control of the surge speed by thrust; gain of the published simulator."""

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter("speed_P", 82.65, "N.s/m", "Thrust per speed error")
        self.parameter("thrust_limit", 3.0, "N")
        self.input("vehicle.velocity_body.u", 0.0, "m/s", "Forward")
        self.output("thrust", 0.0, "N")
        self.surge = self.add_block("surge", Pid())

    def control_speed(self, reference: float) -> None:
        """Set the thrust of this sample for a surge speed `reference` (m/s)."""
        limits = (-self.thrust_limit, self.thrust_limit)
        self.thrust = self.surge(
            reference - self.vehicle.velocity_body.u, P=self.speed_P, limits=limits
        )
