"""Realisation of an irregular sea by long-crested components in deep water, w^2 = g k.

    elevation(x, y, t) = sum a cos(k (x cos d + y sin d) - w t + phase)

The spectrum between MIN_FREQUENCY_RATIO and MAX_FREQUENCY_RATIO times the peak frequency (99.5 % of
the energy of a Pierson-Moskowitz sea) is divided into bins of equal energy. Each bin gives one
component. All components have the same amplitude with sum a^2 / 2 = m0 of this part. The frequency
is drawn from the bin with the density of the spectrum, so the frequencies have no common divisor
and the sea does not repeat itself. Directions are drawn in the same way from bins of equal energy
of the spreading function D(d) ~ cos^n(d - mean), |d - mean| < pi/2 (DNV-RP-C205, 3.5.8), and
assigned in random order. Without spreading all components have the mean direction.
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

#: range of frequencies of the components over the peak frequency
MIN_FREQUENCY_RATIO, MAX_FREQUENCY_RATIO = 0.5, 4.0

#: upper limit of the number of components, given by the equations of the vessels
MAX_COMPONENTS = 64

_pack_vector = struct.Struct("3d").pack_into
_FREQUENCY_COUNT, _DIRECTION_COUNT = 20_001, 2_001  # grid points of the tabulated energy


class Sea(NamedTuple):
    """Wave components, arrays of shape (n,).

    Attributes:
        amplitude: Amplitudes (m).
        frequency: Angular frequencies (rad/s).
        wave_number: Wave numbers (rad/m).
        direction: Directions of propagation, counter-clockwise from x (rad).
        phase: Phases at the origin (rad).
    """

    amplitude: np.ndarray
    frequency: np.ndarray
    wave_number: np.ndarray
    direction: np.ndarray
    phase: np.ndarray

    @property
    def highest_elevation(self) -> float:
        """Sum of all amplitudes (m), which no crest exceeds."""
        return float(self.amplitude.sum())

    def elevation(self, x: float, y: float, time: float) -> float:
        """Return the elevation of the water (m) at a position in the world frame (m) and a time (s)."""
        return self.elevation_function()(x, y, time)

    def component_table(self) -> np.ndarray:
        """Return amplitude, wave number along x and y, frequency and phase, shape (5, MAX_COMPONENTS), padded with zeros."""
        east, north = (
            self.wave_number * np.cos(self.direction),
            self.wave_number * np.sin(self.direction),
        )
        rows = np.zeros((5, MAX_COMPONENTS))
        rows[:, : len(self.phase)] = self.amplitude, east, north, self.frequency, self.phase
        return rows

    def elevation_function(self) -> Callable[[float, float, float], float]:
        """Return a function equal to `elevation` that reuses its arrays and thus takes half the time."""
        east, north = (
            self.wave_number * np.cos(self.direction),
            self.wave_number * np.sin(self.direction),
        )
        rates = np.array([east, north, -self.frequency, self.phase])
        arguments, angles = np.array([0.0, 0.0, 0.0, 1.0]), np.empty(len(self.phase))
        arguments_data = arguments.data

        def elevation(x: float, y: float, time: float) -> float:
            _pack_vector(arguments_data, 0, x, y, time)
            return float(self.amplitude.dot(np.cos(arguments.dot(rates, angles), angles)))

        return elevation


@dataclass(frozen=True)
class Waves:
    """Parameters of a sea.

    Attributes:
        spectrum: Name of the spectrum (`spectrum.SPECTRA`).
        significant_height: Hs (m).
        peak_period: Tp (s).
        gamma: Peak enhancement factor.
        direction: Mean direction of propagation, counter-clockwise from x (rad).
        spreading: Exponent n of the spreading function, or None for long-crested waves.
        components: Number of components.
    """

    spectrum: str
    significant_height: float
    peak_period: float
    gamma: float
    direction: float
    spreading: float | None
    components: int


#: sea without waves
CALM = Sea(*(np.zeros(0) for _ in Sea._fields))


def realise_sea(waves: Waves, seed: int) -> Sea:
    """Return the realisation of a sea for a seed; equal arguments give equal numbers."""
    if waves.significant_height == 0:
        return CALM
    random, count = generator(seed, "waves"), waves.components
    peak = 2 * math.pi / waves.peak_period
    grid = np.linspace(MIN_FREQUENCY_RATIO * peak, MAX_FREQUENCY_RATIO * peak, _FREQUENCY_COUNT)
    density = SPECTRA[waves.spectrum](
        grid, waves.significant_height, waves.peak_period, waves.gamma
    )
    frequency, energy = _stratified_samples(grid, density, random, count)
    direction = np.full(count, waves.direction)
    if waves.spreading is not None:
        angles = np.linspace(-math.pi / 2, math.pi / 2, _DIRECTION_COUNT)
        spread, _ = _stratified_samples(
            angles, np.maximum(np.cos(angles), 0) ** waves.spreading, random, count
        )
        direction += random.permutation(spread)
    amplitude = np.full(count, math.sqrt(2 * energy / count))
    return Sea(
        amplitude,
        frequency,
        frequency**2 / GRAVITY,
        direction,
        random.uniform(0, 2 * math.pi, count),
    )


def _stratified_samples(
    grid: np.ndarray, density: np.ndarray, random: np.random.Generator, count: int
) -> tuple[np.ndarray, float]:
    """Return one sample from each of `count` bins with equal area under a density, in ascending order, and the total area."""
    cumulative = np.concatenate(
        [[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(grid))]
    )
    quantiles = (np.arange(count) + random.uniform(size=count)) / count
    return np.interp(quantiles * cumulative[-1], cumulative, grid), float(cumulative[-1])
