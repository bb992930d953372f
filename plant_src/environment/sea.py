"""One realisation of an irregular sea: long-crested components in deep water, w^2 = g k.

    elevation(x, y, t) = sum a cos(k (x cos d + y sin d) - w t + phase)

The spectrum between LOWEST and HIGHEST times the peak frequency (99.5 % of the energy of a Pierson-Moskowitz sea) is cut into
bins of equal energy. Every bin gives one component of the same amplitude, sum a^2 / 2 = m0 of this part, at a frequency drawn
from its bin with the density of the spectrum: so the frequencies have no common divisor, and the sea does not repeat itself.
Directions are drawn likewise from bins of equal energy of the spreading function D(d) ~ cos^n(d - mean), |d - mean| < pi/2
(DNV-RP-C205, 3.5.8), in random order; without spreading all are the mean one.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .random_generator import generator
from .spectrum import GRAVITY, SPECTRA

#: the part of a spectrum that becomes waves, in peak frequencies
MIN_FREQUENCY_RATIO, MAX_FREQUENCY_RATIO = 0.5, 4.0

#: a vessel's equations have room for so many
MAX_COMPONENTS = 64

_pack_vector = struct.Struct("3d").pack_into
_FREQUENCY_COUNT, _DIRECTION_COUNT = 20_001, 2_001  # places at which the energy below is tabulated


class Sea(NamedTuple):
    """Components: amplitude (m), frequency (rad/s), wave number (rad/m), direction (rad), phase (rad), each of shape (n,).

    A direction is that towards which the wave runs, counter-clockwise from x.
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    wave_number: np.ndarray
    direction: np.ndarray
    phase: np.ndarray

    def elevation(self, x: float, y: float, time: float) -> float:
        """Height of the water (m) at a place in the world (m) and a time (s)."""
        return self.elevation_function()(x, y, time)

    def component_table(self) -> np.ndarray:
        """Amplitude, wave number along x and y, frequency and phase of the components, a row each, with zeros for the rest."""
        east, north = self.wave_number * np.cos(self.direction), self.wave_number * np.sin(self.direction)
        rows = np.zeros((5, MAX_COMPONENTS))
        rows[:, : len(self.phase)] = self.amplitude, east, north, self.frequency, self.phase
        return rows

    def elevation_function(self) -> Callable[[float, float, float], float]:
        """`elevation` for frequent use: with memory of its own it takes half the time."""
        east, north = self.wave_number * np.cos(self.direction), self.wave_number * np.sin(self.direction)
        rates = np.array([east, north, -self.frequency, self.phase])
        place, angles = np.array([0.0, 0.0, 0.0, 1.0]), np.empty(len(self.phase))
        where = place.data

        def elevation(x: float, y: float, time: float) -> float:
            _pack_vector(where, 0, x, y, time)
            return float(self.amplitude.dot(np.cos(place.dot(rates, angles), angles)))

        return elevation


@dataclass(frozen=True)
class Waves:
    """What a sea is made from: lengths in m, times in s, angles in rad; `spreading` is the power n, None: long crests."""

    spectrum: str
    significant_height: float
    peak_period: float
    gamma: float
    direction: float
    spreading: float | None
    components: int


CALM = Sea(*(np.zeros(0) for _ in Sea._fields))


def realise_sea(waves: Waves, seed: int) -> Sea:
    """The sea of this seed: equal arguments give equal numbers."""
    if waves.significant_height == 0:
        return CALM
    random, count = generator(seed, "waves"), waves.components
    peak = 2 * math.pi / waves.peak_period
    grid = np.linspace(MIN_FREQUENCY_RATIO * peak, MAX_FREQUENCY_RATIO * peak, _FREQUENCY_COUNT)
    density = SPECTRA[waves.spectrum](grid, waves.significant_height, waves.peak_period, waves.gamma)
    frequency, energy = _stratified_samples(grid, density, random, count)
    direction = np.full(count, waves.direction)
    if waves.spreading is not None:
        angles = np.linspace(-math.pi / 2, math.pi / 2, _DIRECTION_COUNT)
        spread, _ = _stratified_samples(angles, np.maximum(np.cos(angles), 0) ** waves.spreading, random, count)
        direction += random.permutation(spread)
    amplitude = np.full(count, math.sqrt(2 * energy / count))
    return Sea(amplitude, frequency, frequency**2 / GRAVITY, direction, random.uniform(0, 2 * math.pi, count))


def _stratified_samples(
    grid: np.ndarray, density: np.ndarray, random: np.random.Generator, count: int
) -> tuple[np.ndarray, float]:
    """One place from each of `count` bins of equal area under a density, in order; and the whole area."""
    below = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(grid))])
    shares = (np.arange(count) + random.uniform(size=count)) / count
    return np.interp(shares * below[-1], below, grid), float(below[-1])
