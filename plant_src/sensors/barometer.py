"""Barometer: air pressure, and the altitude that follows from it in the standard atmosphere."""

from __future__ import annotations

from .counter_based_noise import gauss_markov_factors
from .sampled_sensor import Measurement, SampledSensor, timing_variables
from .signal_component import real_parameter, real_variable, seed_parameter

#: international standard atmosphere, ISO 2533: p = p0 (1 - L z / T0)^EXPONENT
STANDARD_PRESSURE = 101325.0  # Pa
_LAPSE_PER_METRE = 0.0065 / 288.15  # 1/m
_EXPONENT = 9.80665 * 0.0289644 / (8.31446 * 0.0065)


def pressure_at(altitude: float, at_zero: float = STANDARD_PRESSURE) -> float:
    """Pressure (Pa) at an altitude (m) when it is `at_zero` (Pa) on the water."""
    return at_zero * (1 - _LAPSE_PER_METRE * altitude) ** _EXPONENT


def altitude_at(pressure: float, at_zero: float = STANDARD_PRESSURE) -> float:
    """Altitude (m) at which there is a pressure (Pa)."""
    return (1 - (pressure / at_zero) ** (1 / _EXPONENT)) / _LAPSE_PER_METRE


class Barometer(SampledSensor):
    """`pressure` (Pa), `altitude` (m, what a reader makes of it with the standard pressure at zero), `time` (s).

    pressure = that of the true altitude + drift (Gauss-Markov) + white noise. The drift is the relative accuracy of 8 Pa of a
    Bosch BMP388 (data sheet BST-BMP388-DS001); its time and the noise of 1.2 Pa, or 0.1 m, are typical. `pressure_at_zero` (Pa)
    may change in time like the weather. Inputs: `vehicle.position.z`.
    """

    state_attributes = (*SampledSensor.state_attributes, "_drift")
    random_number_count = 2
    _drift: float

    def __init__(self, instance_name: str, seed: int = 0):
        super().__init__(
            instance_name,
            [
                real_variable("vehicle.position.z", "m", "input"),
                real_parameter("noise", "Pa", 1.2, "standard deviation of the white noise"),
                real_parameter("drift", "Pa", 8.0, "standard deviation of the slow error"),
                real_parameter("correlation_time", "s", 300.0, "of the slow error", 1e-3),
                real_parameter("pressure_at_zero", "Pa", STANDARD_PRESSURE, "true pressure at z = 0", 5e4, 2e5),
                seed_parameter(seed),
                real_variable("pressure", "Pa", "output"),
                real_variable("altitude", "m", "output", description="of the centre of mass, from the pressure"),
                *timing_variables(50.0),
            ],
        )

    def measure(self, number: int, elapsed: float) -> Measurement:
        p, (white, slow) = self.parameters, self.noise[number]
        if elapsed:
            keep, drive = gauss_markov_factors(p["drift"], p["correlation_time"], elapsed)
            self._drift = keep * self._drift + drive * slow
        else:
            self._drift = p["drift"] * slow
        pressure = pressure_at(self.inputs[0], p["pressure_at_zero"]) + self._drift + p["noise"] * white
        return (pressure, altitude_at(pressure)), ()
