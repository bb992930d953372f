"""Vessel autopilot for course and speed: a minimal complete example of a controller in Python."""

from __future__ import annotations

import math
from types import SimpleNamespace

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class CourseKeeper(Fmi2Slave):
    """Proportional speed control by thrust and PD course control by rudder.

    The yaw rate is the derivative. A positive rudder angle turns the bow to starboard and reduces
    the yaw angle. SI units, angles in rad.
    """

    description = "Keeps a course and a speed"
    units = {
        **{
            "vehicle.attitude.yaw": "rad",
            "vehicle.velocity_body.u": "m/s",
            "vehicle.rates.r": "rad/s",
        },
        **{
            "course_command": "rad",
            "speed_command": "m/s",
            "course_P": "1",
            "course_D": "s",
            "rudder_limit": "rad",
        },
        **{"speed_P": "N.s/m", "thrust_limit": "N", "thrust": "N", "rudder_angle": "rad"},
    }

    def __init__(self, **arguments: object):
        super().__init__(**arguments)
        self.vehicle = SimpleNamespace(
            attitude=SimpleNamespace(yaw=0.0),
            velocity_body=SimpleNamespace(u=0.0),
            rates=SimpleNamespace(r=0.0),
        )
        self.course_command, self.speed_command = 0.0, 1.0
        self.course_P, self.course_D, self.rudder_limit = 1.5, 0.8, math.radians(35)
        self.speed_P, self.thrust_limit = 82.65, 3.0
        self.thrust, self.rudder_angle = 0.0, 0.0

        for name in ("vehicle.attitude.yaw", "vehicle.velocity_body.u", "vehicle.rates.r"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in (
            "course_command",
            "speed_command",
            "course_P",
            "course_D",
            "rudder_limit",
            "speed_P",
            "thrust_limit",
        ):
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
            )
        for name in ("thrust", "rudder_angle"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute thrust and rudder angle from the inputs at the start of the step."""
        error = self.vehicle.attitude.yaw - self.course_command
        error = math.atan2(math.sin(error), math.cos(error))
        rudder = self.course_P * error + self.course_D * self.vehicle.rates.r
        thrust = self.speed_P * (self.speed_command - self.vehicle.velocity_body.u)
        self.rudder_angle = max(-self.rudder_limit, min(self.rudder_limit, rudder))
        self.thrust = max(-self.thrust_limit, min(self.thrust_limit, thrust))
        return True
