"""Barometer with the pressure altitude of the international standard atmosphere (ISO 2533)."""

from .counter_based_noise import advance_gauss_markov
from .signal_component import Measurement, SampledSensor, timing_variables
from .variable_declarations import real_parameter, real_variable, seed_parameter

#: p = p0 (1 - L z / T0)^EXPONENT of ISO 2533, with the lapse rate L and the temperature T0 at sea
#: level; the exponent is g M / (R L) with the molar mass M of air and the gas constant R
STANDARD_PRESSURE = 101325.0  # Pa
_LAPSE_PER_METRE = 0.0065 / 288.15  # 1/m
_EXPONENT = 9.80665 * 0.0289644 / (8.31446 * 0.0065)


def pressure_at(altitude: float, at_zero: float = STANDARD_PRESSURE) -> float:
    """Return the pressure (Pa) at `altitude` (m) if it is `at_zero` (Pa) at z = 0 (ISO 2533)."""
    return float(at_zero * (1 - _LAPSE_PER_METRE * altitude) ** _EXPONENT)


def altitude_at(pressure: float, at_zero: float = STANDARD_PRESSURE) -> float:
    """Return the altitude (m) with the pressure `pressure` (Pa), the inverse of `pressure_at`."""
    return float((1 - (pressure / at_zero) ** (1 / _EXPONENT)) / _LAPSE_PER_METRE)


class Barometer(SampledSensor):
    """Barometer with white noise and a slow drift.

    Error model: pressure = pressure of the true altitude + first-order Gauss-Markov drift + white
    noise. The drift has the relative accuracy of a Bosch BMP388, 8 Pa (data sheet
    BST-BMP388-DS001). Its correlation time and the noise of 1.2 Pa (0.1 m) are typical values. The
    parameter `pressure_at_zero` (Pa) models the weather; events may change it.

    Inputs: `vehicle.position.z` (m, world). Outputs: `pressure` (Pa), `altitude` (m, from the
    pressure with 101325 Pa at z = 0), `time` of the sample (s).

    Args:
        instance_name: Name of the component.
        seed: Seed of all random numbers, together with the name of the component.

    Raises:
        InputError: `seed` is not an integer of at least 0.
    """

    state_attributes = (*SampledSensor.state_attributes, "_drift")
    random_number_count = 2
    _drift = 0.0

    def __init__(self, instance_name: str, seed: int = 0):
        super().__init__(
            instance_name,
            [
                real_variable("vehicle.position.z", "m", "input"),
                real_parameter("noise", "Pa", 1.2, "standard deviation of the white noise"),
                real_parameter("drift", "Pa", 8.0, "standard deviation of the slow error"),
                real_parameter("correlation_time", "s", 300.0, "of the slow error", 1e-3),
                real_parameter(
                    "pressure_at_zero", "Pa", STANDARD_PRESSURE, "true pressure at z = 0", 5e4, 2e5
                ),
                seed_parameter(seed),
                real_variable("pressure", "Pa", "output"),
                real_variable(
                    "altitude",
                    "m",
                    "output",
                    description="of the centre of mass, from the pressure",
                ),
                *timing_variables(50.0),
            ],
        )

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Return pressure (Pa) and pressure altitude (m); see `SampledSensor.measure`."""
        p, (white, slow) = self.parameters, self.noise[number]
        self._drift = advance_gauss_markov(
            self._drift, p["drift"], p["correlation_time"], elapsed, slow
        )
        true = pressure_at(self.inputs[0], p["pressure_at_zero"])
        pressure = true + self._drift + p["noise"] * white
        return (pressure, altitude_at(pressure)), ()
