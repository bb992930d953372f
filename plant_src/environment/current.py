"""The motion of the water: a mean current, a linear change in time, and a random variation about both."""

from __future__ import annotations

from dataclasses import dataclass

from .coloured_noise import Channel, ColouredNoise


@dataclass(frozen=True)
class Ramp:
    """A change of the current (m/s) that grows linearly from `start` (s) over `duration` (s) and stays."""

    change: tuple[float, float]
    start: float
    duration: float

    def change_at(self, time: float) -> tuple[float, float]:
        share = min(max((time - self.start) / self.duration, 0.0), 1.0)
        return share * self.change[0], share * self.change[1]


@dataclass(frozen=True)
class Variation:
    """A first-order Gauss-Markov process in x and in y: standard deviation (m/s) and time constant (s)."""

    standard_deviation: float
    time_constant: float

    def create_noise(self, seed: int) -> ColouredNoise:
        """One current for all vessels."""
        return ColouredNoise(seed, "current", [Channel(self.standard_deviation, self.time_constant)] * 2)


@dataclass(frozen=True)
class Current:
    """Mean velocity of the water (m/s, world frame), and what changes it."""

    velocity: tuple[float, float]
    ramp: Ramp | None = None
    variation: Variation | None = None
