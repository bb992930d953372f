"""Wave spectra, and irregular seas of long-crested components in deep water, w^2 = g k.

    elevation(x, y, t) = sum a cos(k (x cos d + y sin d) - w t + phase)

The spectrum between MIN_FREQUENCY_RATIO and MAX_FREQUENCY_RATIO times the peak frequency (99.5 % of
the energy of a Pierson-Moskowitz sea) is divided into bins of equal energy. Each bin gives one
component. All components have the same amplitude with sum a^2 / 2 = m0 of this part. The frequency
is drawn from the bin with the density of the spectrum, so the frequencies have no common divisor
and the sea does not repeat itself. Directions are drawn in the same way from bins of equal energy
of the spreading function D(d) ~ cos^n(d - mean), |d - mean| < pi/2 (DNV-RP-C205, 3.5.8), and
assigned in random order. Without spreading all components have the mean direction.
"""

import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .coloured_noise import generator

GRAVITY = 9.81  # m/s2

#: Hs (m) of the sea states of WMO code table 3700 (Douglas sea scale): middle of each range, for
#: "phenomenal" (9) its lower end
SIGNIFICANT_HEIGHTS = (0.0, 0.05, 0.3, 0.875, 1.875, 3.25, 5.0, 7.5, 11.5, 14.0)

#: peak enhancement factor: mean JONSWAP sea, and range in which the normalising factor is valid
GAMMA, MIN_GAMMA, MAX_GAMMA = 3.3, 1.0, 7.0

#: function of frequencies (rad/s), Hs (m), Tp (s) and gamma
Spectrum = Callable[[np.ndarray, float, float, float], np.ndarray]


def pierson_moskowitz(
    frequency: np.ndarray, significant_height: float, peak_period: float, _gamma: float = 1.0
) -> np.ndarray:
    """Return the Pierson-Moskowitz spectrum.

    Args:
        frequency: Angular frequencies > 0 (rad/s).
        significant_height: Hs (m).
        peak_period: Tp (s).
        _gamma: Unused; all spectra have the same arguments.

    Returns:
        S (m2 s), with the shape of `frequency`.
    """
    ratio = (2 * math.pi / peak_period / frequency) ** 4
    spectrum: np.ndarray = (
        5 / 16 * significant_height**2 * ratio / frequency * np.exp(-5 / 4 * ratio)
    )
    return spectrum


def jonswap(
    frequency: np.ndarray, significant_height: float, peak_period: float, gamma: float = GAMMA
) -> np.ndarray:
    """Return the JONSWAP spectrum.

    Args:
        frequency: Angular frequencies > 0 (rad/s).
        significant_height: Hs (m).
        peak_period: Tp (s).
        gamma: Peak enhancement factor.

    Returns:
        S (m2 s), with the shape of `frequency`.
    """
    peak = 2 * math.pi / peak_period
    width = np.where(frequency <= peak, 0.07, 0.09)
    enhancement = gamma ** np.exp(-(((frequency - peak) / (width * peak)) ** 2) / 2)
    factor = 1 - 0.287 * math.log(gamma)
    return factor * pierson_moskowitz(frequency, significant_height, peak_period) * enhancement


SPECTRA: Mapping[str, Spectrum] = {"pierson_moskowitz": pierson_moskowitz, "jonswap": jonswap}


def fully_developed_period(significant_height: float) -> float:
    """Return the peak period (s) of a fully developed sea with a height Hs (m).

    Wp = 0.4 sqrt(g / Hs) (Fossen 2021, 10.2.1).
    """
    return 2 * math.pi / 0.4 * math.sqrt(significant_height / GRAVITY)


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
        """Return the elevation of the water (m) at a position (m, world frame) and a time (s)."""
        return self.elevation_function()(x, y, time)

    def component_table(self) -> np.ndarray:
        """Return amplitude, wave number along x and y, frequency and phase of each component.

        The shape is (5, MAX_COMPONENTS), padded with zeros.
        """
        east, north = (
            self.wave_number * np.cos(self.direction),
            self.wave_number * np.sin(self.direction),
        )
        rows = np.zeros((5, MAX_COMPONENTS))
        rows[:, : len(self.phase)] = self.amplitude, east, north, self.frequency, self.phase
        return rows

    def elevation_function(self) -> Callable[[float, float, float], float]:
        """Return a function equal to `elevation` that reuses its arrays, in half the time."""
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
    """Return a sample from each of `count` bins of equal area under a density, and the area.

    The samples are in ascending order; the area is the total one.
    """
    # Inverse transform sampling: the samples are where the area below the density reaches quantiles
    # of its total. One quantile is drawn from each of `count` equal parts of 0 ... 1 (stratified),
    # so every realisation has components in all parts of the spectrum.
    cumulative = np.concatenate(
        [[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(grid))]
    )
    quantiles = (np.arange(count) + random.uniform(size=count)) / count
    return np.interp(quantiles * cumulative[-1], cumulative, grid), float(cumulative[-1])
