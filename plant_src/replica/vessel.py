"""Published guidance and autopilot of the vessel."""

import math
from typing import Any

from .fmu_base import Pid, ReplicaFmu

MAX_WAYPOINTS = 32


class Waypoints(ReplicaFmu):
    """Line-of-sight guidance: course (rad, in [0, 2 pi)) to the current waypoint.

    The next waypoint follows one sample after the vessel enters `acceptance_radius` (m), as
    published. The last waypoint stays current; in the published simulator its index becomes
    invalid.
    """

    description = "Line of sight to waypoints"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs("vehicle.position.x", "vehicle.position.y")
        self.declare_parameters(acceptance_radius=0.5, waypoint_count=1.0)
        self.declare_parameters(
            **{f"waypoint_{axis}[{i}]": 0.0 for axis in "xy" for i in range(1, MAX_WAYPOINTS + 1)}
        )
        self.declare_states(was_inside=1.0, old_distance=0.0)
        self.declare_outputs("course_command", "waypoint")
        self.values["waypoint"] = 1.0

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Select the waypoint and compute the course."""
        value = self.values
        inside = float(value["old_distance"] <= value["acceptance_radius"])
        if inside > value["was_inside"] and value["waypoint"] < value["waypoint_count"]:
            value["waypoint"] += 1
        i = int(value["waypoint"])
        x, y = (value[f"waypoint_{axis}[{i}]"] - value[f"vehicle.position.{axis}"] for axis in "xy")
        value["was_inside"], value["old_distance"] = inside, math.hypot(x, y)
        value["course_command"] = math.atan2(y, x) % (2 * math.pi)
        return True


class Autopilot(ReplicaFmu):
    """Autopilot: thrust (N) by the speed error, rudder angle (rad) by the heading error.

    The thrust is proportional; the rudder has a PD law for the wrapped error.
    """

    description = "Speed and heading control"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.declare_inputs(
            "vehicle.velocity.x", "vehicle.velocity.y", "vehicle.attitude.yaw", "course_command"
        )
        self.declare_parameters(speed_command=0.0)
        self.declare_outputs("thrust", "rudder_angle")
        largest = math.radians(35)
        self._speed = self.register_pid("speed", Pid(82.65, lower=-3.0, upper=3.0))
        self._heading = self.register_pid(
            "heading", Pid(0.5, 0.0, 0.6, 21.4165136740303, lower=-largest, upper=largest)
        )

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute thrust and rudder angle."""
        value = self.values
        error = (value["vehicle.attitude.yaw"] - value["course_command"] + math.pi) % (
            2 * math.pi
        ) - math.pi
        value["rudder_angle"] = self._heading.step(error, step_size)
        value["thrust"] = self._speed.step(value["speed_command"] - self._surge(), step_size)
        return True

    def _surge(self) -> float:
        """Return the velocity along the heading (m/s)."""
        yaw = self.values["vehicle.attitude.yaw"]
        return (
            math.cos(yaw) * self.values["vehicle.velocity.x"]
            + math.sin(yaw) * self.values["vehicle.velocity.y"]
        )
