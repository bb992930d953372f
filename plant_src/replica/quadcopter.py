"""Published cascaded controller of the quadcopter, one class per block.

Signals have the conventions of `bus.py`. Angles between blocks are in rad and throttles in %;
inside the loops angles are in degrees, as the published gains require. Two published errors are
kept: world velocities are used as forward and left velocities, and the yaw error is not wrapped.
"""

import math
from typing import Any

from .bus import ROTORS
from .fmu_base import Pid, ReplicaFmu

POSITION_INPUTS = ("vehicle.position.x", "vehicle.position.y")
TARGET_INPUTS = ("target.position.x", "target.position.y")


class Vtol(ReplicaFmu):
    """Altitude reference (m, world) of take-off, approach and landing.

    The reference is `altitude_command` before `landing_time`, then `approach_altitude`, and 0 while
    the quadcopter is low and within `landing_error` (m) of the target. The logic has no state: a
    larger error ends the descent, and the motors never stop.
    """

    description = "Switching logic of take-off, approach and landing"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs(*POSITION_INPUTS, "vehicle.position.z", *TARGET_INPUTS)
        self.declare_parameters(
            altitude_command=1.0,
            landing_time=5.0,
            enabled=1.0,
            approach_altitude=1.0,
            landing_error=0.1,
        )
        self.declare_outputs("altitude_reference", "horizontal_error")

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute horizontal error and altitude reference."""
        value = self.values
        position = [value[name] for name in POSITION_INPUTS]
        target = [value[name] for name in TARGET_INPUTS]
        value["horizontal_error"] = math.dist(position, target)
        value["altitude_reference"] = self._reference(current_time)
        return True

    def _reference(self, time: float) -> float:
        value = self.values
        if not value["enabled"] or time < value["landing_time"]:
            return value["altitude_command"]
        high = value["vehicle.position.z"] >= value["approach_altitude"] + 0.1
        return (
            value["approach_altitude"]
            if high or value["horizontal_error"] > value["landing_error"]
            else 0.0
        )


class PositionController(ReplicaFmu):
    """Position and velocity loops to phi (rad, right side down) and theta (rad, nose up)."""

    description = "Position and velocity loops"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs(
            *POSITION_INPUTS,
            "vehicle.velocity.x",
            "vehicle.velocity.y",
            "vehicle.attitude.psi",
            *TARGET_INPUTS,
        )
        self.declare_outputs("phi_command", "theta_command")
        self._x = self.register_pid(
            "position_x", Pid(2.0, 1.1, lower=-2.0, upper=2.0, clamping=True)
        )
        self._y = self.register_pid("position_y", Pid(2.0, 1.1, lower=-2.0, upper=2.0))
        self._u, self._v = (
            self.register_pid("velocity_x", _create_tilt_pid()),
            self.register_pid("velocity_y", _create_tilt_pid()),
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the tilt commands."""
        value = self.values
        forward, left = self._error()
        u_command, v_command = self._x.step(forward, step_size), self._y.step(left, step_size)
        theta = -self._u.step(u_command - value["vehicle.velocity.x"], step_size)
        phi = -self._v.step(v_command - value["vehicle.velocity.y"], step_size)
        value["phi_command"], value["theta_command"] = math.radians(phi), math.radians(theta)
        return True

    def _error(self) -> tuple[float, float]:
        """Return the distance to the target forward and to the left (m)."""
        x, y = (
            self.values[target] - self.values[own]
            for target, own in zip(TARGET_INPUTS, POSITION_INPUTS, strict=True)
        )
        cos, sin = (
            math.cos(-self.values["vehicle.attitude.psi"]),
            math.sin(-self.values["vehicle.attitude.psi"]),
        )
        return x * cos + y * sin, y * cos - x * sin


def _create_tilt_pid() -> Pid:
    """Return a loop from velocity error (m/s) to tilt (deg)."""
    return Pid(19.6600401691244, 0.0, 0.259478709550943, 3.0476144677615, lower=-15.0, upper=15.0)


class AltitudeController(ReplicaFmu):
    """Altitude loop with the output throttle (%); it has no feed-forward of the hover throttle."""

    description = "Altitude loop"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs("altitude_reference", "vehicle.position.z")
        self.declare_outputs("throttle")
        loop = Pid(
            170.242040782586, 28.86184465251, 50.0, 50.0, lower=35.0, upper=90.0, clamping=True
        )
        self._loop = self.register_pid("altitude", loop)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the throttle."""
        error = self.values["altitude_reference"] - self.values["vehicle.position.z"]
        self.values["throttle"] = self._loop.step(error, step_size)
        return True


class AttitudeController(ReplicaFmu):
    """Attitude loops with the outputs roll, pitch and yaw throttle differences (%)."""

    description = "Roll, pitch and yaw loops"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        angles = ("phi", "theta", "psi")
        self.declare_inputs(
            *(f"{angle}_command" for angle in angles),
            *(f"vehicle.attitude.{angle}" for angle in angles),
        )
        self.declare_outputs("roll", "pitch", "yaw")
        yaw_gains = (0.665668467901894, 0.340149010656045, 0.313800354221384, 96.4244783671056)
        loops = (
            Pid(0.3217, 0.4324, 0.0583, 100.0, lower=-20.0, upper=20.0),
            Pid(0.3217336, 0.4324, 0.0583122, 100.0, lower=-20.0, upper=20.0),
            Pid(*yaw_gains, lower=-10.0, upper=10.0, clamping=True),
        )
        names = ("roll", "pitch", "yaw")
        self._loops = [
            (a, n, self.register_pid(f"{n}_loop", loop))
            for a, n, loop in zip(angles, names, loops, strict=True)
        ]

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the throttle differences."""
        for angle, name, loop in self._loops:
            error = self.values[f"{angle}_command"] - self.values[f"vehicle.attitude.{angle}"]
            self.values[name] = loop.step(math.degrees(error), step_size)
        return True


class Mixer(ReplicaFmu):
    """Control mixing with the output throttles (%) of the rotors front, left, rear, right."""

    description = "Control mixing"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs("collective", "roll", "pitch", "yaw")
        self.declare_outputs(*(f"throttle[{i}]" for i in ROTORS))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the throttles."""
        collective, roll, pitch, yaw = (
            self.values[name] for name in ("collective", "roll", "pitch", "yaw")
        )
        sums = (
            collective - yaw + pitch,
            collective + yaw + roll,
            collective - yaw - pitch,
            collective + yaw - roll,
        )
        for i, throttle in zip(ROTORS, sums, strict=True):
            self.values[f"throttle[{i}]"] = min(100.0, max(0.0, throttle))
        return True
