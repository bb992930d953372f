"""Quadcopter controller as a PythonFMU class: it flies above the deck.

It runs in process or, exported, as an FMU.
"""

import math
from types import SimpleNamespace

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

GRAVITY = 9.81
VECTORS = ("vehicle.position", "vehicle.velocity", "target.position", "target.velocity")
UNITS = {"position": "m", "velocity": "m/s"}


class DeckFollower(Fmi2Slave):
    """Position control by tilting the thrust, attitude control by differences of thrusts.

    SI units, angles in rad.
    """

    description = "Flies above the deck at a commanded height"
    units = {
        **{f"{name}.{axis}": UNITS[name.partition(".")[2]] for name in VECTORS for axis in "xyz"},
        **{f"vehicle.attitude.{angle}": "rad" for angle in ("roll", "pitch", "yaw")},
        **{f"vehicle.rates.{axis}": "rad/s" for axis in "pqr"},
        **{"altitude_command": "m", "yaw_command": "rad", "acceleration_limit": "m/s2"},
        **{"position_bandwidth": "rad/s", "attitude_bandwidth": "rad/s", "yaw_bandwidth": "rad/s"},
        **{
            "mass": "kg",
            "inertia_xy": "kg.m2",
            "inertia_z": "kg.m2",
            "arm": "m",
            "torque_per_thrust": "m",
        },
        **{"thrust_coefficient": "N.s2/rad2", "rotor_speed_limit": "rad/s"},
        **{f"rotor_speed[{i}]": "rad/s" for i in (1, 2, 3, 4)},
    }

    def __init__(self, **arguments: object):
        super().__init__(**arguments)
        self.vehicle = SimpleNamespace(
            attitude=SimpleNamespace(roll=0.0, pitch=0.0, yaw=0.0),
            rates=SimpleNamespace(p=0.0, q=0.0, r=0.0),
        )
        self.target = SimpleNamespace()
        for owner in (self.vehicle, self.target):
            owner.position, owner.velocity = (
                SimpleNamespace(x=0.0, y=0.0, z=0.0),
                SimpleNamespace(x=0.0, y=0.0, z=0.0),
            )
        self.altitude_command, self.yaw_command = 2.0, 0.0
        self.position_bandwidth, self.attitude_bandwidth, self.yaw_bandwidth = 1.2, 8.0, 2.0
        self.acceleration_limit = 3.0
        self.mass, self.inertia_xy, self.inertia_z = 0.443892, 0.00283, 0.005131
        self.arm, self.torque_per_thrust, self.thrust_coefficient = 0.1815, 0.0289, 8.24e-6
        self.rotor_speed_limit = 523.6
        self.rotor_speed = [0.0, 0.0, 0.0, 0.0]
        self._register_variables()

    def _register_variables(self) -> None:
        """Register inputs, parameters and outputs: all names with a unit."""
        inputs = ("vehicle.", "target.", "altitude_command", "yaw_command")
        for name in self.units:
            if name.startswith(inputs):
                self.register_variable(Real(name, causality=Fmi2Causality.input))
            elif not name.startswith("rotor_speed["):
                self.register_variable(
                    Real(
                        name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable
                    )
                )
        for i in range(4):
            output = Real(
                f"rotor_speed[{i + 1}]",
                causality=Fmi2Causality.output,
                getter=lambda i=i: self.rotor_speed[i],
            )
            self.register_variable(output)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Compute the rotor speeds of a step from the measurements at its start."""
        roll, pitch, thrust = self._attitude_command(self._acceleration_command())
        self.rotor_speed = self._rotor_speeds(thrust, self._torques(roll, pitch))
        return True

    def _acceleration_command(self) -> tuple[float, float, float]:
        """Return the commanded acceleration in the world frame (m/s2).

        The control of the position is critically damped.
        """
        position, velocity = self.vehicle.position, self.vehicle.velocity
        target, motion = self.target.position, self.target.velocity
        return (
            self._acceleration(target.x - position.x, motion.x - velocity.x),
            self._acceleration(target.y - position.y, motion.y - velocity.y),
            self._acceleration(self.altitude_command - position.z, -velocity.z),
        )

    def _acceleration(self, error: float, rate: float) -> float:
        w = self.position_bandwidth
        return limited(w * w * error + 2 * w * rate, self.acceleration_limit)

    def _attitude_command(
        self, acceleration: tuple[float, float, float]
    ) -> tuple[float, float, float]:
        """Return roll and pitch angle (rad) and thrust (N) for an acceleration.

        A positive pitch angle lowers the nose, a positive roll angle raises the left side.
        """
        yaw, (x, y, z) = self.vehicle.attitude.yaw, acceleration
        forward, left = x * math.cos(yaw) + y * math.sin(yaw), y * math.cos(yaw) - x * math.sin(yaw)
        roll, pitch = -math.atan2(left, GRAVITY), math.atan2(forward, GRAVITY)
        tilt = math.cos(self.vehicle.attitude.roll) * math.cos(self.vehicle.attitude.pitch)
        return roll, pitch, self.mass * (GRAVITY + z) / max(0.5, tilt)

    def _torques(self, roll: float, pitch: float) -> tuple[float, float, float]:
        """Return the torques about the body axes (N.m).

        The control of the attitude has a damping ratio of 0.8.
        """
        attitude, rates = self.vehicle.attitude, self.vehicle.rates
        turn = self.yaw_command - attitude.yaw
        w, w_yaw = self.attitude_bandwidth, self.yaw_bandwidth
        return (
            self.inertia_xy * (w * w * (roll - attitude.roll) - 1.6 * w * rates.p),
            self.inertia_xy * (w * w * (pitch - attitude.pitch) - 1.6 * w * rates.q),
            self.inertia_z
            * (w_yaw * w_yaw * math.atan2(math.sin(turn), math.cos(turn)) - 1.6 * w_yaw * rates.r),
        )

    def _rotor_speeds(self, thrust: float, torques: tuple[float, float, float]) -> list[float]:
        """Return the speeds of the rotors front, left, rear, right (rad/s).

        Front and rear turn the body counter-clockwise.
        """
        x, y, z = (
            torques[0] / (2 * self.arm),
            torques[1] / (2 * self.arm),
            torques[2] / (4 * self.torque_per_thrust),
        )
        thrusts = (thrust / 4 - y + z, thrust / 4 + x - z, thrust / 4 + y + z, thrust / 4 - x - z)
        return [
            min(math.sqrt(max(one, 0.0) / self.thrust_coefficient), self.rotor_speed_limit)
            for one in thrusts
        ]


def limited(value: float, limit: float) -> float:
    """Return `value` limited to the range from `-limit` to `limit`."""
    return max(-limit, min(limit, value))
