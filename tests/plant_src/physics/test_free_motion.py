"""Motion without contact, in a world and as plant FMUs, against independent equations and
integration.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import original_system_reference as reference
import pytest
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck
from world_harness import WorldHarness, quadcopter_settings, vessel_settings

from plant_src.vehicles.strider.interface import HULLS

STEP = 0.01


def rotor_schedule() -> list[tuple[float, np.ndarray]]:
    """10 s of tilting flight: other rotor speeds and loads every 0.1 s, some beyond the limits of
    the motors.
    """
    random = np.random.default_rng(1)
    segments = []
    for k in range(100):
        speeds = reference.HOVER_SPEED * (1 + 0.01 * random.standard_normal(4))
        if k % 25 == 10:
            speeds += [300.0, 300.0, 300.0, 300.0]
        if k % 25 == 11:
            speeds = -speeds
        segments.append(
            (
                0.1,
                np.concatenate(
                    [speeds, 0.3 * random.standard_normal(3), 1e-3 * random.standard_normal(3)]
                ),
            )
        )
    return segments


def rudder_schedule() -> list[tuple[float, np.ndarray]]:
    """60 s with rudder steps to 35 degrees, which stall the rudder, and a gust."""
    angles = np.deg2rad([0, 35, -35, 20, -35, 35, 5, -20, 0, 35, -10, 0])
    segments = []
    for k, angle in enumerate(angles):
        gust = [0.5, -1.0, 0.0, 0.0, 0.0, 0.1] if k == 6 else [0.0] * 6
        segments.append((5.0, np.array([1.0 + 0.5 * (k % 3), angle, *gust])))
    return segments


def deviation(found: Sequence[np.ndarray], expected: np.ndarray) -> float:
    return float(np.linalg.norm(np.array(found) - expected, axis=1).max())


QUADCOPTER_START = {
    "position": [1.0, -2.0, 1000.0],
    "yaw": 0.7,
    "velocity_body": [1.0, 0.5, -0.2],
    "rates": [0.3, -0.2, 0.5],
}
VESSEL_START = {
    "position": [1.0, -2.0],
    "yaw": 0.4,
    "velocity_body": [0.6, 0.05, 0.0],
    "rates": [0.0, 0.0, 0.1],
}


@pytest.fixture(scope="module")
def flight() -> np.ndarray:
    """Reference states of the quadcopter after each segment."""
    turn = np.array([[np.cos(0.7), -np.sin(0.7), 0], [np.sin(0.7), np.cos(0.7), 0], [0, 0, 1]])
    velocity = turn @ QUADCOPTER_START["velocity_body"]
    start = reference.quadcopter_state(
        QUADCOPTER_START["position"], 0.7, velocity, np.array(QUADCOPTER_START["rates"])
    )
    return reference.integrate(reference.quadcopter_rate, start, rotor_schedule())


@pytest.fixture(scope="module")
def voyage() -> np.ndarray:
    """Reference states of the vessel after each segment."""
    start = np.array([1.0, -2.0, 0.4, 0.6, 0.05, 0.1])
    return reference.integrate(reference.vessel_rate, start, rudder_schedule())


def test_quadcopter_in_a_world_follows_its_equations(
    flight: np.ndarray, measured: MeasurementCheck
) -> None:
    trial = WorldHarness({"uav": {"model": "ar_drone", **QUADCOPTER_START}})
    positions, rates = [], []
    for duration, inputs in rotor_schedule():
        trial["uav.rotor_speed"] = inputs[:4]
        for axis, force, torque in zip("xyz", inputs[4:7], inputs[7:10], strict=True):
            trial[f"uav.external_force.{axis}"], trial[f"uav.external_torque.{axis}"] = (
                force,
                torque,
            )
        trial.step(round(duration / STEP))
        positions.append(trial.vector("uav.position"))
        rates.append(trial.vector("uav.rates", "pqr"))
    error, turning = (
        deviation(positions, flight[:, :3]),
        deviation(rates, flight[:, 15:18] @ reference.FLIP),
    )
    measured(
        "AR.Drone 2.0",
        "place in 10 s of tilting flight, world",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
    )
    measured("AR.Drone 2.0", "rates in it, world", turning, 0.0, "rad/s", "DOP853", within=1e-6)


def test_vessel_in_a_world_follows_its_equations(
    voyage: np.ndarray, measured: MeasurementCheck
) -> None:
    trial = WorldHarness({"usv": {"model": "strider", "hull": "paper", **VESSEL_START}})
    positions = []
    for duration, inputs in rudder_schedule():
        trial["usv.thrust"], trial["usv.rudder_angle"] = inputs[:2]
        trial["usv.external_force.x"], trial["usv.external_force.y"] = inputs[2:4]
        trial["usv.external_torque.z"] = inputs[7]
        trial.step(round(duration / STEP))
        positions.append(trial.vector("usv.position", "xy"))
    error = deviation(positions, voyage[:, :2])
    measured(
        "Strider, planar",
        "place in 60 s of rudder steps and a gust, world",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
    )


def positions(
    fmu: PlantFmu, names: Sequence[str], axes: str, schedule: list[tuple[float, np.ndarray]]
) -> Iterator[np.ndarray]:
    for duration, inputs in schedule:
        fmu.set(dict(zip(names, inputs, strict=True)))
        for _ in range(round(duration / STEP)):
            fmu.step(STEP)
        yield fmu.vector("position", axes)


LOADS = [f"external_{kind}.{axis}" for kind in ("force", "torque") for axis in "xyz"]


def initial(start: dict[str, object], skip: str = "") -> dict[str, float]:
    """The start of a scenario's vehicle as parameters of its FMU."""
    axes = {"position": "xyz", "velocity_body": "uvw", "rates": "pqr"}
    named = {
        f"{key}.{axis}": value
        for key in axes
        for axis, value in zip(axes[key], start[key], strict=False)
    }
    return {
        f"initial.{name}": value
        for name, value in (named | {"yaw": start["yaw"]}).items()
        if name not in skip
    }


