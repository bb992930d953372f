"""Inertial measurement unit.

Three gyroscopes and three accelerometers in body axes, one sample per step.

Error model of each triad (IEEE Std 952-1997; also used by the kalibr and RotorS projects):

    y = clip(M x + c + b_0 + b + N / sqrt(h) n, -range, range)

with the true value x, the matrix M of scale and misalignment, the constant bias c, the turn-on bias
b_0 (normal), the bias b (a first-order Gauss-Markov process driven by white noise of density K, the
bias walk), the noise density N, the step size h and a standard normal n. The Allan deviation is N /
sqrt(tau) for short averaging times and K sqrt(tau / 3) for long ones that are well below the
correlation time.

Sources of the default values; [typical] is a common value that no data sheet has:

- [BMI088] Bosch Sensortec BMI088, data sheet BST-BMI088-DS001
- [ADIS] Analog Devices ADIS16448 as in the RotorS simulator (Furrer et al., "RotorS - A modular
  Gazebo MAV simulator framework", 2016; gazebo_imu_plugin.h), which doubles the densities of the
  data sheet
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from cosim.core.component import Variable

from ..json_reader import JsonReader
from .counter_based_noise import CounterBasedNoise, gauss_markov_factors
from .rotations import IDENTITY_MATRIX, Vector, matrix_product, midpoint_attitude, to_body
from .signal_component import SignalComponent
from .variable_declarations import (
    array_parameter,
    check_arguments,
    orientation_inputs,
    real_parameter,
    seed_parameter,
    vector_variables,
)

GRAVITY = 9.81  # m/s2, as in the equations of the vehicles
_DEGREE, _MILLI_G, _HOUR = math.radians(1.0), 9.81e-3, 3600.0

#: noise_density (unit/sqrt(Hz)), bias_walk (unit/s/sqrt(Hz)), correlation_time (s), turn_on_bias
#: and range (unit); rad/s and m/s2
IMU_DEVICES: Mapping[str, Mapping[str, Mapping[str, float]]] = {
    "bmi088": {
        "gyroscope": {
            "noise_density": 0.014 * _DEGREE,  # [BMI088]
            # sigma sqrt(2 / correlation_time) of a Gauss-Markov process with the bias stability of
            # 2 deg/h [BMI088]
            "bias_walk": 2.0 * _DEGREE / _HOUR * math.sqrt(2 / 1000.0),
            "correlation_time": 1000.0,  # [ADIS]
            "turn_on_bias": 1.0 * _DEGREE,  # zero-rate offset [BMI088]
            "range": 2000.0 * _DEGREE,  # [BMI088]
        },
        "accelerometer": {
            "noise_density": 0.175 * _MILLI_G,  # [BMI088]
            "bias_walk": 0.02 * _MILLI_G * math.sqrt(2 / 300.0),  # of 0.02 mg [typical]
            "correlation_time": 300.0,  # [ADIS]
            "turn_on_bias": 20.0 * _MILLI_G,  # zero-g offset [BMI088]
            "range": 24.0e3 * _MILLI_G,  # [BMI088]
        },
    },
    "adis16448": {
        "gyroscope": {
            "noise_density": 2 * 35.0 / _HOUR * _DEGREE,
            "bias_walk": 2 * 4.0 / _HOUR * _DEGREE,
            "correlation_time": 1000.0,
            "turn_on_bias": 0.5 * _DEGREE,
            "range": 1000.0 * _DEGREE,
        },
        "accelerometer": {
            "noise_density": 2 * 2.0e-3,
            "bias_walk": 2 * 3.0e-3,
            "correlation_time": 300.0,
            "turn_on_bias": 20.0 * _MILLI_G,
            "range": 18.0e3 * _MILLI_G,
        },
    },
}


class _TriadCoefficients(NamedTuple):
    """Coefficients of the error model of three equal axes.

    `keep` and `drive` as in `gauss_markov_factors`.
    """

    matrix: Sequence[float] | None
    offset: Vector
    sigma: float
    keep: float
    drive: float
    range: float


class Imu(SignalComponent):
    """Inertial measurement unit with the error model of IEEE Std 952 (see the module).

    The specific force is the mean over the step: the change of velocity minus that by gravity,
    divided by the step size, in the attitude halfway. A contact therefore appears as it does in the
    published velocity.

    Inputs: `vehicle.velocity` (m/s, world), `vehicle.orientation` (unit quaternion, body to world),
    `vehicle.rates` (rad/s, body). Outputs: `acceleration.x|y|z` (specific force, m/s2, body; +g
    upwards at rest, 0 in free fall), `rates.p|q|r` (rad/s, body).

    Args:
        instance_name: Name of the component.
        seed: Seed of all random numbers, together with the name of the component.
        device: Set of default values (`IMU_DEVICES`): "bmi088" or "adis16448". Each value is a
            parameter.

    Raises:
        InputError: `device` is unknown or `seed` is not an integer of at least 0.
    """

    random_number_count = 12
    state_attributes = ("_step", "_last_inputs", "_biases")

    def __init__(self, instance_name: str, seed: int = 0, device: str = "bmi088"):
        reader = JsonReader()
        device = reader.choice(device, ("device",), list(IMU_DEVICES))
        check_arguments(reader, seed)
        super().__init__(
            instance_name,
            [
                *vector_variables("vehicle.velocity", "xyz", "m/s", "input"),
                *orientation_inputs("vehicle"),
                *vector_variables("vehicle.rates", "pqr", "rad/s", "input"),
                *_triad_parameters("gyroscope", "rad/s", IMU_DEVICES[device]["gyroscope"]),
                *_triad_parameters("accelerometer", "m/s2", IMU_DEVICES[device]["accelerometer"]),
                seed_parameter(seed),
                *vector_variables("acceleration", "xyz", "m/s2", "output", "specific force"),
                *vector_variables("rates", "pqr", "rad/s", "output", "angular velocity"),
            ],
        )
        self._step_size = 0.01

    def apply_parameters(self) -> None:
        """Compute the coefficients of both triads from the parameters."""
        turn_on = CounterBasedNoise(6, "turn-on", self.name, self.parameters["seed"])[0]
        self._accelerometer = self._coefficients("accelerometer", turn_on[:3])
        self._gyroscope = self._coefficients("gyroscope", turn_on[3:])

    def _coefficients(self, kind: str, turn_on: Sequence[float]) -> _TriadCoefficients:
        p = {
            name.partition(".")[2]: value
            for name, value in self.parameters.items()
            if name.startswith(kind)
        }
        x, y, z = (c + p["turn_on_bias"] * n for c, n in zip(p["bias"], turn_on, strict=True))
        # stationary standard deviation of a process that white noise of this density drives
        sigma = p["bias_walk"] * math.sqrt(p["correlation_time"] / 2)
        keep, drive = gauss_markov_factors(sigma, p["correlation_time"], self._step_size)
        white = p["noise_density"] / math.sqrt(self._step_size)
        return _TriadCoefficients(
            None if tuple(p["matrix"]) == IDENTITY_MATRIX else p["matrix"],
            (x, y, z),
            white,
            keep,
            drive,
            p["range"],
        )

    def initialise(self) -> None:
        """Set the initial outputs; the vehicle counts as unaccelerated."""
        self._step, self._last_inputs = 0, self.inputs
        self._biases: Sequence[float] = (0.0,) * 6
        self._set_outputs((0.0, 0.0, GRAVITY), self.inputs[3:7], self.noise[0])

    def advance(self, now: float, step_size: float) -> None:
        """Set the outputs after a step of `step_size` (s)."""
        if step_size != self._step_size:
            self._step_size = step_size
            self.apply_parameters()
        self._step += 1
        row, last, new = self.noise[self._step], self._last_inputs, self.inputs
        self._advance_biases(row)
        h = step_size
        force = ((new[0] - last[0]) / h, (new[1] - last[1]) / h, (new[2] - last[2]) / h + GRAVITY)
        self._last_inputs = new
        self._set_outputs(force, midpoint_attitude(last[3:7], new[3:7]), row)

    def _advance_biases(self, row: Sequence[float]) -> None:
        """Advance the Gauss-Markov biases by one step."""
        _, _, _, keep, drive, _ = self._accelerometer
        x, y, z, p, q, r = self._biases
        x, y, z = keep * x + drive * row[6], keep * y + drive * row[7], keep * z + drive * row[8]
        _, _, _, keep, drive, _ = self._gyroscope
        self._biases = (
            x,
            y,
            z,
            keep * p + drive * row[9],
            keep * q + drive * row[10],
            keep * r + drive * row[11],
        )

    def _set_outputs(self, force: Vector, attitude: Sequence[float], row: Sequence[float]) -> None:
        """Set the outputs.

        Args:
            force: Specific force (m/s2, world axes).
            attitude: Unit quaternion, body to world.
            row: Random numbers of the step.
        """
        x, y, z = _measured_axes(
            self._accelerometer, to_body(attitude, force), self._biases[:3], row
        )
        self.outputs = (
            x,
            y,
            z,
            *_measured_axes(self._gyroscope, self.inputs[7:10], self._biases[3:], row[3:]),
        )


def _measured_axes(
    triad: _TriadCoefficients, true: Sequence[float], bias: Sequence[float], row: Sequence[float]
) -> Vector:
    """Apply the error model to the true values of three axes."""
    matrix, (offset_x, offset_y, offset_z), sigma, _, _, limit = triad
    x, y, z = matrix_product(matrix, true) if matrix else true
    x += offset_x + bias[0] + sigma * row[0]
    y += offset_y + bias[1] + sigma * row[1]
    z += offset_z + bias[2] + sigma * row[2]
    if -limit <= x <= limit and -limit <= y <= limit and -limit <= z <= limit:
        return x, y, z
    return max(-limit, min(limit, x)), max(-limit, min(limit, y)), max(-limit, min(limit, z))


#: parameter of a triad -> unit (None: that of the triad) and description; densities have no
#: declared unit: FMI units have integer exponents, unit/sqrt(Hz) does not
_TRIAD_PARAMETERS = {
    "noise_density": ("", "of white noise, {unit}/sqrt(Hz)"),
    "bias_walk": ("", "density that drives the bias, {unit}/s/sqrt(Hz)"),
    "correlation_time": ("s", "of the wandering bias"),
    "turn_on_bias": (None, "standard deviation of the bias at turn-on"),
    "range": (None, "largest value that is measured"),
}


def _triad_parameters(kind: str, unit: str, numbers: Mapping[str, float]) -> Iterator[Variable]:
    for name, (own_unit, text) in _TRIAD_PARAMETERS.items():
        declared = unit if own_unit is None else own_unit
        minimum = 1e-3 if declared == "s" else 0.0
        text = text.format(unit=unit)
        yield real_parameter(f"{kind}.{name}", declared, numbers[name], text, minimum)
    yield array_parameter(f"{kind}.bias", unit, (0.0,) * 3, "constant bias")
    text = "scale and misalignment, row by row"
    yield array_parameter(f"{kind}.matrix", "1", IDENTITY_MATRIX, text)
