"""Navigation and deck tracking against motions that are known in closed form."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_harness import SensorHarness, with_parameters

from plant_src.sensors.deck_tracker import DeckTracker
from plant_src.sensors.magnetometer import EARTH_FIELD
from plant_src.sensors.navigation import History, Navigation

STEP, UP = 0.01, np.array([0, 0, 9.81])


@cache
def swing(t):
    """Position, velocity, acceleration (world) and attitude of a flight that starts at rest and
    level after one second.
    """
    s, ds, dds = (np.maximum(t - 1, 0) ** n * f for n, f in ((3, 1.0), (2, 3.0), (1, 6.0)))
    ramp, rate = s / (1 + s), ds / (1 + s) ** 2
    bend = dds / (1 + s) ** 2 - 2 * ds**2 / (1 + s) ** 3
    phase, w = 0.8 * (t - 1), 0.8
    shape = np.array([np.sin(phase), np.cos(phase) - 1, 0.3 * np.sin(2 * phase)])
    slope = w * np.array([np.cos(phase), -np.sin(phase), 0.6 * np.cos(2 * phase)])
    curve = w**2 * np.array([-np.sin(phase), -np.cos(phase), -1.2 * np.sin(2 * phase)])
    attitude = Rotation.from_euler(
        "ZYX", ramp * np.array([0.5 * t, 0.1 * np.sin(phase), 0.15 * np.cos(phase)])
    )
    return (
        ramp * shape,
        rate * shape + ramp * slope,
        bend * shape + 2 * rate * slope + ramp * curve,
        attitude,
    )


@cache
def sensor_values(n):
    """Specific force, rates and field in body axes of exact sensors in the step that ends at n
    STEP.
    """
    (_, v0, _, r0), (_, v1, _, r1) = (swing(max(k, 0) / 100) for k in (n - 1, n))
    turn = (r0.inv() * r1).as_rotvec()
    middle = r0 * Rotation.from_rotvec(turn / 2)
    return middle.inv().apply((v1 - v0) / STEP + UP), turn / STEP, r1.inv().apply(EARTH_FIELD)


class Flight:
    """Navigation with the values of exact sensors; fixes at 10 Hz, `latency` (s) late."""

    def __init__(self, latency=0.0, gyro_bias=(0, 0, 0)):
        self.latency, self.bias = round(latency / STEP), np.array(gyro_bias)
        self.trial = SensorHarness(Navigation("navigation"))
        self.feed(0)
        self.trial.component.enter_initialization_mode(0.0, 100.0)
        self.trial.component.set_inputs()
        self.trial.component.exit_initialization_mode()

    def feed(self, n):
        force, rates, field = sensor_values(n)
        taken = max(0, (n - self.latency) // 10 * 10) / 100
        place, velocity, _, _ = swing(taken)
        self.trial.set_inputs(
            imu__acceleration=force,
            imu__rates=rates + self.bias,
            gnss__position=place,
            gnss__velocity=velocity,
            gnss__time=taken,
            magnetometer__field=field,
            magnetometer__time=n * STEP,
        )

    def fly(self, seconds, since=0.0):
        """Largest errors of position (m), velocity (m/s) and attitude (rad) in the last second."""
        last = round(seconds / STEP)
        errors = []
        for n in range(round(since / STEP) + 1, last + 1):
            self.feed(n)
            self.trial.step()
            if n > last - 100 and n % 5 == 0:
                errors.append(self.errors(n / 100))
        return np.max(errors, axis=0)

    def errors(self, t):
        place, velocity, _, attitude = swing(t)
        found = Rotation.from_quat([self.trial[f"orientation.{part}"] for part in "xyzw"])
        pairs = ((self.trial.vector("position"), place), (self.trial.vector("velocity"), velocity))
        return [*(np.linalg.norm(a - b) for a, b in pairs), (found.inv() * attitude).magnitude()]


def test_exact_sensors_give_the_motion(measured):
    position, velocity, attitude = Flight().fly(8)
    measured(
        "Sensors",
        "navigation, exact sensors: place",
        position,
        0.0,
        "m",
        "motion in closed form",
        within=2e-3,
    )
    measured(
        "Sensors",
        "navigation, exact sensors: velocity",
        velocity,
        0.0,
        "m/s",
        "motion in closed form",
        within=3e-3,
    )
    measured(
        "Sensors",
        "navigation, exact sensors: attitude",
        attitude,
        0.0,
        "rad",
        "motion in closed form",
        within=2e-3,
    )


def test_the_latency_of_a_fix_does_not_matter():
    position, velocity, _ = Flight(latency=0.3).fly(8)
    assert position < 5e-3
    assert velocity < 1e-2


def test_biases_of_the_gyroscopes_are_found_while_standing():
    flight = Flight(gyro_bias=(0.02, -0.03, 0.01))
    assert flight.fly(8)[2] < 3e-3
    truth = Rotation.as_rotvec(swing(7.99)[3].inv() * swing(8.0)[3]) / STEP
    assert np.allclose(flight.trial.vector("rates", "pqr"), truth, atol=2e-3)


def test_fixes_correct_an_attitude_error():
    flight = Flight()
    flight.fly(1.5)
    state = flight.trial.component.get_state()
    x, y, z, w = Rotation.from_euler("ZYX", (0.0, -0.1, 0.1)).as_quat()
    state["_orientation"] = (w, x, y, z)
    flight.trial.component.set_state(state)
    assert flight.fly(1.55, since=1.5)[2] > 0.1
    assert flight.fly(16, since=1.55)[2] < 0.014


def test_names_and_frames_are_those_of_the_plant():
    trial = Flight().trial
    trial.step(50)
    velocity = Rotation.from_quat([trial[f"orientation.{part}"] for part in "xyzw"]).apply(
        trial.vector("velocity_body", "uvw")
    )
    assert np.allclose(velocity, trial.vector("velocity"), atol=1e-12)


def test_history_returns_the_values_of_a_time():
    history = History(span=0.5)
    for n in range(100):
        history.add(n * 0.01, (float(n),))
    assert history.at(0.9) == (90.0,)
    assert history.at(0.901) == (91.0,)
    assert history.at(5.0) == (99.0,)
    assert history.at(0.0) == (49.0,)  # the oldest it has


def drive(tracker, seconds, speed=1.0, latency=0.1, marker=None):
    """Track a deck that moves east; fixes every 0.1 s, marker measurements (offset from the true
    position) in every step.
    """
    for n in range(1, round(seconds / STEP) + 1):
        taken = max(0, (n - round(latency / STEP)) // 10 * 10)
        inputs = {
            "gnss__position": (speed * taken * STEP, 2.0, 0.3),
            "gnss__velocity": (speed, 0, 0),
            "gnss__time": taken * STEP,
        }
        if marker is not None:
            sight = max(0, n - 5)
            inputs |= {
                "marker__position": np.add((speed * sight * STEP, 2.0, 0.3), marker),
                "marker__time": sight * STEP,
            }
        tracker.set_inputs(**inputs)
        tracker.step()
    return tracker


def test_the_deck_is_followed_without_lag():
    tracker = drive(SensorHarness(DeckTracker("deck")), 10.0)
    assert np.allclose(tracker.vector("position"), (10.0, 2.0, 0.3), atol=1e-3)
    assert np.allclose(tracker.vector("velocity"), (1.0, 0, 0), atol=1e-3)


def test_marker_measurements_outweigh_fixes():
    tracker = drive(
        SensorHarness(with_parameters(DeckTracker("deck"), sight_gain=0.2, fix_gain=0.2)),
        10.0,
        marker=(0.05, 0, 0),
    )
    assert tracker["position.x"] == pytest.approx(10.05, abs=0.01)
