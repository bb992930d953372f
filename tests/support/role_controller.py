"""Quadcopter controller that declares exactly the variables of its role: PD control of position,
altitude and attitude.
"""

from itertools import product
from math import cos, hypot, sin

from pythonfmu import Boolean, Fmi2Causality, Fmi2Slave, Real

MASS, GRAVITY, ARM = 0.443892, 9.81, 0.178  # kg, m/s2, m
THRUST, TORQUE = (
    7.25e-6,
    2.423e-7,
)  # N.s2 and N.m.s2: force and torque of a rotor by its speed squared
DESCENT, CLIMB = 0.3, 0.6  # m/s
REALS = [
    *map(".".join, product(("vehicle", "target"), ("position", "velocity"), "xyz")),
    *(f"vehicle.attitude.{angle}" for angle in ("roll", "pitch", "yaw")),
    *(f"vehicle.rates.{rate}" for rate in "pqr"),
    "altitude_command",
    "yaw_command",
]


def limit(value, bound):
    return max(-bound, min(bound, value))


class RoleController(Fmi2Slave):
    """Climbs, follows the deck, descends to it when it has stayed above it, and stops the rotors on
    it.
    """

    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.inputs = {**dict.fromkeys(REALS, 0.0), "vehicle.contact.vessel": False}
        self.speeds = [0.0] * 4
        for name in self.inputs:
            kind = Boolean if name.endswith("vessel") else Real
            get, put = (
                (lambda n=name: self.inputs[n]),
                (lambda value, n=name: self.inputs.__setitem__(n, value)),
            )
            start = self.inputs[name]
            variable = kind(
                name, causality=Fmi2Causality.input, start=start, getter=get, setter=put
            )
            self.register_variable(variable, nested=False)
        for i in range(4):
            get = lambda i=i: self.speeds[i]  # noqa: E731
            self.register_variable(
                Real(f"rotor_speed[{i + 1}]", causality=Fmi2Causality.output, getter=get),
                nested=False,
            )
        self.height, self.landed, self.time_above = None, False, 0.0

    def do_step(self, t, h):
        v = self.inputs
        self.landed = self.landed or (t > 5 and v["vehicle.contact.vessel"])
        self.speeds = [0.0] * 4 if self.landed else self.fly(v, t, h)
        return True

    def fly(self, v, t, h):
        errors = [v[f"target.position.{axis}"] - v[f"vehicle.position.{axis}"] for axis in "xy"]
        self.update_height(v, t, h, hypot(*errors))
        gain = 1.0 if t > 3 else 0.0
        ax, ay = (
            limit(
                gain * 4.0 * limit(error, 0.8)
                + 3.2 * (gain * v[f"target.velocity.{a}"] - v[f"vehicle.velocity.{a}"]),
                3.0,
            )
            for a, error in zip("xy", errors, strict=True)
        )
        az = limit(
            6.0 * (self.height - v["vehicle.position.z"]) - 4.0 * v["vehicle.velocity.z"], 4.0
        )
        roll, pitch, yaw = (v[f"vehicle.attitude.{angle}"] for angle in ("roll", "pitch", "yaw"))
        forward, left = ax * cos(yaw) + ay * sin(yaw), ay * cos(yaw) - ax * sin(yaw)
        lift = MASS * (GRAVITY + az) / max(0.5, cos(roll) * cos(pitch)) / 4
        about_x = (
            0.0045 * (60.0 * (-left / GRAVITY - roll) - 15.0 * v["vehicle.rates.p"]) / (2 * ARM)
        )
        about_y = (
            0.0045 * (60.0 * (forward / GRAVITY - pitch) - 15.0 * v["vehicle.rates.q"]) / (2 * ARM)
        )
        about_z = (
            0.008
            * (2.0 * limit(v["yaw_command"] - yaw, 0.5) - 3.0 * v["vehicle.rates.r"])
            * THRUST
            / TORQUE
            / 4
        )
        forces = (
            lift - about_y + about_z,
            lift + about_x - about_z,
            lift + about_y + about_z,
            lift - about_x - about_z,
        )
        return [max(0.0, force / THRUST) ** 0.5 for force in forces]

    def update_height(self, v, t, h, distance):
        if self.height is None:
            self.height = v["vehicle.position.z"]
        self.time_above = self.time_above + h if distance < 0.1 else 0.0
        if t > 8 and (self.time_above > 1 or self.height < v["altitude_command"] - 0.1):
            self.height -= DESCENT * h * (distance < 0.08)
        else:
            self.height = min(v["altitude_command"], self.height + CLIMB * h)
