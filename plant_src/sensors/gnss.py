"""GNSS receiver with its own sample rate and latency.

Sources of the default values:

- [F9P] u-blox ZED-F9P, data sheet UBX-17051259, RTK fixed, short base line
- [M8N] u-blox NEO-M8N, data sheet UBX-15031086
"""

import math
from collections.abc import Mapping, Sequence

from ..json_reader import JsonReader
from .counter_based_noise import advance_gauss_markov
from .signal_component import Measurement, SampledSensor, timing_variables
from .variable_declarations import (
    boolean_variable,
    check_arguments,
    real_parameter,
    seed_parameter,
    vector_variables,
)

#: standard deviation along each of two axes per CEP radius: 1 / 1.1774
_CEP = 1 / math.sqrt(2 * math.log(2))

#: white noise and slow error of the position (m), white noise of the velocity (m/s), correlation
#: time (s), rate (Hz), latency (s); [typical] is a common value that no data sheet has
GNSS_RECEIVERS: Mapping[str, Mapping[str, float]] = {
    "standard": {
        "horizontal_noise": 0.1,  # [typical]
        "vertical_noise": 0.2,  # [typical]
        "horizontal_drift": 2.5 * _CEP,  # [M8N]
        "vertical_drift": 2 * 2.5 * _CEP,  # about twice the horizontal one [typical]
        "velocity_noise": 0.05,  # [M8N]
        "correlation_time": 60.0,  # [typical], as in PX4's simulated receiver
        "rate": 5.0,  # [M8N]
        "latency": 0.1,  # [typical]
    },
    "rtk": {
        # half of the variance each in noise and drift [F9P]
        "horizontal_noise": 0.01 * _CEP / math.sqrt(2),
        # 0.01 m is the median of the absolute error; the standard deviation is 1.4826 times that
        "vertical_noise": 0.01 * 1.4826 / math.sqrt(2),
        "horizontal_drift": 0.01 * _CEP / math.sqrt(2),
        "vertical_drift": 0.01 * 1.4826 / math.sqrt(2),
        "velocity_noise": 0.05,  # [F9P]
        "correlation_time": 60.0,
        "rate": 10.0,  # [F9P]
        "latency": 0.05,  # [typical]
    },
}


class Gnss(SampledSensor):
    """GNSS receiver with white noise and a slow position drift.

    Error model: position = true position + first-order Gauss-Markov drift + white noise; velocity =
    true velocity + white noise. Default values are those of a data sheet (`GNSS_RECEIVERS`); each
    is a parameter. While the parameter `available` is false, `valid` is false and the outputs keep
    the last fix.

    Inputs: `vehicle.position` (m, world), `vehicle.velocity` (m/s, world), of a vehicle or a deck.
    Outputs: `position.x|y|z` (m), `velocity.x|y|z` (m/s), `time` of the sample (s), `valid`.

    Args:
        instance_name: Name of the component.
        seed: Seed of all random numbers, together with the name of the component.
        receiver: Set of default values: "standard" (u-blox NEO-M8N) or "rtk" (u-blox ZED-F9P).

    Raises:
        InputError: `receiver` is unknown or `seed` is not an integer of at least 0.
    """

    state_attributes = (*SampledSensor.state_attributes, "_drift")
    random_number_count = 9
    _drift: Sequence[float] = (0.0, 0.0, 0.0)

    def __init__(self, instance_name: str, seed: int = 0, receiver: str = "standard"):
        reader = JsonReader()
        numbers = GNSS_RECEIVERS[reader.choice(receiver, ("receiver",), list(GNSS_RECEIVERS))]
        check_arguments(reader, seed)
        noise = [(name, numbers[name]) for name in numbers if name.endswith(("_noise", "_drift"))]
        super().__init__(
            instance_name,
            [
                *vector_variables("vehicle.position", "xyz", "m", "input"),
                *vector_variables("vehicle.velocity", "xyz", "m/s", "input"),
                *(
                    real_parameter(
                        name, "m/s" if name[0:4] == "velo" else "m", value, "standard deviation"
                    )
                    for name, value in noise
                ),
                real_parameter(
                    "correlation_time", "s", numbers["correlation_time"], "of the drift", 1e-3
                ),
                seed_parameter(seed),
                boolean_variable("available", "parameter", "satellites are seen", True),
                *vector_variables("position", "xyz", "m", "output"),
                *vector_variables("velocity", "xyz", "m/s", "output"),
                *timing_variables(numbers["rate"], numbers["latency"]),
                boolean_variable("valid", "output", "there is a solution"),
            ],
        )

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Return a fix, or no values while `available` is false; see `SampledSensor.measure`."""
        p, row = self.parameters, self.noise[number]
        sigmas = (p["horizontal_drift"], p["horizontal_drift"], p["vertical_drift"])
        self._drift = [
            advance_gauss_markov(value, sigma, p["correlation_time"], elapsed, n)
            for value, sigma, n in zip(self._drift, sigmas, row[6:], strict=True)
        ]
        if not p["available"]:
            return (), (False,)
        noise = (p["horizontal_noise"],) * 2 + (p["vertical_noise"],) + (p["velocity_noise"],) * 3
        drift = (*self._drift, 0.0, 0.0, 0.0)
        terms = zip(self.inputs, drift, noise, row, strict=False)
        return [true + slow + sigma * n for true, slow, sigma, n in terms], (True,)
