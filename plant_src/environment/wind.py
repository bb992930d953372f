"""The air: mean wind, its growth with height, and Dryden turbulence.

Turbulence is that of MIL-F-8785C, 3.7.3, in its low-altitude form. With h the height (ft), W20 the wind speed at 20 ft and V
the speed at which the frozen field passes:

    deviations  w: 0.1 W20;  u, v: 0.1 W20 / (0.177 + 0.000823 h)^0.4
    scales      Lw = h;  Lu = Lv = h / (0.177 + 0.000823 h)^1.2
    spectra     u: 2 su^2 Lu / (pi V) / (1 + (Lu w / V)^2)
                v, w: s^2 L / (pi V) (1 + 3 (L w / V)^2) / (1 + (L w / V)^2)^2

u lies along the mean wind, v to its left, w is up. Multirotors and vessels are slow and the filters are fixed, so V and h are
those of the scenario (the mean wind's speed if nothing else is said), not those of the vehicle: gusts are then functions of
time alone. Every vehicle meets gusts of its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .coloured_noise import Channel, ColouredNoise

FOOT = 0.3048

#: heights (m) for which the low-altitude model is made: 10 ft to 1000 ft
MIN_HEIGHT, MAX_HEIGHT = 10 * FOOT, 1000 * FOOT

WindProfile = Callable[[float], float]


@dataclass(frozen=True)
class Turbulence:
    """Deviations (su, sv, sw) in m/s, height in m and speed of passage in m/s."""

    intensities: tuple[float, float, float]
    height: float
    airspeed: float

    def channels(self) -> list[Channel]:
        """The filters of u, v and w."""
        along, upwards = turbulence_scale_lengths(self.height)
        lengths, leads = (along, along, upwards), (1.0, math.sqrt(3), math.sqrt(3))
        return [
            Channel(s, length / self.airspeed, lead) for s, length, lead in zip(self.intensities, lengths, leads, strict=True)
        ]


@dataclass(frozen=True)
class Wind:
    """Mean velocity of the air (m/s, world frame), turbulence, and the share of it at a height (m) above the still water."""

    velocity: tuple[float, float, float]
    turbulence: Turbulence | None = None
    profile: WindProfile | None = None


def _height_factor(height: float) -> float:
    return 0.177 + 0.000823 * height / FOOT


def turbulence_scale_lengths(height: float) -> tuple[float, float]:
    """Lu = Lv and Lw in m at a height in m."""
    return height / _height_factor(height) ** 1.2, height


def turbulence_intensities(speed_20ft: float, height: float) -> tuple[float, float, float]:
    """su, sv and sw in m/s at a height in m, from the wind speed in m/s at 20 ft."""
    upwards = 0.1 * speed_20ft
    along = upwards / _height_factor(height) ** 0.4
    return along, along, upwards


def power_law_profile(exponent: float, reference_height: float) -> WindProfile:
    """(z / zr)^exponent, zero below the water."""
    return lambda z: (max(z, 0.0) / reference_height) ** exponent


def logarithmic_profile(roughness: float, reference_height: float) -> WindProfile:
    """ln(z / z0) / ln(zr / z0), zero up to the roughness length z0 (m)."""
    whole = math.log(reference_height / roughness)
    return lambda z: math.log(max(z, roughness) / roughness) / whole


class DrydenGusts(ColouredNoise):
    """The turbulence that one vehicle meets, in the world frame."""

    def __init__(self, wind: Wind, turbulence: Turbulence, seed: int, vehicle: str):
        x, y, _ = wind.velocity
        direction = math.atan2(y, x)
        self._cos, self._sin = math.cos(direction), math.sin(direction)
        super().__init__(seed, f"wind/{vehicle}", turbulence.channels())

    def _map_channels(self, values: np.ndarray) -> np.ndarray:
        u, v, w = values
        return np.array([self._cos * u - self._sin * v, self._sin * u + self._cos * v, w])
