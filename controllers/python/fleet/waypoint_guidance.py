"""Line-of-sight guidance through waypoints with circles of acceptance."""

from __future__ import annotations

import math
from typing import Any

from . import MAX_WAYPOINTS, EndPolicy, horizontal_norm
from .sampled_controller import SampledController


class WaypointGuidanceBase(SampledController):
    """Line-of-sight guidance: heading reference and distance to the active waypoint.

    A waypoint is reached within `acceptance_radius` (circle of acceptance, Fossen (2021), chapter
    12).
    """

    active_waypoint: int
    finished: bool

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter("speed_command", 1.0, "m/s", "On the way")
        self.parameter(
            "acceptance_radius", 0.5, "m", "Of the circle around a waypoint that counts as reached"
        )
        self.parameter("waypoint_count", 1, description="Waypoints in use")
        self.parameter("waypoint_x", [0.0] * MAX_WAYPOINTS, "m", "East")
        self.parameter("waypoint_y", [0.0] * MAX_WAYPOINTS, "m", "North")
        self.parameter(
            "end_policy", 1, description="After the last waypoint: 1 stop, 2 repeat, 3 keep course"
        )
        self.input("vehicle.position.x", 0.0, "m", "East")
        self.input("vehicle.position.y", 0.0, "m", "North")
        self.output("heading_reference", 0.0, "rad", "Counter-clockwise from east")
        self.output("distance", 0.0, "m", "To the active waypoint")
        self.output("active_waypoint", 1)
        self.output(
            "finished",
            False,
            description="The last waypoint is reached and the list does not repeat",
        )

    def update_guidance(self) -> float:
        """Set the outputs of this sample.

        Returns:
            Speed reference (m/s); 0 after the last waypoint with the end policy `STOP`.

        Raises:
            ValueError: `waypoint_count` is out of range.
        """
        if not 1 <= self.waypoint_count <= MAX_WAYPOINTS:
            raise ValueError(f"waypoint_count is not between 1 and {MAX_WAYPOINTS}")
        self.active_waypoint = min(self.active_waypoint, self.waypoint_count)
        if (
            not self.finished
            and horizontal_norm(*self._vector_to_waypoint()) <= self.acceptance_radius
        ):
            self._select_next_waypoint()
        ahead_x, ahead_y = self._vector_to_waypoint()
        self.distance = horizontal_norm(ahead_x, ahead_y)
        self.update_heading(ahead_x, ahead_y)
        return 0.0 if self.finished and self.end_policy == EndPolicy.STOP else self.speed_command

    def update_heading(self, ahead_x: float, ahead_y: float) -> None:
        """Set the heading reference from the vector to the active waypoint (m).

        It is constant after the last waypoint.
        """
        if not self.finished:
            self.heading_reference = math.atan2(ahead_y, ahead_x)

    def _vector_to_waypoint(self) -> tuple[float, float]:
        """Return the vector from the vessel to the active waypoint (m, east and north)."""
        position, active = self.vehicle.position, self.active_waypoint - 1
        return self.waypoint_x[active] - position.x, self.waypoint_y[active] - position.y

    def _select_next_waypoint(self) -> None:
        if self.active_waypoint < self.waypoint_count:
            self.active_waypoint += 1
        elif self.end_policy == EndPolicy.REPEAT:
            self.active_waypoint = 1
        else:
            self.finished = True