def test_quadcopter_fmu_follows_its_equations(
    flight: np.ndarray, measured: MeasurementCheck
) -> None:
    fmu = PlantFmu("ar_drone", initial(QUADCOPTER_START))
    names = [*(f"rotor_speed[{k}]" for k in (1, 2, 3, 4)), *LOADS]
    error = deviation(list(positions(fmu, names, "xyz", rotor_schedule())), flight[:, :3])
    measured(
        "AR.Drone 2.0",
        "place in 10 s of tilting flight, FMU",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
    )


def test_vessel_fmu_follows_its_equations(voyage: np.ndarray, measured: MeasurementCheck) -> None:
    fmu = PlantFmu(
        "strider", initial(VESSEL_START, skip="velocity_body.w rates.p rates.q") | HULLS["paper"]
    )
    error = deviation(
        list(positions(fmu, ["thrust", "rudder_angle", *LOADS], "xy", rudder_schedule())),
        voyage[:, :2],
    )
    measured(
        "Strider, planar",
        "place in 60 s of rudder steps and a gust, FMU",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
    )


def test_fmu_makes_as_many_sub_steps_as_a_longer_step_needs() -> None:
    start = initial(QUADCOPTER_START)
    short, long = (PlantFmu("ar_drone", start) for _ in range(2))
    for fmu in (short, long):
        fmu.set(
            {f"rotor_speed[{k}]": speed for k, speed in enumerate((340.0, 345.0, 350.0, 345.0), 1)}
        )
    for _ in range(10):
        short.step(0.01)
    long.step(0.1)
    names = ("position.x", "position.y", "position.z", "rates.p", "rates.q", "rates.r")
    assert np.abs(short.get(*names) - long.get(*names)).max() < 1e-12


def test_fmu_publishes_no_contact() -> None:
    fmu = PlantFmu("strider", {})
    flags = fmu.slave.getBoolean(
        [fmu.references[name] for name in ("contact.touching", "contact.vessel")]
    )
    assert [bool(flag) for flag in flags] == [False, False]
    assert fmu.get("contact.force") == 0.0


def test_vessel_going_astern_is_pushed_to_the_other_side_by_its_rudder() -> None:
    ahead, astern = (
        WorldHarness({"usv": vessel_settings([0.0, 0.0], velocity_body=[speed, 0.0, 0.0])})
        for speed in (1.0, -1.0)
    )
    for trial in (ahead, astern):
        trial["usv.rudder_angle"] = 0.2
        trial.step(10)
    assert ahead["usv.rates.r"] < -0.01
    assert astern["usv.rates.r"] > 0.01


def test_hover_thrust_carries_the_weight(measured: MeasurementCheck) -> None:
    trial = WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 5.0])})
    trial["uav.rotor_speed"] = [reference.HOVER_SPEED] * 4
    trial.step()
    speed = trial["uav.velocity.z"]  # of 0.1 m/s in free fall
    measured(
        "AR.Drone 2.0",
        "vertical speed after a step of hovering",
        speed,
        0.0,
        "m/s",
        "thrust = weight",
        within=1e-10,
    )
    throttle = reference.HOVER_SPEED / reference.MAX_ROTOR_SPEED
    assert throttle == pytest.approx(0.6942, abs=1e-4)


def test_tumbling_without_torque_keeps_the_energy(measured: MeasurementCheck) -> None:
    trial = WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 1000.0], rates=[3.0, 0.5, -2.0])})
    rates = trial.vector("uav.rates", "pqr")
    before = reference.rotational_energy(rates)
    trial.step(1000)
    after = reference.rotational_energy(trial.vector("uav.rates", "pqr"))
    assert np.abs(trial.vector("uav.rates", "pqr") - rates).max() > 0.1
    measured(
        "AR.Drone 2.0",
        "energy after 10 s of tumbling",
        after,
        before,
        "J",
        "conservation",
        relative=1e-6,
    )


def test_a_step_longer_than_10_ms_is_split() -> None:
    long, short = (
        WorldHarness({"uav": {"model": "ar_drone", **QUADCOPTER_START}}) for _ in range(2)
    )
    long.step(4, 0.025)
    short.step(12, 0.1 / 12)
    assert long.vector("uav.position") == pytest.approx(short.vector("uav.position"), abs=1e-12)
