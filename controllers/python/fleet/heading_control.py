"""Heading loop of a vessel."""

from __future__ import annotations

from typing import Any

from . import wrap_angle
from .pid import Pid
from .sampled_controller import SampledController


class HeadingControl(SampledController):
    """PD control of the wrapped heading error by the rudder.

    Gains for a rudder behind the centre of mass.
    """

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter("heading_P", 1.5, "1", "Rudder angle per heading error")
        self.parameter("heading_D", 0.8, "s", "Rudder angle per rate of the heading error")
        self.parameter("heading_N", 21.4165136740303, "rad/s", "Bandwidth of the derivative filter")
        self.parameter("rudder_limit", 0.610865238198015, "rad", "35 degrees")
        self.input("vehicle.attitude.yaw", 0.0, "rad", "Counter-clockwise from east")
        self.output("rudder_angle", 0.0, "rad", "Positive: bow to starboard")
        self.yaw = self.add_block("yaw", Pid())

    def control_heading(self, reference: float) -> None:
        """Set the rudder angle of this sample for a heading (rad, counter-clockwise from east)."""
        # a positive rudder angle reduces the yaw angle
        error = wrap_angle(self.vehicle.attitude.yaw - reference)
        limits = (-self.rudder_limit, self.rudder_limit)
        self.rudder_angle = self.yaw(
            error, P=self.heading_P, D=self.heading_D, N=self.heading_N, limits=limits
        )
