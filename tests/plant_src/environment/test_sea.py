"""Waves: spectra against their integrals, realisations against spectra."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from plant_validation import MeasurementCheck
from scipy.integrate import quad

from plant_src.environment import sea
from plant_src.environment.sea import (
    SIGNIFICANT_HEIGHTS,
    fully_developed_period,
    jonswap,
    pierson_moskowitz,
)

HALF_HOUR = np.arange(0.0, 1800.0, 0.25)
SWELL = {"significant_height": 2.0, "peak_period": 9.0}
CHOP = {"significant_height": 0.05, "peak_period": 2.0, "spectrum": "jonswap"}


def area(spectrum, *arguments, low=0.0, high=math.inf):
    """m0 by adaptive quadrature, in pieces of the peak frequency."""
    peak = 2 * math.pi / arguments[1]
    cuts = [peak * r for r in (0.3, 0.8, 1.0, 1.3, 2.0, 4.0, 10.0, 1000.0)]
    cuts = [
        low,
        *(cut for cut in cuts if low < cut < high),
        *([high] if math.isfinite(high) else []),
    ]
    density = lambda w: float(spectrum(np.array(max(w, 1e-9)), *arguments))  # noqa: E731
    return sum(quad(density, a, b, epsabs=1e-14)[0] for a, b in pairwise(cuts))


def realisation(seed: int = 0, **waves):
    return sea({"seed": seed, "waves": waves})


def test_pierson_moskowitz_has_its_significant_height(measured: MeasurementCheck):
    height = 4 * math.sqrt(area(pierson_moskowitz, 2.5, 9.0))
    measured(
        "Waves",
        "4 sqrt(m0), ITTC-modified Pierson-Moskowitz",
        height,
        2.5,
        "m",
        "Hs, quadrature",
        relative=1e-6,
    )


@pytest.mark.parametrize("gamma", [1.0, 2.0, 3.3, 5.0, 7.0])
def test_jonswap_has_its_significant_height(gamma, measured: MeasurementCheck):
    height, case = 4 * math.sqrt(area(jonswap, 2.5, 9.0, gamma)), f"gamma {gamma:g}"
    measured(
        "Waves",
        "4 sqrt(m0), JONSWAP (DNV-RP-C205)",
        height,
        2.5,
        "m",
        "Hs, quadrature",
        relative=0.01,
        case=case,
    )


def test_pierson_moskowitz_is_that_of_the_ittc(measured: MeasurementCheck):
    """S = A / w^5 exp(-B / w^4), A = 487 Hs^2 / T0^4, B = 1949 / T0^4."""
    w = np.linspace(0.6, 4.0, 50)
    ittc = 487 * 2.5**2 / 9.0**4 / w**5 * np.exp(-1949 / 9.0**4 / w**4)
    measured(
        "Waves",
        "density from 0.6 to 4 rad/s",
        pierson_moskowitz(w, 2.5, 9.0),
        ittc,
        "m2.s",
        "ITTC formula",
        relative=2e-3,
    )


def test_jonswap_is_peaked_by_gamma():
    peak = np.array([2 * math.pi / 9.0])
    ratio = jonswap(peak, 2.5, 9.0, 3.3) / pierson_moskowitz(peak, 2.5, 9.0)
    assert ratio == pytest.approx(3.3 * (1 - 0.287 * math.log(3.3)), rel=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_amplitudes_hold_the_energy_between_the_cuts(seed, measured: MeasurementCheck):
    """The fraction of a Pierson-Moskowitz sea below r peak frequencies is exp(-5/4 / r^4)."""
    part = math.exp(-1.25 / 4**4) - math.exp(-1.25 / 0.5**4)
    waves = realisation(seed, **SWELL)
    m0 = (waves.amplitude**2 / 2).sum()
    measured(
        "Waves",
        "m0 of 64 components",
        m0,
        part * 2.0**2 / 16,
        "m2",
        "integral between the cuts",
        relative=1e-5,
    )
    measured(
        "Waves", "4 sqrt(m0) of 64 components", 4 * math.sqrt(m0), 2.0, "m", "Hs", relative=0.01
    )


@pytest.mark.parametrize("waves", [SWELL, {**SWELL, "spectrum": "jonswap", "spreading": 2}, CHOP])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_half_an_hour_at_a_point_has_the_significant_height(
    waves, seed, measured: MeasurementCheck
):
    components = realisation(seed, **waves)
    heights = np.array([components.elevation(12.0, -7.0, time) for time in HALF_HOUR])
    found, expected = 4 * heights.std(), waves["significant_height"]
    measured(
        "Waves",
        "4 standard deviations of 30 min, 3 seas, 3 seeds",
        found,
        expected,
        "m",
        "Hs",
        relative=0.05,
    )


def test_the_energy_is_distributed_as_in_the_spectrum():
    """Below any frequency the components hold what the spectrum does, up to one component."""
    waves = realisation(3, **CHOP)
    one = waves.amplitude[0] ** 2 / 2
    peak = math.pi
    for ratio in (0.8, 0.95, 1.05, 1.3, 2.0, 3.0):
        wanted = area(jonswap, 0.05, 2.0, low=0.5 * peak, high=ratio * peak)
        assert abs((waves.frequency < ratio * peak).sum() * one - wanted) < 1.05 * one


def test_dispersion_is_exact(measured: MeasurementCheck):
    waves = realisation(**SWELL)
    error = waves.wave_number - waves.frequency**2 / 9.81
    measured("Waves", "wave numbers", error, 0.0, "rad/m", "dispersion in deep water")


def test_elevation_is_the_sum_of_travelling_waves(measured: MeasurementCheck):
    waves = realisation(4, **SWELL, direction=0.7, spreading=4)
    x, y, t = 31.0, -12.0, 77.5
    wave_vector = waves.wave_number * np.exp(1j * waves.direction)
    phases = wave_vector.real * x + wave_vector.imag * y - waves.frequency * t + waves.phase
    expected = (waves.amplitude * np.exp(1j * phases)).sum().real
    error = waves.elevation(x, y, t) - expected
    measured(
        "Waves",
        "elevation at a place and time",
        error,
        0.0,
        "m",
        "complex sum of components",
        within=1e-12,
    )


def test_long_crests_run_one_way():
    """Equal phase means equal height: a step along the crest changes nothing."""
    waves = realisation(**SWELL, direction=math.pi / 2)
    assert waves.elevation(50.0, 3.0, 8.0) == pytest.approx(
        waves.elevation(-20.0, 3.0, 8.0), abs=1e-9
    )
    assert set(waves.direction) == {math.pi / 2}


@pytest.mark.parametrize("power", [1, 2, 10])
def test_short_crests_spread_as_the_power_of_the_cosine(power, measured: MeasurementCheck):
    """E[cos^2 d] = (n + 1) / (n + 2) for the density cos^n d; bins of equal energy keep the
    sampling error small.
    """
    spread = realisation(**SWELL, direction=0.4, spreading=power).direction - 0.4
    found, expected, case = np.mean(np.cos(spread) ** 2), (power + 1) / (power + 2), f"n = {power}"
    measured(
        "Waves",
        "mean squared cosine of the spreading",
        found,
        expected,
        "1",
        "integral of cos^n",
        within=0.01,
        case=case,
    )
    assert np.abs(spread).max() < math.pi / 2
    assert np.mean(np.sin(spread)) == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("waves", [SWELL, CHOP])
def test_a_sea_does_not_repeat_itself_within_an_hour(waves):
    """The autocorrelation sum a^2 cos(w t) / sum a^2 would come back to 1."""
    components = realisation(7, **waves)
    times = np.arange(60.0, 3600.0, 0.1)
    correlation = np.mean([np.cos(w * times) for w in components.frequency], axis=0)
    assert np.abs(correlation).max() < 0.6


def test_other_seeds_give_other_seas():
    first, again, other = (realisation(seed, **CHOP, spreading=2) for seed in (1, 1, 2))
    assert all(np.array_equal(a, b) for a, b in zip(first, again, strict=True))
    assert not np.array_equal(first.frequency, other.frequency)
    assert not np.array_equal(first.phase, other.phase)


def test_the_sea_of_a_seed_is_reproducible():
    """Earlier runs remain reproducible: these numbers may change only with a note in the change
    log.
    """
    waves = realisation(1, **CHOP)
    assert waves.frequency[:2] == pytest.approx([2.199540, 2.404438], abs=1e-6)


@pytest.mark.parametrize("state", range(10))
def test_sea_states_are_those_of_the_wmo(state):
    """Code table 3700: upper ends of the ranges of Hs in m."""
    upper = (0.0, 0.1, 0.5, 1.25, 2.5, 4.0, 6.0, 9.0, 14.0, math.inf)
    components = sea({"sea_state": state})
    height = 4 * math.sqrt((components.amplitude**2 / 2).sum())
    assert (upper[state - 1] if state else 0.0) * 0.99 <= height <= upper[state]
    assert height == pytest.approx(SIGNIFICANT_HEIGHTS[state], rel=0.01)


def test_a_sea_state_is_fully_developed():
    """The peak of a Pierson-Moskowitz sea: wp = 0.877 g / V, Hs = 0.21 V^2 / g (Fossen)."""
    speed = math.sqrt(9.81 * 1.875 / 0.21)
    assert fully_developed_period(1.875) == pytest.approx(
        2 * math.pi / (0.877 * 9.81 / speed), rel=0.01
    )


def test_waves_may_add_to_a_sea_state():
    components = sea({"sea_state": 2, "waves": {"direction": 1.0, "components": 20}})
    assert components.amplitude.shape == (20,)
    assert set(components.direction) == {1.0}


@pytest.mark.parametrize(
    "environment", [{}, {"sea_state": 0}, {"waves": {"significant_height": 0}}]
)
def test_without_waves_there_are_no_components(environment):
    assert sea(environment).amplitude.size == 0
    assert sea(environment).elevation(1.0, 2.0, 3.0) == 0.0
