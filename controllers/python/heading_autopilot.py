"""Heading loop of a vessel with integral action and a wave filter."""

from __future__ import annotations

from typing import Any

from .fleet import wrap_angle
from .fleet.notch import Notch
from .fleet.pid import Pid
from .fleet.sampled_controller import SampledController


class HeadingAutopilot(SampledController):
    """PID control of the notch-filtered heading error.

    The same in controllers/modelica/HeadingAutopilot.mo.
    """

    description = "Heading loop of a vessel with integral action and a wave filter"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter("heading_P", 1.5, "1", "Rudder angle per heading error")
        self.parameter("heading_I", 0.3, "1/s", "Rate of the rudder angle per heading error")
        self.parameter("heading_D", 0.8, "s", "Rudder angle per rate of the heading error")
        self.parameter("heading_N", 10.0, "rad/s", "Bandwidth of the derivative filter")
        self.parameter("rudder_limit", 0.610865238198015, "rad", "35 degrees")
        self.parameter(
            "wave_period", 1.25, "s", "Of the encountered waves, which the rudder does not follow"
        )
        self.parameter(
            "wave_depth",
            0.1,
            "1",
            "Damping ratio of the zeros of the wave filter; equal to wave_width: no filter",
        )
        self.parameter("wave_width", 0.4, "1", "Damping ratio of its poles")
        self.input("vehicle.attitude.yaw", 0.0, "rad", "Counter-clockwise from east")
        self.input("heading_reference", 0.0, "rad", "Counter-clockwise from east")
        self.output("rudder_angle", 0.0, "rad", "Positive: bow to starboard")
        self.waves = self.add_block("waves", Notch())
        self.yaw = self.add_block("yaw", Pid())

    def tick(self, time: float) -> None:
        """Compute the rudder angle; a positive one reduces the yaw angle."""
        error = wrap_angle(self.vehicle.attitude.yaw - self.heading_reference)
        filtered = self.waves(error, self.wave_period, self.wave_depth, self.wave_width)
        gains = {"P": self.heading_P, "I": self.heading_I, "D": self.heading_D, "N": self.heading_N}
        self.rudder_angle = self.yaw(
            filtered, limits=(-self.rudder_limit, self.rudder_limit), **gains
        )
