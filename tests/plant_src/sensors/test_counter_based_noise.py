"""Random numbers of sensors: independent, normal and reproducible."""

import subprocess
import sys

import numpy as np
from scipy import stats

from plant_src.sensors.counter_based_noise import (
    CounterBasedNoise,
    gauss_markov_factors,
    normal_to_uniform,
)


def rows(noise, count):
    return np.array([noise[n] for n in range(count)])


def test_a_row_depends_on_its_number_only():
    forward, backward = CounterBasedNoise(3, "imu", 7), CounterBasedNoise(3, "imu", 7)
    ahead = [tuple(forward[n]) for n in range(600)]
    back = [tuple(backward[n]) for n in reversed(range(600))]
    assert ahead == back[::-1]


def test_neighbouring_seeds_and_other_names_are_uncorrelated():
    series = [
        rows(CounterBasedNoise(1, *key), 4000)[:, 0]
        for key in (("imu", "a", 1), ("imu", "a", 2), ("imu", "b", 1), ("gnss", "a", 1))
    ]
    correlations = np.corrcoef(series)[np.triu_indices(4, 1)]
    assert np.abs(correlations).max() < 4 / np.sqrt(4000)


def test_numbers_are_standard_normal():
    values = rows(CounterBasedNoise(4, "x"), 5000).ravel()
    assert stats.kstest(values, "norm").pvalue > 0.01


def test_rows_and_columns_are_not_correlated():
    values = rows(CounterBasedNoise(2, "x"), 10000)
    assert abs(np.corrcoef(values.T)[0, 1]) < 0.04
    assert abs(np.corrcoef(values[1:, 0], values[:-1, 0])[0, 1]) < 0.04


def test_normal_numbers_are_mapped_to_uniform_ones():
    values = [normal_to_uniform(x) for x in rows(CounterBasedNoise(1, "u"), 4000)[:, 0]]
    assert stats.kstest(values, "uniform").pvalue > 0.01


def test_standard_deviation_of_gauss_markov_does_not_depend_on_the_step():
    for elapsed in (0.01, 1.0, 200.0):
        keep, drive = gauss_markov_factors(2.5, 60.0, elapsed)
        assert np.isclose(keep**2 * 2.5**2 + drive**2, 2.5**2, rtol=1e-12)
        assert keep == np.exp(-elapsed / 60.0)


def test_numbers_are_equal_in_other_processes_and_with_other_hash_seeds():
    import_line = "from plant_src.sensors.counter_based_noise import CounterBasedNoise"
    code = f"{import_line}; print(CounterBasedNoise(2, 'imu', 'uav.imu', 3)[777])"
    found = {
        subprocess.run(
            [sys.executable, "-c", code],
            env={"PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        for seed in ("0", "1")
    }
    assert found == {f"{CounterBasedNoise(2, 'imu', 'uav.imu', 3)[777]}\n"}
