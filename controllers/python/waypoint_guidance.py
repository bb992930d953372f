"""Path command of the vessel: line-of-sight guidance with a speed reference."""

from __future__ import annotations

from typing import Any

from .fleet.waypoint_guidance import WaypointGuidanceBase


class WaypointGuidance(WaypointGuidanceBase):
    """Heading and speed reference from the position of the vessel and a list of waypoints."""

    description = "Line of sight to the active waypoint, which a circle of acceptance switches on"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.output("speed_reference", 0.0, "m/s", "Forward")

    def tick(self, time: float) -> None:
        """Compute heading and speed reference."""
        self.speed_reference = self.update_guidance()
