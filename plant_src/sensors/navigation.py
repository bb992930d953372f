"""Inertial navigation aided by GNSS and magnetometer: a complementary filter with fixed gains.

The IMU is integrated between fixes. A fix corrects position and velocity in proportion to their
errors. It also corrects the attitude: a small attitude error d turns the specific force f and lets
the velocity error grow with d x f, so f x error points along d. Levelling by the accelerometer
alone fails here, because the accelerometer of a multirotor measures only thrust and drag. Source:
M.-D. Hua, "Attitude estimation for accelerated vehicles using GPS/INS measurements", Control
Engineering Practice 18 (2010).
"""

import math
from collections import deque
from collections.abc import Sequence

from .imu import GRAVITY
from .magnetometer import earth_parameter
from .rotations import (
    Quaternion,
    Vector,
    add_scaled,
    cross,
    difference,
    euler_angles,
    midpoint_attitude,
    normalised_quaternion,
    quaternion_from_rotation_vector,
    quaternion_product,
    to_body,
    to_world,
)
from .signal_component import SignalComponent
from .variable_declarations import (
    EULER_ANGLES,
    real_parameter,
    real_variable,
    share_parameter,
    vector_variables,
)

_TIME_TOLERANCE = 1e-9  # s, rounding error of times

#: inputs by quantity
_FORCE, _RATES, _FIX_POSITION, _FIX_VELOCITY = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
_FIX_TIME, _FIELD, _FIELD_TIME = 12, slice(13, 16), 16


