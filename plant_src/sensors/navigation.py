"""Where a vehicle is, from its IMU, satellite receiver and magnetometer: a complementary filter with fixed gains.

Between fixes the IMU is integrated. A fix corrects position and velocity by shares of their errors, and the attitude by the
velocity error: when a specific force f is turned by a small wrong angle d, the velocity error grows with d x f, so f x error
points along d. A plain vertical from the accelerometer would not do: that of a multirotor feels its own thrust and drag alone.
(M.-D. Hua, "Attitude estimation for accelerated vehicles using GPS/INS measurements", Control Engineering Practice 18 (2010).)
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from .history import History
from .imu import GRAVITY
from .magnetometer import EARTH_FIELD
from .rotations import (
    Quaternion,
    Vector,
    cross,
    euler_angles,
    midpoint_attitude,
    normalised_quaternion,
    quaternion_from_rotation_vector,
    quaternion_product,
    to_body,
    to_world,
)
from .signal_component import SignalComponent, real_parameter, real_variable, vector_variables

_STATE_ATTRIBUTES = (
    "_position",
    "_velocity",
    "_orientation",
    "_gyro_bias",
    "_force_bias",
    "_history",
    "_aligned",
    "_fix_time",
    "_field_time",
)


class Navigation(SignalComponent):
    """The motion of the vehicle under the names of the plant, so that `{"from": "navigation", "to": "uav.vehicle"}` is enough.

    For the first `alignment_time` (s) the vehicle has to stand still and level: the means of rates and specific force give the
    biases, the magnetometer gives the heading. Errors of a fix are those at the time of its sample, whatever its latency.
    Inputs: `imu`, `gnss` and `magnetometer`, each by the names of its outputs. `earth` is the field (T) that it believes in.
    """

    state_attributes = _STATE_ATTRIBUTES
    _position: Vector
    _velocity: Vector
    _orientation: Quaternion
    _gyro_bias: Vector
    _force_bias: Vector

    def __init__(self, instance_name: str):
        super().__init__(
            instance_name,
            [
                *vector_variables("imu.acceleration", "xyz", "m/s2", "input"),
                *vector_variables("imu.rates", "pqr", "rad/s", "input"),
                *vector_variables("gnss.position", "xyz", "m", "input"),
                *vector_variables("gnss.velocity", "xyz", "m/s", "input"),
                real_variable("gnss.time", "s", "input"),
                *vector_variables("magnetometer.field", "xyz", "T", "input"),
                real_variable("magnetometer.time", "s", "input"),
                real_parameter("alignment_time", "s", 1.0, "in which the vehicle stands still and level"),
                real_parameter("position_gain", "1", 0.3, "share of the position error that a fix takes away", 0.0, 1.0),
                real_parameter("velocity_gain", "1", 0.15, "share of the velocity error that a fix takes away", 0.0, 1.0),
                real_parameter("tilt_gain", "1", 0.03, "turn by a fix, times g, per velocity error", 0.0, 1.0),
                real_parameter(
                    "heading_gain", "1", 0.02, "share of the heading error that a sample of the field takes away", 0.0, 1.0
                ),
                real_parameter("bias_gain", "1/s", 0.05, "change of the gyroscopes' bias per turn by a correction"),
                real_variable("earth", "T", "parameter", EARTH_FIELD, "field of the Earth: east, north, up", shape=(3,)),
                *vector_variables("position", "xyz", "m", "output"),
                *(real_variable(f"orientation.{part}", "1", "output") for part in "wxyz"),
                *(real_variable(f"attitude.{angle}", "rad", "output") for angle in ("roll", "pitch", "yaw")),
                *vector_variables("velocity", "xyz", "m/s", "output"),
                *vector_variables("velocity_body", "uvw", "m/s", "output"),
                *vector_variables("rates", "pqr", "rad/s", "output"),
            ],
        )

    def initialise(self) -> None:
        i = self.inputs
        self._position, self._velocity, self._orientation = (i[6], i[7], i[8]), (0.0, 0.0, 0.0), self._level_attitude()
        self._gyro_bias, self._force_bias = (i[3], i[4], i[5]), (i[0], i[1], i[2] - GRAVITY)
        self._history, self._aligned = History(), 1
        self._fix_time, self._field_time = i[12], i[16]
        self._publish()

    def advance(self, now: float, step_size: float) -> None:
        if now - self.start_time < self.parameters["alignment_time"]:
            self._align()
        else:
            self._integrate(step_size)
            self._history.add(now, (*self._position, *self._velocity))
            if self.inputs[12] > self._fix_time:
                self._correct_by_fix()
            if self.inputs[16] > self._field_time:
                self._correct_heading(self.parameters["heading_gain"], self.parameters["bias_gain"])
        self._fix_time, self._field_time = self.inputs[12], self.inputs[16]
        self._publish()

    def _align(self) -> None:
        """Means while standing still."""
        i = self.inputs
        self._aligned += 1
        share = 1 / self._aligned
        self._gyro_bias = _interpolate(self._gyro_bias, i[3:6], share)
        self._force_bias = _interpolate(self._force_bias, (i[0], i[1], i[2] - GRAVITY), share)
        self._position = _interpolate(self._position, i[6:9], share)
        self._correct_heading(share, 0.0)

    def _level_attitude(self) -> Quaternion:
        """Level, with the heading that the field has."""
        east, north, _ = self.parameters["earth"]
        return quaternion_from_rotation_vector((0.0, 0.0, math.atan2(north, east) - math.atan2(self.inputs[14], self.inputs[13])))

    def _integrate(self, h: float) -> None:
        """One step by rates and specific force."""
        i, (p, q, r), before = self.inputs, self._gyro_bias, self._orientation
        self._orientation = normalised_quaternion(
            quaternion_product(before, quaternion_from_rotation_vector(((i[3] - p) * h, (i[4] - q) * h, (i[5] - r) * h)))
        )
        x, y, z = self._force(midpoint_attitude(before, self._orientation))
        u, v, w = self._velocity
        self._velocity = u + h * x, v + h * y, w + h * (z - GRAVITY)
        a, b, c = self._position
        self._position = a + h * (u + h / 2 * x), b + h * (v + h / 2 * y), c + h * (w + h / 2 * (z - GRAVITY))

    def _force(self, orientation: Sequence[float]) -> Vector:
        """Specific force, world axes (m/s2)."""
        i, (x, y, z) = self.inputs, self._force_bias
        return to_world(orientation, (i[0] - x, i[1] - y, i[2] - z))

    def _correct_by_fix(self) -> None:
        p, i, then = self.parameters, self.inputs, self._history.at(self.inputs[12])
        error = (i[9] - then[3], i[10] - then[4], i[11] - then[5])
        x, y, z = self._position
        share = p["position_gain"]
        self._position = x + share * (i[6] - then[0]), y + share * (i[7] - then[1]), z + share * (i[8] - then[2])
        u, v, w = self._velocity
        share = p["velocity_gain"]
        self._velocity = u + share * error[0], v + share * error[1], w + share * error[2]
        a, b, c = cross(self._force(self._orientation), error)
        share = p["tilt_gain"] / GRAVITY**2
        self._rotate((share * a, share * b, share * c), p["bias_gain"])

    def _correct_heading(self, share: float, bias_gain: float) -> None:
        """Take away a share of the difference between the field's heading and that of the Earth's."""
        east, north, _ = self.parameters["earth"]
        x, y, _ = to_world(self._orientation, self.inputs[13:16])
        self._rotate((0.0, 0.0, share * math.atan2(x * north - y * east, x * east + y * north)), bias_gain)

    def _rotate(self, by: Vector, bias_gain: float) -> None:
        """Correct the attitude by a rotation vector in world axes, and the bias of the gyroscopes with it."""
        (p, q, r), (a, b, c) = self._gyro_bias, to_body(self._orientation, by)
        self._gyro_bias = p - bias_gain * a, q - bias_gain * b, r - bias_gain * c
        self._orientation = quaternion_product(quaternion_from_rotation_vector(by), self._orientation)

    def _publish(self) -> None:
        q, (p, d, r), i = self._orientation, self._gyro_bias, self.inputs
        rates = (i[3] - p, i[4] - d, i[5] - r)
        self.outputs = (*self._position, *q, *euler_angles(q), *self._velocity, *to_body(q, self._velocity), *rates)


def _interpolate(old: Vector, new: Sequence[float], share: float) -> Vector:
    """A share of the way from one vector to another."""
    return old[0] + share * (new[0] - old[0]), old[1] + share * (new[1] - old[1]), old[2] + share * (new[2] - old[2])
