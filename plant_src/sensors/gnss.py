"""Satellite navigation: position and velocity of the vehicle in the world frame, at a rate and with a latency of its own."""

from __future__ import annotations

from collections.abc import Sequence

from ..json_reader import Reader
from .noise import gauss_markov
from .parameters import SATELLITE
from .sampled import Measurement, SampledSensor, timing
from .signals import accept, flag, parameter, read_seed, seed_parameter, vector


class Gnss(SampledSensor):
    """`position.x|y|z` (m), `velocity.x|y|z` (m/s), `time` (s) of the sample, `valid`.

    position = true + drift + white noise, drift: Gauss-Markov; velocity = true + white noise. `receiver` names a set of
    numbers ("standard", "rtk"), each of which can be changed as a parameter. While `available` is false nothing new comes and
    `valid` is false. `seed` with the component's name determines all noise. Inputs: `vehicle.position`, `vehicle.velocity`
    (of a vehicle or of a deck). Raises InputError for an unknown receiver.
    """

    memory = (*SampledSensor.memory, "_drift")
    random_numbers = 9
    _drift: Sequence[float]

    def __init__(self, instance_name: str, seed: int = 0, receiver: str = "standard"):
        reader = Reader()
        numbers = SATELLITE[reader.choice(receiver, ("receiver",), list(SATELLITE))]
        read_seed(reader, seed)
        accept(reader)
        noise = [(name, numbers[name]) for name in numbers if name.endswith(("_noise", "_drift"))]
        super().__init__(
            instance_name,
            [
                *vector("vehicle.position", "xyz", "m", "input"),
                *vector("vehicle.velocity", "xyz", "m/s", "input"),
                *(parameter(name, "m/s" if name[0:4] == "velo" else "m", value, "standard deviation") for name, value in noise),
                parameter("correlation_time", "s", numbers["correlation_time"], "of the drift", 1e-3),
                seed_parameter(seed),
                flag("available", "parameter", "satellites are seen", True),
                *vector("position", "xyz", "m", "output"),
                *vector("velocity", "xyz", "m/s", "output"),
                *timing(numbers["rate"], numbers["latency"]),
                flag("valid", "output", "there is a solution"),
            ],
        )

    def measure(self, number: int, elapsed: float) -> Measurement:
        p, row = self.parameters, self.noise[number]
        self._let_drift(elapsed, row[6:])
        if not p["available"]:
            return (), (False,)
        noise = (p["horizontal_noise"],) * 2 + (p["vertical_noise"],) + (p["velocity_noise"],) * 3
        drift = (*self._drift, 0.0, 0.0, 0.0)
        terms = zip(self.inputs, drift, noise, row, strict=False)
        return [true + slow + sigma * n for true, slow, sigma, n in terms], (True,)

    def _let_drift(self, elapsed: float, row: Sequence[float]) -> None:
        """From the last sample to this one; the first one is as far off as any."""
        p = self.parameters
        time = p["correlation_time"]
        sigmas = (p["horizontal_drift"], p["horizontal_drift"], p["vertical_drift"])
        if not elapsed:
            self._drift = [sigma * n for sigma, n in zip(sigmas, row, strict=True)]
            return
        factors = [gauss_markov(sigma, time, elapsed) for sigma in sigmas]
        self._drift = [keep * x + drive * n for x, (keep, drive), n in zip(self._drift, factors, row, strict=True)]
