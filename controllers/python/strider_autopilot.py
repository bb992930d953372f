"""Waypoint guidance, speed and heading control of a vessel with thruster and rudder."""

from __future__ import annotations

from .fleet.heading_control import HeadingControl
from .fleet.speed_control import SpeedControl
from .fleet.waypoint_guidance import WaypointGuidanceBase


class StriderAutopilot(WaypointGuidanceBase, SpeedControl, HeadingControl):
    """Guidance, speed and heading control in one sample.

    It is equivalent to scenarios/systems/strider_autopilot.json.
    """

    description = (
        "Waypoint guidance, speed and heading control of a vessel with thruster and rudder in one "
        "block"
    )

    def tick(self, time: float) -> None:
        """Update the guidance, then thrust and rudder angle."""
        self.control_speed(self.update_guidance())
        self.control_heading(self.heading_reference)
