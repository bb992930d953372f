"""Vessel autopilot along waypoints as a PythonFMU class.

It runs in process or, exported, as an FMU.
"""

import math
from types import SimpleNamespace

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Integer, Real

WAYPOINTS = range(32)
INPUT_UNITS = {
    **{"vehicle.position.x": "m", "vehicle.position.y": "m", "vehicle.attitude.yaw": "rad"},
    **{"vehicle.velocity_body.u": "m/s", "vehicle.rates.r": "rad/s"},
}
PARAMETER_UNITS = {
    **{
        "speed_command": "m/s",
        "acceptance_radius": "m",
        "speed_P": "N.s/m",
        "speed_I": "N/m",
        "thrust_limit": "N",
    },
    **{"course_P": "1", "course_D": "s", "rudder_limit": "rad"},
}
OUTPUT_UNITS = {"thrust": "N", "rudder_angle": "rad"}


class WaypointFollower(Fmi2Slave):
    """Autopilot that passes waypoints at a speed and then stops.

    SI units, angles in rad, yaw counter-clockwise from east.
    """

    description = "Passes waypoints at a speed"
    units = {
        **{f"waypoint_{axis}[{i + 1}]": "m" for axis in "xy" for i in range(32)},
        **INPUT_UNITS,
        **PARAMETER_UNITS,
        **OUTPUT_UNITS,
    }

    def __init__(self, **arguments: object):
        super().__init__(**arguments)
        self.vehicle = SimpleNamespace(
            position=SimpleNamespace(x=0.0, y=0.0),
            attitude=SimpleNamespace(yaw=0.0),
            velocity_body=SimpleNamespace(u=0.0),
            rates=SimpleNamespace(r=0.0),
        )
        self.speed_command, self.acceptance_radius, self.waypoint_count = 1.0, 0.5, 1
        self.waypoint_x, self.waypoint_y = [0.0] * len(WAYPOINTS), [0.0] * len(WAYPOINTS)
        self.speed_P, self.speed_I, self.thrust_limit = 82.65, 10.0, 3.0
        self.course_P, self.course_D, self.rudder_limit = 1.5, 0.8, math.radians(35)
        self.thrust, self.rudder_angle, self.reached, self.speed_integral = 0.0, 0.0, 0, 0.0
        self._register_variables()

    def _register_variables(self) -> None:
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        for name in INPUT_UNITS:
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        for name in PARAMETER_UNITS:
            self.register_variable(Real(name, **tunable))
        self.register_variable(Integer("waypoint_count", **tunable))
        for name in ("waypoint_x", "waypoint_y"):
            values = getattr(self, name)
            for i in WAYPOINTS:
                access = {
                    "getter": lambda v=values, i=i: v[i],
                    "setter": lambda value, v=values, i=i: v.__setitem__(i, value),
                }
                self.register_variable(Real(f"{name}[{i + 1}]", **access, **tunable))
        for name in OUTPUT_UNITS:
            self.register_variable(Real(name, causality=Fmi2Causality.output))
        self.register_variable(Integer("reached", causality=Fmi2Causality.output))
        self.register_variable(Real("speed_integral", causality=Fmi2Causality.local))

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the outputs of a step from the measurements at its start."""
        if self.reached >= min(self.waypoint_count, len(WAYPOINTS)):
            self.thrust = self.rudder_angle = 0.0
            return True
        position = self.vehicle.position
        east, north = (
            self.waypoint_x[self.reached] - position.x,
            self.waypoint_y[self.reached] - position.y,
        )
        self.reached += math.hypot(east, north) < self.acceptance_radius
        self.thrust = self._thrust(self.speed_command - self.vehicle.velocity_body.u, step_size)
        self.rudder_angle = self._rudder_angle(self.vehicle.attitude.yaw - math.atan2(north, east))
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
