"""Line of sight to the active waypoint, which a circle of acceptance switches on."""

from __future__ import annotations

import math
from collections.abc import Sequence

from . import WAYPOINT_CAPACITY, EndPolicy, length


class WaypointGuidance:
    """`heading` (rad, counter-clockwise from east) and `distance` (m) to the waypoint number `active` (from 1)."""

    def __init__(self) -> None:
        self.active, self.finished = 1, False
        self.heading, self.distance = 0.0, 0.0

    def __call__(
        self, x: float, y: float, waypoints: Sequence[tuple[float, float]], radius: float, end_policy: EndPolicy | int
    ) -> None:
        """One tick at the position (x, y) in m; a waypoint is reached within `radius` (m)."""
        if not 1 <= len(waypoints) <= WAYPOINT_CAPACITY:
            raise ValueError(f"waypoint_count is not between 1 and {WAYPOINT_CAPACITY}")
        self.active = min(self.active, len(waypoints))
        if not self.finished and length(*self._ahead(x, y, waypoints)) <= radius:
            self._advance(len(waypoints), end_policy)
        ahead_x, ahead_y = self._ahead(x, y, waypoints)
        self.distance = length(ahead_x, ahead_y)
        if not self.finished:
            self.heading = math.atan2(ahead_y, ahead_x)

    def _ahead(self, x: float, y: float, waypoints: Sequence[tuple[float, float]]) -> tuple[float, float]:
        waypoint_x, waypoint_y = waypoints[self.active - 1]
        return waypoint_x - x, waypoint_y - y

    def _advance(self, count: int, end_policy: int) -> None:
        if self.active < count:
            self.active += 1
        elif end_policy == EndPolicy.REPEAT:
            self.active = 1
        else:
            self.finished = True
