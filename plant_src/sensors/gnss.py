"""GNSS receiver with its own sample rate and latency."""

from __future__ import annotations

from collections.abc import Sequence

from ..json_reader import JsonReader
from .counter_based_noise import gauss_markov_factors
from .device_data import GNSS_RECEIVERS
from .sampled_sensor import Measurement, SampledSensor, timing_variables
from .variable_declarations import (
    boolean_variable,
    check_seed,
    raise_problems,
    real_parameter,
    seed_parameter,
    vector_variables,
)


class Gnss(SampledSensor):
    """GNSS receiver with white noise and a slow position drift.

    Error model: position = true position + first-order Gauss-Markov drift + white noise; velocity =
    true velocity + white noise. Default values are those of a data sheet (`device_data.py`); each
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
    _drift: Sequence[float]

    def __init__(self, instance_name: str, seed: int = 0, receiver: str = "standard"):
        reader = JsonReader()
        numbers = GNSS_RECEIVERS[reader.choice(receiver, ("receiver",), list(GNSS_RECEIVERS))]
        check_seed(reader, seed)
        raise_problems(reader)
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
        self._advance_drift(elapsed, row[6:])
        if not p["available"]:
            return (), (False,)
        noise = (p["horizontal_noise"],) * 2 + (p["vertical_noise"],) + (p["velocity_noise"],) * 3
        drift = (*self._drift, 0.0, 0.0, 0.0)
        terms = zip(self.inputs, drift, noise, row, strict=False)
        return [true + slow + sigma * n for true, slow, sigma, n in terms], (True,)

    def _advance_drift(self, elapsed: float, row: Sequence[float]) -> None:
        """Advance the drift by `elapsed` (s), or draw it from its stationary distribution for the first sample (0 s)."""
        p = self.parameters
        time = p["correlation_time"]
        sigmas = (p["horizontal_drift"], p["horizontal_drift"], p["vertical_drift"])
        if not elapsed:
            self._drift = [sigma * n for sigma, n in zip(sigmas, row, strict=True)]
            return
        factors = [gauss_markov_factors(sigma, time, elapsed) for sigma in sigmas]
        self._drift = [
            keep * x + drive * n
            for x, (keep, drive), n in zip(self._drift, factors, row, strict=True)
        ]
