"""Coloured noise and Dryden turbulence against the theory of their filters."""

from __future__ import annotations

import math

import numpy as np
import pytest
from plant_validation import MeasurementCheck
from scipy.signal import welch

from plant_src.environment.coloured_noise import GRID_STEP, Channel, ColouredNoise
from plant_src.environment.wind_and_current import (
    DrydenGusts,
    Turbulence,
    Wind,
    turbulence_intensities,
    turbulence_scale_lengths,
)

DRYDEN = "Dryden, MIL-F-8785C"
COUNT = 200_000
FAST, SLOW = 0.02, 0.5  # time constants (s)


def sampled(*channels: Channel, seed: int = 1, count: int = COUNT) -> np.ndarray:
    noise = ColouredNoise(seed, ["test"], channels)
    return np.array([noise[k] for k in range(count)]).T


def correlation(values: np.ndarray, lag: int) -> float:
    return float(np.mean(values[:-lag] * values[lag:]) / np.mean(values**2))


@pytest.fixture(scope="module")
def first_order() -> np.ndarray:
    return sampled(Channel(2.0, FAST), Channel(0.7, SLOW))


@pytest.fixture(scope="module")
def second_order() -> np.ndarray:
    return sampled(Channel(2.0, FAST, math.sqrt(3)), Channel(0.7, SLOW, math.sqrt(3)))


def test_noise_has_its_deviation(first_order, second_order):
    """Standard error of a deviation: sigma sqrt(T / duration), here 0.2 % and 1.6 %."""
    for values in (first_order, second_order):
        assert values[0].std() == pytest.approx(2.0, rel=0.01)
        assert values[1].std() == pytest.approx(0.7, rel=0.05)


@pytest.mark.parametrize("lag", [1, 2, 4])
def test_first_order_noise_is_discretised_exactly(first_order, lag, measured: MeasurementCheck):
    """exp(-t / T), also where the grid is as coarse as half a time constant: Euler's method would
    have 0.5 at the first lag.
    """
    found, expected = correlation(first_order[0], lag), math.exp(-lag * GRID_STEP / FAST)
    measured(
        "Wind and current",
        "correlation of first-order noise",
        found,
        expected,
        "1",
        "exp(-t/T)",
        within=0.01,
    )


@pytest.mark.parametrize("lag", [1, 2, 4])
def test_second_order_noise_is_discretised_exactly(second_order, lag, measured: MeasurementCheck):
    """The transform of (1 + 3 (T w)^2) / (1 + (T w)^2)^2 is (1 - t / (2 T)) exp(-t / T)."""
    t = lag * GRID_STEP / FAST
    found, expected = correlation(second_order[0], lag), (1 - t / 2) * math.exp(-t)
    measured(
        "Wind and current",
        "correlation of transverse gusts",
        found,
        expected,
        "1",
        "(1 - t/2T) exp(-t/T)",
        within=0.01,
    )


def test_noise_is_continuous_across_blocks(first_order):
    """The pairs of last and first value of the blocks of 256 are correlated as all others."""
    last, first = first_order[0][255:-1:256], first_order[0][256::256]
    assert np.mean(last * first) / 4.0 == pytest.approx(math.exp(-GRID_STEP / FAST), abs=0.1)


def test_channels_do_not_depend_on_each_other(first_order):
    assert abs(np.corrcoef(first_order)[0, 1]) < 0.02


def test_noise_is_a_function_of_its_index():
    noise, other = (ColouredNoise(3, ["uav"], [Channel(1.0, 0.3, 1.7)]) for _ in range(2))
    expected = [noise[k] for k in range(3000)]
    for k in (2999, 0, 511, 512, 2047, 1, 2999):
        assert other[k] == expected[k]


def test_other_names_and_seeds_give_independent_noise():
    noises = [
        ColouredNoise(seed, [name], [Channel(1.0, 0.3)])
        for seed, name in ((1, "uav"), (1, "usv"), (2, "uav"))
    ]
    assert len({noise[100] for noise in noises}) == 3


def dryden(
    omega: np.ndarray, deviation: float, length: float, speed: float, transverse: bool
) -> np.ndarray:
    """MIL-F-8785C, 3.7.2.2: one-sided spectra over the angular frequency, whose area is the
    variance.
    """
    x = (length * omega / speed) ** 2
    if transverse:
        return deviation**2 * length / (math.pi * speed) * (1 + 3 * x) / (1 + x) ** 2
    return 2 * deviation**2 * length / (math.pi * speed) / (1 + x)


@pytest.fixture(scope="module")
def gusts() -> tuple[Turbulence, np.ndarray]:
    turbulence = Turbulence(turbulence_intensities(5.0, 6.096), 6.096, 5.0)
    made = DrydenGusts(Wind((5.0, 0.0, 0.0), turbulence), turbulence, 1, ["uav"])
    return turbulence, np.array([made[k] for k in range(250_000)]).T


@pytest.mark.parametrize(("axis", "transverse"), [(0, False), (1, True), (2, True)])
def test_turbulence_has_drydens_spectrum(gusts, axis, transverse, measured: MeasurementCheck):
    turbulence, values = gusts
    length = turbulence_scale_lengths(6.096)[transverse and axis == 2]
    frequency, density = welch(values[axis], 1 / GRID_STEP, nperseg=8192)
    omega = 2 * math.pi * frequency
    expected = dryden(omega, turbulence.intensities[axis], length, 5.0, transverse)
    for low, high in ((0.15, 0.6), (0.6, 2.5), (2.5, 10.0), (10.0, 40.0)):
        band = (omega > low) & (omega < high)
        found, wanted, case = (
            (density[band] / (2 * math.pi)).mean(),
            expected[band].mean(),
            "uvw"[axis],
        )
        measured(
            "Wind and current",
            "spectrum of gusts, 4 bands",
            found,
            wanted,
            "m2/s",
            DRYDEN,
            relative=0.1,
            case=case,
        )


def test_turbulence_has_drydens_deviations(gusts, measured: MeasurementCheck):
    """At 20 ft in a wind of 5 m/s: 0.1 W20, and that over (0.177 + 0.000823 h)^0.4."""
    _, values = gusts
    level = 0.5 / (0.177 + 0.000823 * 20) ** 0.4
    deviation = values.std(axis=1)
    measured(
        "Wind and current",
        "standard deviations of gusts",
        deviation,
        [level, level, 0.5],
        "m/s",
        DRYDEN,
        relative=0.05,
    )


def test_scales_are_those_of_the_standard():
    """Both forms meet at 1000 ft, where all scales are 1000 ft and all deviations 0.1 W20."""
    assert turbulence_scale_lengths(304.8) == pytest.approx((304.8, 304.8))
    assert turbulence_intensities(10.0, 304.8) == pytest.approx((1.0, 1.0, 1.0))
    assert turbulence_scale_lengths(6.096)[0] == pytest.approx(
        20 / (0.177 + 0.01646) ** 1.2 * 0.3048
    )


def test_gusts_lie_along_the_wind():
    """Turned by the wind's direction, the same noise: u along it, v to the left."""
    turbulence = Turbulence((1.0, 0.3, 0.2), 10.0, 5.0)
    east, north = (
        DrydenGusts(Wind(velocity, turbulence), turbulence, 1, ["uav"])[40]
        for velocity in ((5.0, 0, 0), (0, 5.0, 0))
    )
    assert north == pytest.approx((-east[1], east[0], east[2]))
