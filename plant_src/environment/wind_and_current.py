"""Wind and current: mean velocities, wind profile, Dryden turbulence, changes of the current.

The turbulence is the low-altitude model of MIL-F-8785C, 3.7.3, with the height h (ft), the wind
speed W20 at 20 ft and the speed V at which the frozen turbulence field passes:

    intensities w: 0.1 W20;  u, v: 0.1 W20 / (0.177 + 0.000823 h)^0.4
    scales      Lw = h;  Lu = Lv = h / (0.177 + 0.000823 h)^1.2
    spectra     u: 2 su^2 Lu / (pi V) / (1 + (Lu w / V)^2)
                v, w: s^2 L / (pi V) (1 + 3 (L w / V)^2) / (1 + (L w / V)^2)^2

u is along the mean wind, v to its left, w up. V and h are constants of the scenario, not those of
the vehicle, because multirotors and vessels are slow compared with the wind. Gusts are therefore
functions of time alone. Those of different vehicles are independent.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from .coloured_noise import Channel, ColouredNoise

FOOT = 0.3048  # m

#: range of heights of the low-altitude model, 10 ft to 1000 ft (m)
MIN_HEIGHT, MAX_HEIGHT = 10 * FOOT, 1000 * FOOT

#: function from the height above the still water (m) to the fraction of the mean wind
WindProfile = Callable[[float], float]


@dataclass(frozen=True)
class Turbulence:
    """Parameters of the turbulence.

    Attributes:
        intensities: Standard deviations of u, v and w (m/s).
        height: Height h (m).
        airspeed: Speed V at which the turbulence field passes (m/s).
    """

    intensities: tuple[float, float, float]
    height: float
    airspeed: float

    def channels(self) -> list[Channel]:
        """Return the shaping filters of u, v and w."""
        along, upwards = turbulence_scale_lengths(self.height)
        lengths, leads = (along, along, upwards), (1.0, math.sqrt(3), math.sqrt(3))
        return [
            Channel(s, length / self.airspeed, lead)
            for s, length, lead in zip(self.intensities, lengths, leads, strict=True)
        ]


@dataclass(frozen=True)
class Wind:
    """Mean velocity of the air (m/s, world frame), its profile over the height, turbulence."""

    velocity: tuple[float, float, float]
    turbulence: Turbulence | None = None
    profile: WindProfile | None = None


def _height_factor(height: float) -> float:
    """Return 0.177 + 0.000823 h for a height in m."""
    return 0.177 + 0.000823 * height / FOOT


def turbulence_scale_lengths(height: float) -> tuple[float, float]:
    """Return the scale lengths Lu = Lv and Lw (m) at a height (m)."""
    return height / _height_factor(height) ** 1.2, height


def turbulence_intensities(speed_20ft: float, height: float) -> tuple[float, float, float]:
    """Return the intensities of u, v, w (m/s) at a height (m) for a wind at 20 ft (m/s)."""
    upwards = 0.1 * speed_20ft
    along = upwards / _height_factor(height) ** 0.4
    return along, along, upwards


def power_law_profile(exponent: float, reference_height: float) -> WindProfile:
    """Return the profile (z / zr)^exponent for a reference height zr (m).

    Below the still water it is 0.
    """
    return lambda z: (max(z, 0.0) / reference_height) ** exponent


def logarithmic_profile(roughness: float, reference_height: float) -> WindProfile:
    """Return the profile ln(z / z0) / ln(zr / z0) for a reference height zr (m).

    Below the roughness length z0 (m) it is 0.
    """
    reference = math.log(reference_height / roughness)
    return lambda z: math.log(max(z, roughness) / roughness) / reference


class DrydenGusts(ColouredNoise):
    """Turbulence at several vehicles (m/s, world frame): x, y and z of each vehicle in order."""

    def __init__(self, wind: Wind, turbulence: Turbulence, seed: int, vehicles: Sequence[str]):
        x, y, _ = wind.velocity
        direction = math.atan2(y, x)
        self._cos, self._sin = math.cos(direction), math.sin(direction)
        super().__init__(seed, [f"wind/{vehicle}" for vehicle in vehicles], turbulence.channels())

    def _map_channels(self, values: np.ndarray) -> np.ndarray:
        u, v, w = values[0::3], values[1::3], values[2::3]
        x, y = self._cos * u - self._sin * v, self._sin * u + self._cos * v
        return np.stack([x, y, w], axis=1).reshape(values.shape)


@dataclass(frozen=True)
class Ramp:
    """A linear change of the current.

    Attributes:
        change: Final change of the velocity (m/s, world frame).
        start: Time at which the change starts (s).
        duration: Duration of the change (s).
    """

    change: tuple[float, float]
    start: float
    duration: float

    def change_at(self, time: float) -> tuple[float, float]:
        """Return the change (m/s, world frame) at a time (s)."""
        fraction = min(max((time - self.start) / self.duration, 0.0), 1.0)
        return fraction * self.change[0], fraction * self.change[1]


@dataclass(frozen=True)
class Variation:
    """Independent first-order Gauss-Markov processes in x and y.

    Standard deviation (m/s) and time constant (s).
    """

    standard_deviation: float
    time_constant: float

    def create_noise(self, seed: int) -> ColouredNoise:
        """Return the variation of the current, which is the same for all vessels."""
        return ColouredNoise(
            seed, ["current"], [Channel(self.standard_deviation, self.time_constant)] * 2
        )


@dataclass(frozen=True)
class Current:
    """Mean velocity of the water (m/s, world frame), and its changes in time."""

    velocity: tuple[float, float]
    ramp: Ramp | None = None
    variation: Variation | None = None
