"""Heading loop: from heading reference to the rudder angle of a vessel."""

from __future__ import annotations

from typing import Any

from .fleet.heading_control import HeadingControl


class HeadingController(HeadingControl):
    """Heading control with the rudder; the same in controllers/modelica/HeadingController.mo."""

    description = "Heading loop: from heading reference to the rudder angle of a vessel"

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.input("heading_reference", 0.0, "rad", "Counter-clockwise from east")

    def tick(self, time: float) -> None:
        """Compute the rudder angle."""
        self.control_heading(self.heading_reference)
