"""GNSS receiver: times of the samples and their errors."""

import numpy as np
import pytest
from sensor_harness import SensorHarness, with_parameters

from cosim.core.errors import InputError
from plant_src.sensors.gnss import Gnss

NOISES = (
    "horizontal_noise",
    "vertical_noise",
    "horizontal_drift",
    "vertical_drift",
    "velocity_noise",
)
EXACT = dict.fromkeys(NOISES, 0.0)
POSITION = [f"position.{axis}" for axis in "xyz"]


def moving(trial, steps):
    """Step with position.x = time; return the time, the position and the time of the sample."""
    rows = []
    for _ in range(steps):
        now = (trial.steps + 1) * 0.01
        trial.set_inputs(vehicle__position=(now, 0, 0)).step()
        rows.append((now, trial["position.x"], trial["time"]))
    return np.array(rows)


def test_samples_have_the_rate_and_the_latency(measured):
    trial = SensorHarness(with_parameters(Gnss("gnss"), **EXACT, rate=5.0, latency=0.13))
    now, position, time = moving(trial, 200).T
    newest = np.floor((now - 0.13) / 0.2 + 1e-9) * 0.2
    error = position - np.maximum(newest, 0)
    measured(
        "Sensors",
        "GNSS at 5 Hz, 0.13 s late: age of a fix",
        error,
        0.0,
        "s",
        "floor of the time",
        within=1e-12,
    )
    assert np.allclose(time, position, atol=1e-12)


def test_a_sample_is_published_in_its_step_without_latency():
    trial = SensorHarness(with_parameters(Gnss("gnss"), **EXACT, rate=10.0, latency=0.0))
    now, position, _ = moving(trial, 100).T
    assert np.allclose(position, np.floor(now / 0.1 + 1e-9) * 0.1, atol=1e-12)


def test_the_mean_rate_is_kept_if_it_does_not_divide_the_step_rate():
    trial = SensorHarness(with_parameters(Gnss("gnss"), **EXACT, rate=30.0, latency=0.0))
    _, _, time = moving(trial, 300).T
    assert len(np.unique(time)) == pytest.approx(3.0 * 30, abs=1)


def test_white_noise_has_its_standard_deviations(measured):
    parameters = {**EXACT, "horizontal_noise": 0.5, "vertical_noise": 2.0, "velocity_noise": 0.1}
    gnss = with_parameters(Gnss("gnss", seed=2), **parameters, rate=100.0, latency=0.0)
    names = [*POSITION, *(f"velocity.{axis}" for axis in "xyz")]
    spread = SensorHarness(gnss).record(4000, names).std(axis=0)
    expected = [0.5, 0.5, 2.0, 0.1, 0.1, 0.1]
    measured(
        "Sensors",
        "GNSS noise, standard deviations",
        spread,
        expected,
        "m, m/s",
        "as set",
        relative=0.06,
    )


def test_the_drift_is_correlated_as_a_gauss_markov_process(measured):
    parameters = {**EXACT, "horizontal_drift": 1.0, "vertical_drift": 1.0, "correlation_time": 2.0}
    gnss = with_parameters(Gnss("gnss", seed=6), **parameters, rate=10.0, latency=0.0)
    drift = SensorHarness(gnss, step=0.1).record(15000, POSITION)
    assert drift.std() == pytest.approx(1.0, rel=0.05)
    for lag in (5, 20):
        correlation = np.mean(drift[lag:] * drift[:-lag]) / drift.var()
        expected, case = np.exp(-lag * 0.1 / 2.0), f"{lag * 0.1:g} s"
        measured(
            "Sensors",
            "GNSS drift, correlation",
            correlation,
            expected,
            "1",
            "exp(-t/T)",
            within=0.05,
            case=case,
        )


def test_the_first_fix_has_the_stationary_drift():
    parameters = {**EXACT, "horizontal_drift": 3.0}
    first = [
        SensorHarness(with_parameters(Gnss("gnss", seed=seed), **parameters))["position.x"]
        for seed in range(300)
    ]
    assert np.std(first) == pytest.approx(3.0, rel=0.13)


@pytest.mark.parametrize(
    ("receiver", "horizontal", "vertical"), [("standard", 2.5, 3.0), ("rtk", 0.01, 0.01)]
)
def test_half_of_all_fixes_are_as_accurate_as_the_data_sheet_states(receiver, horizontal, vertical):
    """The data sheets state medians of the error (m). That of the standard receiver has no vertical
    one: about twice the error along each horizontal axis is common, hence 2 * 0.67 * 2.5 / 1.18.
    """
    fixes = [
        SensorHarness(Gnss("gnss", seed=seed, receiver=receiver)).vector("position")
        for seed in range(600)
    ]
    x, y, z = np.transpose(fixes)
    assert np.median(np.hypot(x, y)) == pytest.approx(horizontal, rel=0.12)
    assert np.median(np.abs(z)) == pytest.approx(vertical, rel=0.18)


def test_the_last_fix_stays_and_is_invalid_without_satellites():
    trial = SensorHarness(with_parameters(Gnss("gnss"), **EXACT, rate=10.0, latency=0.0))
    moving(trial, 50)
    trial.component.set("available", False)
    moving(trial, 50)
    assert (trial["valid"], trial["position.x"]) == (False, pytest.approx(0.5))
    trial.component.set("available", True)
    moving(trial, 50)
    assert (trial["valid"], trial["position.x"]) == (True, pytest.approx(1.5))


def test_sampling_noise_does_not_depend_on_the_step_size():
    coarse, fine = (
        SensorHarness(with_parameters(Gnss("gnss", seed=4), rate=10.0, latency=0.0), step=step)
        for step in (0.1, 0.01)
    )
    for _ in range(20):
        assert np.allclose(
            coarse.step().vector("position"), fine.step(10).vector("position"), atol=1e-9
        )


def test_an_unknown_receiver_is_refused():
    with pytest.raises(InputError, match="standard, rtk"):
        Gnss("gnss", receiver="galileo")
