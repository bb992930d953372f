"""Roll, pitch and yaw loops: from attitude commands to throttle differences."""

from __future__ import annotations

from typing import Any

from .fleet import DEGREES_PER_RADIAN, wrap_angle
from .fleet.pid import Pid
from .fleet.sampled_controller import SampledController


class AttitudeController(SampledController):
    """PIDs from angle errors to throttle differences (%).

    The errors are in degrees, commands and measurements in rad. Gains of the published
    simulator, the same in controllers/modelica/AttitudeController.mo.
    """

    description = "Roll, pitch and yaw loops: from attitude commands to throttle differences"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self._declare_parameters()
        self.input("vehicle.attitude.roll", 0.0, "rad", "Positive: left side up")
        self.input("vehicle.attitude.pitch", 0.0, "rad", "Positive: nose down")
        self.input(
            "vehicle.attitude.yaw", 0.0, "rad", "Positive: counter-clockwise seen from above"
        )
        self.input("roll_command", 0.0, "rad")
        self.input("pitch_command", 0.0, "rad")
        self.input("yaw_command", 0.0, "rad")
        self.input(
            "reset", False, description="Holds the loops in their start state: no differences"
        )
        self.output("roll_difference", 0.0, "%", "Positive: raises the left side")
        self.output("pitch_difference", 0.0, "%", "Positive: lowers the nose")
        self.output("yaw_difference", 0.0, "%", "Positive: turns counter-clockwise")
        self.roll, self.pitch, self.yaw = (
            self.add_block(axis, Pid()) for axis in ("roll", "pitch", "yaw")
        )

    def _declare_parameters(self) -> None:
        self.parameter("roll_P", 0.3217, "%/deg")
        self.parameter("roll_I", 0.4324, "%/(deg.s)")
        self.parameter("roll_D", 0.0583, "%.s/deg")
        self.parameter("pitch_P", 0.3217336, "%/deg")
        self.parameter("pitch_I", 0.4324, "%/(deg.s)")
        self.parameter("pitch_D", 0.0583122, "%.s/deg")
        self.parameter(
            "tilt_N", 100.0, "rad/s", "Bandwidth of the derivative filters of roll and pitch"
        )
        self.parameter("tilt_limit", 20.0, "%", "Of the roll and pitch differences")
        self.parameter("yaw_P", 0.665668467901894, "%/deg")
        self.parameter("yaw_I", 0.340149010656045, "%/(deg.s)")
        self.parameter("yaw_D", 0.313800354221384, "%.s/deg")
        self.parameter(
            "yaw_N", 96.4244783671056, "rad/s", "Bandwidth of the derivative filter of yaw"
        )
        self.parameter("yaw_limit", 10.0, "%", "Of the yaw difference")

    def tick(self, time: float) -> None:
        """Compute the throttle differences."""
        attitude, tilt, yaw = (
            self.vehicle.attitude,
            (-self.tilt_limit, self.tilt_limit),
            (-self.yaw_limit, self.yaw_limit),
        )
        self.roll_difference = self._loop(
            "roll", DEGREES_PER_RADIAN * (self.roll_command - attitude.roll), self.tilt_N, tilt
        )
        self.pitch_difference = self._loop(
            "pitch", DEGREES_PER_RADIAN * (self.pitch_command - attitude.pitch), self.tilt_N, tilt
        )
        self.yaw_difference = self._loop(
            "yaw", DEGREES_PER_RADIAN * wrap_angle(self.yaw_command - attitude.yaw), self.yaw_N, yaw
        )

    def _loop(self, axis: str, error: float, N: float, limits: tuple[float, float]) -> float:
        gains = {gain: getattr(self, f"{axis}_{gain}") for gain in "PID"}
        pid: Pid = getattr(self, axis)
        return pid(error, reset=self.reset, N=N, limits=limits, **gains)
