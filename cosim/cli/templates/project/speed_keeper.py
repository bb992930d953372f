"""Vessel autopilot for speed and course as a PythonFMU class.

It runs in process or, exported, as an FMU.
"""

import math
from types import SimpleNamespace

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

INPUTS = ("vehicle.attitude.yaw", "vehicle.velocity_body.u", "vehicle.rates.r")
OUTPUTS = ("thrust", "rudder_angle")
PARAMETERS = (
    *("speed_command", "speed_P", "speed_I", "thrust_limit"),
    *("course_command", "course_P", "course_D", "rudder_limit"),
)


class SpeedKeeper(Fmi2Slave):
    """Autopilot for speed and course; SI units, angles in rad, yaw counter-clockwise from east."""

    description = "Keeps a speed and a course"

    def __init__(self, **arguments: object):
        super().__init__(**arguments)
        self.vehicle = SimpleNamespace(
            attitude=SimpleNamespace(yaw=0.0),
            velocity_body=SimpleNamespace(u=0.0),
            rates=SimpleNamespace(r=0.0),
        )
        self.speed_command, self.speed_P, self.speed_I, self.thrust_limit = 1.0, 82.65, 10.0, 3.0
        self.course_command, self.course_P, self.course_D, self.rudder_limit = (
            0.0,
            1.5,
            0.8,
            math.radians(35),
        )
        self.thrust, self.rudder_angle = 0.0, 0.0
        self.speed_integral = 0.0

        for name in INPUTS:
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in PARAMETERS:
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable)
            )
        for name in OUTPUTS:
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.register_variable(Real("speed_integral", causality=Fmi2Causality.local))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the outputs of a step from the measurements at its start."""
        self.thrust = self._thrust(self.speed_command - self.vehicle.velocity_body.u, step_size)
        self.rudder_angle = self._rudder_angle(self.vehicle.attitude.yaw - self.course_command)
        return True

    def _thrust(self, error: float, step_size: float) -> float:
        """Return the thrust of a PI controller of the speed.

        Its integral is constant while the thrust is at its limit.
        """
        thrust = self.speed_P * error + self.speed_integral
        if abs(thrust) < self.thrust_limit:
            self.speed_integral += self.speed_I * step_size * error
        return limited(thrust, self.thrust_limit)

    def _rudder_angle(self, error: float) -> float:
        """Return the rudder angle of a PD controller of the course.

        A positive rudder angle turns the bow to starboard, which reduces the yaw angle.
        """
        error = math.atan2(math.sin(error), math.cos(error))
        return limited(
            self.course_P * error + self.course_D * self.vehicle.rates.r, self.rudder_limit
        )


def limited(value: float, limit: float) -> float:
    """Return `value` limited to the range from `-limit` to `limit`."""
    return max(-limit, min(limit, value))
