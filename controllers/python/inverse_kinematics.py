"""Inverse kinematics.

From horizontal acceleration and altitude commands to tilt commands and common throttle.
"""

from __future__ import annotations

import math
from typing import Any

from .fleet import GRAVITY, MAX_ROTOR_SPEED, limit
from .fleet.butterworth import Butterworth
from .fleet.pid import Pid
from .fleet.sampled_controller import SampledController


class InverseKinematics(SampledController):
    """Inverse kinematics of the thrust vector, equations 14 to 20 of the paper.

    World frame: east, north, up. The vertical force is the output of an altitude PID behind a
    low-pass, as in the published simulator; both start at hover. The attitude loops receive the yaw
    command unchanged: the yaw angle of the desired rotation differs from it only in second order of
    the tilt.
    """

    description = (
        "From horizontal acceleration and altitude commands to tilt commands and the common "
        "throttle of the rotors"
    )

    def __init__(self, **arguments: Any):
        super().__init__(**arguments)
        self._declare_parameters()
        self.input("vehicle.position.z", 0.0, "m", "Up")
        self.input("acceleration_command.x", 0.0, "m/s2", "East")
        self.input("acceleration_command.y", 0.0, "m/s2", "North")
        self.input("altitude_command", 2.0, "m", "Of the centre of mass")
        self.input("yaw_command", 0.0, "rad", "Counter-clockwise from east")
        self.input(
            "reset",
            False,
            description="Holds the start state: level, with the force that carries the weight",
        )
        self.output("roll_command", 0.0, "rad", "Positive: left side up, accelerates to the right")
        self.output("pitch_command", 0.0, "rad", "Positive: nose down, accelerates forward")
        self.output("throttle", 0.0, "%")
        self.output("thrust", 0.0, "N", "Wanted, of all rotors together")
        self.climb, self.low_pass = (
            self.add_block("climb", Pid()),
            self.add_block("low_pass", Butterworth()),
        )

    def _declare_parameters(self) -> None:
        self.parameter("altitude_P", 10.0, "N/m", "Vertical force per altitude error")
        self.parameter(
            "altitude_I", 10.0, "N/(m.s)", "Rate of the vertical force per altitude error"
        )
        self.parameter("altitude_D", 3.0, "N.s/m", "Vertical force per rate of the altitude error")
        self.parameter("altitude_N", 40.0, "rad/s", "Bandwidth of the derivative filter")
        self.parameter("force_min", 2.0, "N", "Of the vertical force")
        self.parameter("force_max", 7.0, "N", "Of the vertical force")
        self.parameter("filter_frequency", 20.0, "Hz", "Of the low-pass on the vertical force")
        self.parameter("mass", 0.441, "kg", "Of the quadcopter, as the controller believes it")
        self.parameter(
            "thrust_coefficient", 8.24e-6, "N.s2/rad2", "Thrust of a rotor over its squared speed"
        )

    def tick(self, time: float) -> None:
        """Compute the commands from the force t = m (x'', y'', z'' + g) (equation 15).

        The altitude PID gives its z component.
        """
        command, mass = self.acceleration_command, self.mass
        force_x, force_y = (0.0, 0.0) if self.reset else (mass * command.x, mass * command.y)
        force_z = self._vertical_force()
        self.thrust = math.sqrt(force_x * force_x + force_y * force_y + force_z * force_z)
        self._tilt(force_x / self.thrust, force_y / self.thrust, force_z / self.thrust)
        self.throttle = (
            100 / MAX_ROTOR_SPEED * math.sqrt(self.thrust / (4 * self.thrust_coefficient))
        )

    def _vertical_force(self) -> float:
        """Return the filtered vertical force (N)."""
        weight = self.mass * GRAVITY
        force = self.climb(
            self.altitude_command - self.vehicle.position.z,
            reset=self.reset,
            P=self.altitude_P,
            I=self.altitude_I,
            D=self.altitude_D,
            N=self.altitude_N,
            limits=(self.force_min, self.force_max),
            start=weight,
        )
        return self.low_pass(force, self.reset, self.filter_frequency, weight)

    def _tilt(self, z_x: float, z_y: float, z_z: float) -> None:
        """Set the tilt commands from the unit vector z of the thrust (equations 16 to 19).

        y is perpendicular to the heading, x = y cross z, and roll and pitch are the ZYX angles of
        [x y z].
        """
        c, s = math.cos(self.yaw_command), math.sin(self.yaw_command)
        y_x, y_y, y_z = -z_z * s, z_z * c, z_x * s - z_y * c
        across = math.sqrt(y_x * y_x + y_y * y_y + y_z * y_z)
        y_x, y_y, y_z = y_x / across, y_y / across, y_z / across
        self.pitch_command = -math.asin(limit(y_x * z_y - y_y * z_x, -1.0, 1.0))
        self.roll_command = math.atan2(y_z, z_z)