class History:
    """Values of the last `span` (s) by time.

    A measurement arrives with a latency; its error is evaluated against the estimate that was
    valid when it was taken.
    """

    def __init__(self, span: float = 1.0):
        self._span, self._entries = span, deque[tuple[float, Sequence[float]]]()

    def add(self, now: float, values: Sequence[float]) -> None:
        """Append the values at `now` (s), which must be later than all stored times."""
        self._entries.append((now, values))
        if self._entries[0][0] < now - self._span:
            self._entries.popleft()

    def at(self, time: float) -> Sequence[float]:
        """Return the oldest values stored at or after `time` (s).

        The newest ones if all are older.
        """
        result = self._entries[-1]
        for entry in reversed(self._entries):
            if entry[0] < time - _TIME_TOLERANCE:
                break
            result = entry
        return result[1]


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

    state_attributes = (
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
                share_parameter(
                    "position_gain", 0.3, "share of the position error that a fix takes away"
                ),
                share_parameter(
                    "velocity_gain", 0.15, "share of the velocity error that a fix takes away"
                ),
                share_parameter("tilt_gain", 0.03, "turn by a fix, times g, per velocity error"),
                share_parameter(
                    "heading_gain",
                    0.02,
                    "share of the heading error that a sample of the field takes away",
                ),
                real_parameter(
                    "bias_gain",
                    "1/s",
                    0.05,
                    "change of the gyroscopes' bias per turn by a correction",
                ),
                earth_parameter(),
                *vector_variables("position", "xyz", "m", "output"),
                *vector_variables("orientation", "wxyz", "1", "output"),
                *vector_variables("attitude", EULER_ANGLES, "rad", "output"),
                *vector_variables("velocity", "xyz", "m/s", "output"),
                *vector_variables("velocity_body", "uvw", "m/s", "output"),
                *vector_variables("rates", "pqr", "rad/s", "output"),
            ],
        )

    def initialise(self) -> None:
        """Start the alignment with the first measurements."""
        i = self.inputs
        self._position, self._velocity = i[_FIX_POSITION], (0.0, 0.0, 0.0)
        east, north, _ = self.parameters["earth"]
        forward, left, _ = self.inputs[_FIELD]
        self._orientation = quaternion_from_rotation_vector(
            (0.0, 0.0, math.atan2(north, east) - math.atan2(left, forward))
        )
        self._gyro_bias, self._force_bias = i[_RATES], (i[0], i[1], i[2] - GRAVITY)
        self._history, self._alignment_count = History(), 1
        self._fix_time, self._field_time = i[_FIX_TIME], i[_FIELD_TIME]
        self._publish()

    def advance(self, now: float, step_size: float) -> None:
        """Align, or integrate the IMU over one step and apply new measurements."""
        if now - self.start_time < self.parameters["alignment_time"]:
            i = self.inputs
            self._alignment_count += 1
            share = 1 / self._alignment_count
            self._gyro_bias = _interpolate(self._gyro_bias, i[_RATES], share)
            self._force_bias = _interpolate(self._force_bias, (i[0], i[1], i[2] - GRAVITY), share)
            self._position = _interpolate(self._position, i[_FIX_POSITION], share)
            self._correct_heading(share, 0.0)
        else:
            self._integrate(step_size)
            self._history.add(now, (*self._position, *self._velocity))
            if self.inputs[_FIX_TIME] > self._fix_time:
                self._correct_by_fix()
            if self.inputs[_FIELD_TIME] > self._field_time:
                self._correct_heading(self.parameters["heading_gain"], self.parameters["bias_gain"])
        self._fix_time, self._field_time = self.inputs[_FIX_TIME], self.inputs[_FIELD_TIME]
        self._publish()

    def _integrate(self, h: float) -> None:
        """Integrate rates and specific force over a step `h` (s)."""
        before, (p, q, r) = self._orientation, difference(self.inputs[_RATES], self._gyro_bias)
        rotation = quaternion_from_rotation_vector((p * h, q * h, r * h))
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
        return to_world(orientation, difference(self.inputs[_FORCE], self._force_bias))

    def _correct_by_fix(self) -> None:
        """Correct position, velocity and attitude by the errors at the time of the fix."""
        p, i, past = self.parameters, self.inputs, self._history.at(self.inputs[_FIX_TIME])
        position_error = difference(i[_FIX_POSITION], past[:3])
        velocity_error = difference(i[_FIX_VELOCITY], past[3:])
        self._position = add_scaled(self._position, p["position_gain"], position_error)
        self._velocity = add_scaled(self._velocity, p["velocity_gain"], velocity_error)
        a, b, c = cross(self._force(self._orientation), velocity_error)
        gain = p["tilt_gain"] / GRAVITY**2
        self._rotate((gain * a, gain * b, gain * c), p["bias_gain"])

    def _correct_heading(self, gain: float, bias_gain: float) -> None:
        """Correct the heading by `gain` times the angle from the measured field to the Earth's."""
        east, north, _ = self.parameters["earth"]
        x, y, _ = to_world(self._orientation, self.inputs[_FIELD])
        self._rotate(
            (0.0, 0.0, gain * math.atan2(x * north - y * east, x * east + y * north)), bias_gain
        )

    def _rotate(self, rotation: Vector, bias_gain: float) -> None:
        """Correct the attitude by a rotation vector (rad, world axes).

        The bias of the gyroscopes, which let the attitude drift, changes in proportion to it.
        """
        (p, q, r), (a, b, c) = self._gyro_bias, to_body(self._orientation, rotation)
        self._gyro_bias = p - bias_gain * a, q - bias_gain * b, r - bias_gain * c
        self._orientation = quaternion_product(
            quaternion_from_rotation_vector(rotation), self._orientation
        )

    def _publish(self) -> None:
        """Set the outputs from the estimates."""
        q = self._orientation
        self.outputs = (
            *self._position,
            *q,
            *euler_angles(q),
            *self._velocity,
            *to_body(q, self._velocity),
            *difference(self.inputs[_RATES], self._gyro_bias),
        )


def _interpolate(old: Sequence[float], new: Sequence[float], share: float) -> Vector:
    """Return old + share * (new - old)."""
    return add_scaled(old, share, difference(new, old))
