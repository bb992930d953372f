"""Magnetometer: the field of the Earth in the body axes, and the heading of a levelled compass."""

from __future__ import annotations

import math

from .frames import angles, to_body
from .sampled import Measurement, SampledSensor, timing
from .signals import parameter, real, seed_parameter, vector

#: east, north and up (T): about 40 degrees north in Europe, from the World Magnetic Model 2025, rounded
FIELD = (0.5e-6, 25.5e-6, -37.0e-6)


class Magnetometer(SampledSensor):
    """`field.x|y|z` (T, body axes), `yaw` (rad, counter-clockwise from east), `time` (s).

    field = S R^T B + hard iron + white noise, with B the parameter `earth` (T, east, north, up), S the matrix `soft_iron` and
    `hard_iron` fixed to the body. `yaw` is levelled with the true roll and pitch and knows the declination: a compass module
    with a perfect level. The noise of 0.3 uT is typical of small sensors. Inputs: `vehicle.orientation`.
    """

    random_numbers = 3

    def __init__(self, instance_name: str, seed: int = 0):
        identity = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
        super().__init__(
            instance_name,
            [
                *(real(f"vehicle.orientation.{part}", "1", "input", float(part == "w")) for part in "wxyz"),
                real("earth", "T", "parameter", FIELD, "field of the Earth: east, north, up", shape=(3,)),
                real("hard_iron", "T", "parameter", (0.0,) * 3, "field of the vehicle itself, body axes", shape=(3,)),
                real("soft_iron", "1", "parameter", identity, "distortion by the vehicle, row by row", shape=(9,)),
                parameter("noise", "T", 0.3e-6, "standard deviation of the white noise"),
                seed_parameter(seed),
                *vector("field", "xyz", "T", "output", text="measured field"),
                real("yaw", "rad", "output", description="heading"),
                *timing(50.0),
            ],
        )

    def measure(self, number: int, elapsed: float) -> Measurement:
        p, row = self.parameters, self.noise[number]
        x, y, z = to_body(self.inputs, p["earth"])
        a, b, c, d, e, f, g, h, i = p["soft_iron"]
        distorted = (a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z)
        field = [soft + hard + p["noise"] * n for soft, hard, n in zip(distorted, p["hard_iron"], row, strict=True)]
        return (*field, self._heading(field)), ()

    def _heading(self, field: list[float]) -> float:
        roll, pitch, _ = angles(self.inputs)
        x, y, z = field
        left, up = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
        forward = x * math.cos(pitch) + up * math.sin(pitch)
        east, north, _ = self.parameters["earth"]
        heading = math.atan2(north, east) - math.atan2(left, forward)
        return math.atan2(math.sin(heading), math.cos(heading))
