"""Waypoint guidance, speed and heading control of a vessel with thruster and rudder in one block."""

from __future__ import annotations

from .fleet.heading_control import HeadingControl
from .fleet.speed_control import SpeedControl
from .fleet.waypoint_guidance import WaypointGuidanceBase


class StriderAutopilot(WaypointGuidanceBase, SpeedControl, HeadingControl):
    """Guidance gives both references of a tick, the two loops follow them, as in scenarios/systems/strider_autopilot.json."""

    description = "Waypoint guidance, speed and heading control of a vessel with thruster and rudder in one block"

    def tick(self, time: float) -> None:
        self.control_speed(self.update_guidance())
        self.control_heading(self.heading_reference)
