"""Three-axis magnetometer with the heading of a levelled compass."""

import math

from cosim.core.component import Variable

from .rotations import IDENTITY_MATRIX, euler_angles, matrix_product, to_body
from .signal_component import Measurement, SampledSensor, timing_variables
from .variable_declarations import (
    array_parameter,
    orientation_inputs,
    real_parameter,
    real_variable,
    seed_parameter,
    vector_variables,
)

#: field of the Earth, east, north, up (T): rounded value of the World Magnetic Model 2025 at about
#: 40 degrees north in Europe
EARTH_FIELD = (0.5e-6, 25.5e-6, -37.0e-6)


def earth_parameter() -> Variable:
    """Declare the parameter `earth`, the field of the Earth (T)."""
    return array_parameter("earth", "T", EARTH_FIELD, "field of the Earth: east, north, up")


class Magnetometer(SampledSensor):
    """Magnetometer with hard iron, soft iron and white noise.

    Error model: field = S R^T B + h + white noise, with the field of the Earth B (parameter
    `earth`), the rotation R from body to world, the soft-iron matrix S and the hard-iron field h,
    both fixed to the body. The noise of 0.3 uT is typical of small sensors. `yaw` is levelled with
    the true roll and pitch and corrected for the true declination, like the heading of a compass
    module with a perfect level.

    Inputs: `vehicle.orientation` (unit quaternion, body to world). Outputs: `field.x|y|z` (T, body
    axes), `yaw` (rad, counter-clockwise from east), `time` of the sample (s).

    Args:
        instance_name: Name of the component.
        seed: Seed of all random numbers, together with the name of the component.

    Raises:
        InputError: `seed` is not an integer of at least 0.
    """

    random_number_count = 3

    def __init__(self, instance_name: str, seed: int = 0):
        super().__init__(
            instance_name,
            [
                *orientation_inputs("vehicle"),
                earth_parameter(),
                array_parameter(
                    "hard_iron", "T", (0.0,) * 3, "field of the vehicle itself, body axes"
                ),
                array_parameter(
                    "soft_iron", "1", IDENTITY_MATRIX, "distortion by the vehicle, row by row"
                ),
                real_parameter("noise", "T", 0.3e-6, "standard deviation of the white noise"),
                seed_parameter(seed),
                *vector_variables("field", "xyz", "T", "output", "measured field"),
                real_variable("yaw", "rad", "output", description="heading"),
                *timing_variables(50.0),
            ],
        )

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Return the field (T, body axes) and the heading (rad); see `SampledSensor.measure`."""
        p, row = self.parameters, self.noise[number]
        distorted = matrix_product(p["soft_iron"], to_body(self.inputs, p["earth"]))
        field = [
            soft + hard + p["noise"] * n
            for soft, hard, n in zip(distorted, p["hard_iron"], row, strict=True)
        ]
        return (*field, self._heading(field)), ()

    def _heading(self, field: list[float]) -> float:
        """Return the heading (rad) from the field in body axes.

        The true roll and pitch level the field; the heading is the angle between its horizontal
        part and that of the field of the Earth.
        """
        roll, pitch, _ = euler_angles(self.inputs)
        x, y, z = field
        left, up = y * math.cos(roll) - z * math.sin(roll), y * math.sin(roll) + z * math.cos(roll)
        forward = x * math.cos(pitch) + up * math.sin(pitch)
        east, north, _ = self.parameters["earth"]
        heading = math.atan2(north, east) - math.atan2(left, forward)
        return math.atan2(math.sin(heading), math.cos(heading))
