"""Horizontal position and velocity loops: from position reference to roll and pitch command."""

from __future__ import annotations

import math
from typing import Any

from .fleet import DEGREES_PER_RADIAN
from .fleet.pid import Pid
from .fleet.sampled_controller import SampledController


class PositionController(SampledController):
    """Cascade of position PIDs and velocity PIDs with tilt commands as outputs.

    The angles are in degrees inside and in rad outside. Errors in the world frame are rotated to
    the heading frame (forward, left). Gains of the published simulator, the same in
    controllers/modelica/PositionController.mo.
    """

    description = (
        "Horizontal position and velocity loops: from position reference to roll and pitch command"
    )

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter("position_P", 2.0, "1/s", "Speed per position error")
        self.parameter("position_I", 1.1, "1/s2", "Acceleration per position error")
        self.parameter("speed_limit", 2.0, "m/s", "Of the speed command, along each axis")
        self.parameter("velocity_P", 19.6600401691244, "deg.s/m", "Tilt per velocity error")
        self.parameter(
            "velocity_D", 0.259478709550943, "deg.s2/m", "Tilt per rate of the velocity error"
        )
        self.parameter("velocity_N", 3.0476144677615, "rad/s", "Bandwidth of the derivative filter")
        self.parameter("tilt_limit", 15.0, "deg", "Of roll and pitch command")
        for name in (
            "vehicle.position",
            "vehicle.velocity",
            "position_reference",
            "velocity_reference",
        ):
            unit = "m/s" if name.endswith(("velocity", "velocity_reference")) else "m"
            self.input(f"{name}.x", 0.0, unit, "East")
            self.input(f"{name}.y", 0.0, unit, "North")
        self.input("vehicle.attitude.yaw", 0.0, "rad", "Counter-clockwise from east")
        self.input(
            "reset", False, description="Holds the loops in their start state: level commands"
        )
        self.output("roll_command", 0.0, "rad", "Positive: left side up, accelerates to the right")
        self.output("pitch_command", 0.0, "rad", "Positive: nose down, accelerates forward")
        for loop in ("position_forward", "position_left", "velocity_forward", "velocity_left"):
            self.add_block(loop, Pid())

    def tick(self, time: float) -> None:
        """Compute the tilt commands."""
        c, s = math.cos(self.vehicle.attitude.yaw), math.sin(self.vehicle.attitude.yaw)
        x = self.position_reference.x - self.vehicle.position.x
        y = self.position_reference.y - self.vehicle.position.y
        feed, velocity = self.velocity_reference, self.vehicle.velocity
        forward = self._speed("forward", c * x + s * y, c * feed.x + s * feed.y)
        left = self._speed("left", c * y - s * x, c * feed.y - s * feed.x)
        self.pitch_command = (
            self._tilt("forward", forward - (c * velocity.x + s * velocity.y)) / DEGREES_PER_RADIAN
        )
        self.roll_command = (
            -self._tilt("left", left - (c * velocity.y - s * velocity.x)) / DEGREES_PER_RADIAN
        )

    def _speed(self, axis: str, error: float, feed_forward: float) -> float:
        pid: Pid = getattr(self, f"position_{axis}")
        limits = (-self.speed_limit, self.speed_limit)
        return pid(
            error, feed_forward, self.reset, P=self.position_P, I=self.position_I, limits=limits
        )

    def _tilt(self, axis: str, error: float) -> float:
        pid: Pid = getattr(self, f"velocity_{axis}")
        limits = (-self.tilt_limit, self.tilt_limit)
        return pid(
            error,
            reset=self.reset,
            P=self.velocity_P,
            D=self.velocity_D,
            N=self.velocity_N,
            limits=limits,
        )
