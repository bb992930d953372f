"""Inertial navigation aided by GNSS and magnetometer: a complementary filter with fixed gains.

The IMU is integrated between fixes. A fix corrects position and velocity in proportion to their
errors. It also corrects the attitude: a small attitude error d turns the specific force f and lets
the velocity error grow with d x f, so f x error points along d. Levelling by the accelerometer
alone fails here, because the accelerometer of a multirotor measures only thrust and drag. Source:
M.-D. Hua, "Attitude estimation for accelerated vehicles using GPS/INS measurements", Control
Engineering Practice 18 (2010).
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
from .signal_component import SignalComponent
from .variable_declarations import real_parameter, real_variable, vector_variables

#: inputs by quantity
_FORCE, _RATES, _FIX_POSITION, _FIX_VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
_FIX_TIME, _FIELD, _FIELD_TIME = 12, slice(13, 16), 16

_STATE_ATTRIBUTES = (
    "_position",
    "_velocity",
    "_orientation",
    "_gyro_bias",
    "_force_bias",
    "_history",
    "_alignment_count",
    "_fix_time",
    "_field_time",
)


class Navigation(SignalComponent):
    """Estimated motion of a vehicle under the plant's names.

    `{"from": "navigation", "to": "uav.vehicle"}` connects it.

    During the first `alignment_time` (s) the vehicle must stand still and level. The means of rates
    and specific force give the biases, the magnetometer gives the heading. The error of a fix is
    evaluated at the time of its sample, so its latency does not matter.

    Inputs: `imu.acceleration`, `imu.rates`, `gnss.position`, `.velocity`, `.time`,
    `magnetometer.field`, `.time`. Outputs: `position.x|y|z` (m, world), `orientation.w|x|y|z`,
    `attitude.roll|pitch|yaw` (rad, ZYX), `velocity.x|y|z` (m/s, world), `velocity_body.u|v|w`
    (m/s), `rates.p|q|r` (rad/s, body). The parameter `earth` is the assumed field of the Earth (T).

    Args:
        instance_name: Name of the component.
    """

    state_attributes = _STATE_ATTRIBUTES
    _position: Sequence[float]
    _velocity: Sequence[float]
    _orientation: Quaternion
    _gyro_bias: Sequence[float]
    _force_bias: Sequence[float]

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
                real_parameter(
                    "alignment_time", "s", 1.0, "in which the vehicle stands still and level"
                ),
                real_parameter(
                    "position_gain",
                    "1",
                    0.3,
                    "share of the position error that a fix takes away",
                    0.0,
                    1.0,
                ),
                real_parameter(
                    "velocity_gain",
                    "1",
                    0.15,
                    "share of the velocity error that a fix takes away",
                    0.0,
                    1.0,
                ),
                real_parameter(
                    "tilt_gain", "1", 0.03, "turn by a fix, times g, per velocity error", 0.0, 1.0
                ),
                real_parameter(
                    "heading_gain",
                    "1",
                    0.02,
                    "share of the heading error that a sample of the field takes away",
                    0.0,
                    1.0,
                ),
                real_parameter(
                    "bias_gain",
                    "1/s",
                    0.05,
                    "change of the gyroscopes' bias per turn by a correction",
                ),
                real_variable(
                    "earth",
                    "T",
                    "parameter",
                    EARTH_FIELD,
                    "field of the Earth: east, north, up",
                    shape=(3,),
                ),
                *vector_variables("position", "xyz", "m", "output"),
                *(real_variable(f"orientation.{part}", "1", "output") for part in "wxyz"),
                *(
                    real_variable(f"attitude.{angle}", "rad", "output")
                    for angle in ("roll", "pitch", "yaw")
                ),
                *vector_variables("velocity", "xyz", "m/s", "output"),
                *vector_variables("velocity_body", "uvw", "m/s", "output"),
                *vector_variables("rates", "pqr", "rad/s", "output"),
            ],
        )

    def initialise(self) -> None:
        """Start the alignment with the first measurements."""
        i = self.inputs
        self._position, self._velocity, self._orientation = (
            i[_FIX_POSITION],
            (0.0, 0.0, 0.0),
            self._level_attitude(),
        )
        self._gyro_bias, self._force_bias = i[_RATES], (i[0], i[1], i[2] - GRAVITY)
        self._history, self._alignment_count = History(), 1
        self._fix_time, self._field_time = i[_FIX_TIME], i[_FIELD_TIME]
        self._publish()

    def advance(self, now: float, step_size: float) -> None:
        """Align, or integrate the IMU over one step and apply new measurements."""
        if now - self.start_time < self.parameters["alignment_time"]:
            self._align()
        else:
            self._integrate(step_size)
            self._history.add(now, (*self._position, *self._velocity))
            if self.inputs[_FIX_TIME] > self._fix_time:
                self._correct_by_fix()
            if self.inputs[_FIELD_TIME] > self._field_time:
                self._correct_heading(self.parameters["heading_gain"], self.parameters["bias_gain"])
        self._fix_time, self._field_time = self.inputs[_FIX_TIME], self.inputs[_FIELD_TIME]
        self._publish()

    def _align(self) -> None:
        """Update the running means of biases, position and heading."""
        i = self.inputs
        self._alignment_count += 1
        share = 1 / self._alignment_count
        self._gyro_bias = _interpolate(self._gyro_bias, i[_RATES], share)
        self._force_bias = _interpolate(self._force_bias, (i[0], i[1], i[2] - GRAVITY), share)
        self._position = _interpolate(self._position, i[_FIX_POSITION], share)
        self._correct_heading(share, 0.0)

    def _level_attitude(self) -> Quaternion:
        """Return the level attitude with the heading of the measured field."""
        east, north, _ = self.parameters["earth"]
        forward, left, _ = self.inputs[_FIELD]
        return quaternion_from_rotation_vector(
            (0.0, 0.0, math.atan2(north, east) - math.atan2(left, forward))
        )

    def _integrate(self, h: float) -> None:
        """Integrate rates and specific force over a step `h` (s)."""
        (p, q, r), (bias_p, bias_q, bias_r), before = (
            self.inputs[_RATES],
            self._gyro_bias,
            self._orientation,
        )
        rotation = quaternion_from_rotation_vector(
            ((p - bias_p) * h, (q - bias_q) * h, (r - bias_r) * h)
        )
        self._orientation = normalised_quaternion(quaternion_product(before, rotation))
        x, y, z = self._force(midpoint_attitude(before, self._orientation))
        u, v, w = self._velocity
        self._velocity = u + h * x, v + h * y, w + h * (z - GRAVITY)
        a, b, c = self._position
        self._position = (
            a + h * (u + h / 2 * x),
            b + h * (v + h / 2 * y),
            c + h * (w + h / 2 * (z - GRAVITY)),
        )

    def _force(self, orientation: Sequence[float]) -> Vector:
        """Return the specific force without bias (m/s2, world axes)."""
        (a, b, c), (x, y, z) = self.inputs[_FORCE], self._force_bias
        return to_world(orientation, (a - x, b - y, c - z))

    def _correct_by_fix(self) -> None:
        """Correct position, velocity and attitude by the errors at the time of the fix."""
        p, i, past = self.parameters, self.inputs, self._history.at(self.inputs[_FIX_TIME])
        x, y, z = (
            measured - estimate
            for measured, estimate in zip(i[_FIX_POSITION], past[:3], strict=True)
        )
        u, v, w = (
            measured - estimate
            for measured, estimate in zip(i[_FIX_VELOCITY], past[3:], strict=True)
        )
        self._position = _add_scaled(self._position, p["position_gain"], (x, y, z))
        self._velocity = _add_scaled(self._velocity, p["velocity_gain"], (u, v, w))
        a, b, c = cross(self._force(self._orientation), (u, v, w))
        gain = p["tilt_gain"] / GRAVITY**2
        self._rotate((gain * a, gain * b, gain * c), p["bias_gain"])

    def _correct_heading(self, gain: float, bias_gain: float) -> None:
        """Correct the heading by `gain` times the angle between the measured field and that of the Earth."""
        east, north, _ = self.parameters["earth"]
        x, y, _ = to_world(self._orientation, self.inputs[_FIELD])
        self._rotate(
            (0.0, 0.0, gain * math.atan2(x * north - y * east, x * east + y * north)), bias_gain
        )

    def _rotate(self, rotation: Vector, bias_gain: float) -> None:
        """Correct the attitude by a rotation vector (rad, world axes) and the gyroscope bias in proportion to it."""
        (p, q, r), (a, b, c) = self._gyro_bias, to_body(self._orientation, rotation)
        self._gyro_bias = p - bias_gain * a, q - bias_gain * b, r - bias_gain * c
        self._orientation = quaternion_product(
            quaternion_from_rotation_vector(rotation), self._orientation
        )

    def _publish(self) -> None:
        """Set the outputs from the estimates."""
        q = self._orientation
        rates = [
            rate - bias for rate, bias in zip(self.inputs[_RATES], self._gyro_bias, strict=True)
        ]
        self.outputs = (
            *self._position,
            *q,
            *euler_angles(q),
            *self._velocity,
            *to_body(q, self._velocity),
            *rates,
        )


def _add_scaled(vector: Sequence[float], gain: float, change: Vector) -> Vector:
    """Return vector + gain * change."""
    return vector[0] + gain * change[0], vector[1] + gain * change[1], vector[2] + gain * change[2]


def _interpolate(old: Sequence[float], new: Sequence[float], share: float) -> Vector:
    """Return old + share * (new - old)."""
    return (
        old[0] + share * (new[0] - old[0]),
        old[1] + share * (new[1] - old[1]),
        old[2] + share * (new[2] - old[2]),
    )
