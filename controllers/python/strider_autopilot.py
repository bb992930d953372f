"""Waypoint guidance, surge speed and heading control of a vessel with thruster and rudder."""

from __future__ import annotations

from typing import Any

from .fleet import WAYPOINT_CAPACITY, EndPolicy, wrap_angle
from .fleet.pid import Pid
from .fleet.sampled import Sampled
from .fleet.waypoint_guidance import WaypointGuidance


class StriderAutopilot(Sampled):
    """Line of sight to the waypoints; thrust from the speed error, rudder from the heading error.

    A positive rudder angle turns the bow to starboard and so reduces the yaw angle. Gains of the published simulator,
    the same in controllers/modelica/StriderAutopilot.mo.
    """

    description = "Waypoint guidance, surge speed and heading control of a vessel with thruster and rudder"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self._declare_parameters()
        self.input("vehicle.position.x", 0.0, "m", "East")
        self.input("vehicle.position.y", 0.0, "m", "North")
        self.input("vehicle.attitude.yaw", 0.0, "rad", "Counter-clockwise from east")
        self.input("vehicle.velocity_body.u", 0.0, "m/s", "Forward")
        self.output("thrust", 0.0, "N")
        self.output("rudder_angle", 0.0, "rad", "Positive: bow to starboard")
        self.output("heading_reference", 0.0, "rad", "Counter-clockwise from east")
        self.output("distance", 0.0, "m", "To the active waypoint")
        self.output("active_waypoint", 1)
        self.output("finished", False, description="The last waypoint is reached and the list does not repeat")
        self.guidance = self.block("guidance", WaypointGuidance())
        self.surge, self.heading = self.block("surge", Pid()), self.block("heading", Pid())

    def _declare_parameters(self) -> None:
        self.parameter("speed_command", 1.0, "m/s")
        self.parameter("acceptance_radius", 0.5, "m", "Of the circle around a waypoint that counts as reached")
        self.parameter("waypoint_count", 1, description="Waypoints in use")
        self.parameter("waypoint_x", [0.0] * WAYPOINT_CAPACITY, "m", "East")
        self.parameter("waypoint_y", [0.0] * WAYPOINT_CAPACITY, "m", "North")
        self.parameter("end_policy", 1, description="After the last waypoint: 1 stop, 2 repeat, 3 keep course")
        self.parameter("speed_P", 82.65, "N.s/m", "Thrust per speed error")
        self.parameter("thrust_limit", 3.0, "N")
        self.parameter("heading_P", 1.5, "1", "Rudder angle per heading error")
        self.parameter("heading_D", 0.8, "s", "Rudder angle per rate of the heading error")
        self.parameter("heading_N", 21.4165136740303, "rad/s", "Bandwidth of the derivative filter")
        self.parameter("rudder_limit", 0.610865238198015, "rad", "35 degrees")

    def tick(self, time: float) -> None:
        waypoints = list(zip(self.waypoint_x, self.waypoint_y, strict=True))[: max(0, self.waypoint_count)]
        if len(waypoints) < self.waypoint_count:
            raise ValueError(f"waypoint_count is {self.waypoint_count}, above {WAYPOINT_CAPACITY}")
        position = self.vehicle.position
        self.guidance(position.x, position.y, waypoints, self.acceptance_radius, self.end_policy)
        self.heading_reference, self.distance = self.guidance.heading, self.guidance.distance
        self.active_waypoint, self.finished = self.guidance.active, self.guidance.finished
        self.thrust = self._surge_control()
        self.rudder_angle = self._heading_control()

    def _surge_control(self) -> float:
        speed = 0.0 if self.finished and self.end_policy == EndPolicy.STOP else self.speed_command
        limits = (-self.thrust_limit, self.thrust_limit)
        return self.surge(speed - self.vehicle.velocity_body.u, P=self.speed_P, limits=limits)

    def _heading_control(self) -> float:
        error = wrap_angle(self.vehicle.attitude.yaw - self.heading_reference)
        limits = (-self.rudder_limit, self.rudder_limit)
        return self.heading(error, P=self.heading_P, D=self.heading_D, N=self.heading_N, limits=limits)
