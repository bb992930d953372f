"""Zig-zag test of a vessel with two propellers."""

from __future__ import annotations

import math
from typing import Any

from .fleet.sampled_controller import SampledController


class Zigzag(SampledController):
    """Open-loop orders of a zig-zag test (IMO resolution MSC.137(76), 5.2.3).

    The vessel goes straight ahead until `start_time`, then turns to starboard. The order is
    reversed whenever the heading differs by `angle` from the original course on the side of the
    turn.
    """

    description = "Zig-zag test of a vessel with a port and a starboard propeller"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.input("vehicle.attitude.yaw", 0.0, "rad", "Counter-clockwise from east")
        self.output("propeller_speed", [0.0, 0.0], "rad/s", "Port, starboard")
        self.output(
            "side",
            0.0,
            "1",
            "To which the vessel is ordered to turn: 1 port, -1 starboard, 0 neither",
        )
        self.parameter("start_time", 30.0, "s", "Of the first order")
        self.parameter(
            "angle",
            math.radians(20),
            "rad",
            "Off the original course, at which the order is reversed",
        )
        self.parameter(
            "outer_speed",
            100.0,
            "rad/s",
            "Of both propellers ahead, and of the outer one in a turn",
        )
        self.parameter("inner_speed", 60.0, "rad/s", "Of the inner propeller in a turn")
        self.local("course", 0.0, "rad", "Heading at the first order")

    side: float

    def tick(self, time: float) -> None:
        """Reverse the order if the heading has changed enough, and set the propeller speeds."""
        yaw = self.vehicle.attitude.yaw
        if self.side == 0.0:
            self.course = yaw
            self.side = -1.0 if time >= self.start_time else 0.0
        turned = math.atan2(math.sin(yaw - self.course), math.cos(yaw - self.course))
        if self.side * turned >= self.angle:
            self.side = -self.side
        inner = {-1.0: 1, 1.0: 0}.get(self.side)
        self.propeller_speed[:] = [
            self.inner_speed if index == inner else self.outer_speed for index in (0, 1)
        ]
