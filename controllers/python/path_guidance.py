"""Path command of the vessel: adaptive line of sight along straight legs."""

from __future__ import annotations

import math
from typing import Any

from .fleet import SAMPLE_PERIOD, horizontal_norm, limit, wrap_angle
from .waypoint_guidance import WaypointGuidance


class PathGuidance(WaypointGuidance):
    """Adaptive line of sight (ALOS); the same in controllers/modelica/Fleet/PathGuidance.mo."""

    description = (
        "Adaptive line of sight (ALOS) along the legs between waypoints, with an estimate of the "
        "crab angle"
    )
    running: bool
    leg: int
    start_x: float
    start_y: float
    end_x: float
    end_y: float
    course: float
    crab_angle: float

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self.parameter(
            "look_ahead", 1.5, "m", "Distance along the leg to the point that is aimed at"
        )
        self.parameter(
            "adaptation", 0.1, "rad/(m.s)", "Rate of the crab angle per cross-track error"
        )
        self.parameter("crab_limit", 1.0, "rad", "Largest crab angle")
        self.output("cross_track_error", 0.0, "m", "Positive: left of the leg")
        self.output("crab_angle", 0.0, "rad", "Estimate: course minus heading")
        self.local("running", False)
        self.local("leg", 0, description="Active waypoint when the leg began")
        for name in ("start_x", "start_y", "end_x", "end_y"):
            self.local(name, 0.0, "m", "Begin or end of the leg")
        self.local("course", 0.0, "rad", "Of the leg, counter-clockwise from east")

    def update_heading(self, ahead_x: float, ahead_y: float) -> None:
        """Set the heading reference and adapt the crab angle."""
        position = self.vehicle.position
        if not self.running:
            self.end_x, self.end_y, self.running = position.x, position.y, True
        if self.active_waypoint != self.leg:
            self._begin_leg()
        c, s = math.cos(self.course), math.sin(self.course)
        error = self.cross_track_error = c * (position.y - self.start_y) - s * (
            position.x - self.start_x
        )
        if self.finished:
            return
        self.heading_reference = wrap_angle(
            self.course - self.crab_angle - math.atan2(error, self.look_ahead)
        )
        rate = (
            SAMPLE_PERIOD
            * self.adaptation
            * error
            * self.look_ahead
            / horizontal_norm(self.look_ahead, error)
        )
        self.crab_angle = limit(self.crab_angle + rate, -self.crab_limit, self.crab_limit)

    def _begin_leg(self) -> None:
        self.leg = self.active_waypoint
        self.start_x, self.start_y = self.end_x, self.end_y
        self.end_x, self.end_y = self.waypoint_x[self.leg - 1], self.waypoint_y[self.leg - 1]
        self.course = math.atan2(self.end_y - self.start_y, self.end_x - self.start_x)
        self.crab_angle = 0.0
