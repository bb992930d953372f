"""Current: mean velocity of the water, a linear change in time and a random variation."""

from __future__ import annotations

from dataclasses import dataclass

from .coloured_noise import Channel, ColouredNoise


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
