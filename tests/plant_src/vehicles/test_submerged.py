"""Submerged vehicles: buoyancy, damping, added mass and thrusters, each against its closed form;
impossible vehicles.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck
from scipy.integrate import solve_ivp
from submerged_reference import derivative
from world_harness import WorldHarness

from cosim.core import resources
from cosim.core.errors import InputError
from plant_src.catalogue import MODELS
from plant_src.world import World

MODEL = "Submerged vehicles"
BLUEROV = MODELS["bluerov2_heavy"].craft
FILE = resources.root() / "plant_src/vehicles/data/bluerov2_heavy.json"
MASS, VOLUME, CENTRE_OF_BUOYANCY, HEIGHT, GRAVITY, SALT_WATER = (
    13.5,
    0.0134,
    0.01,
    0.254,
    9.81,
    1025.0,
)
NEUTRAL = {"displaced_volume": MASS / SALT_WATER, "centre_of_buoyancy.z": 0.0}
UNDAMPED = {f"linear_damping[{i},{i}]": 0.0 for i in range(1, 7)} | {
    f"quadratic_damping[{i},{i}]": 0.0 for i in range(1, 7)
}


def deep(parameters: dict[str, float] | None = None) -> PlantFmu:
    return PlantFmu("bluerov2_heavy", {"initial.position.z": -50.0, **(parameters or {})})


def terminal_speed(force: float, linear: float, quadratic: float) -> float:
    return float((np.sqrt(linear**2 + 4 * quadratic * force) - linear) / (2 * quadratic))


def test_it_floats_at_the_depth_of_archimedes(measured: MeasurementCheck) -> None:
    fmu = PlantFmu("bluerov2_heavy", {"initial.position.z": -0.3})
    fmu.step(0.01, 6000)
    upper_half = 2 * MASS / (SALT_WATER * VOLUME) - 1  # the lower half is immersed
    depth = CENTRE_OF_BUOYANCY + HEIGHT / 4 + HEIGHT / 2 * (upper_half - 0.5)
    measured(
        MODEL,
        "depth of a floating BlueROV2",
        -fmu.get("position.z"),
        depth,
        "m",
        "Archimedes",
        within=1e-6,
    )


def test_it_sinks_in_fresh_water_at_the_speed_of_its_damping(measured: MeasurementCheck) -> None:
    fmu = deep({"water_density": 1000.0})
    fmu.step(0.01, 6000)
    speed = terminal_speed(GRAVITY * (MASS - 1000.0 * VOLUME), 33.0, 190.0)
    measured(
        MODEL,
        "speed of a sinking BlueROV2",
        -fmu.get("velocity.z"),
        speed,
        "m/s",
        "closed form",
        relative=1e-9,
    )


@pytest.mark.parametrize(("sense", "advance"), [(1, 0.0), (-1, 0.0), (1, 0.01)])
def test_four_thrusters_drive_it_at_the_speed_of_their_thrust(
    sense: int, advance: float, measured: MeasurementCheck
) -> None:
    """Thrusters at the height of the centre of mass do not pitch it; the loss of thrust by the
    inflow is linear in the speed.
    """
    level = {f"thruster_position.z[{k}]": 0.0 for k in range(1, 9)}
    fmu = deep({**NEUTRAL, **level, "advance_coefficient": advance})
    for k, side in enumerate((1, 1, -1, -1), 1):
        fmu.set({f"thruster_speed[{k}]": side * sense * 200.0})
    fmu.step(0.01, 4000)
    force = 4 * 3.8e-4 * 200.0**2 * np.sqrt(0.5)
    speed = terminal_speed(force, 13.7 + 4 * advance * 200.0 / 2, 141.0)
    found = sense * fmu.get("velocity_body.u").item()
    case = "forward" if sense > 0 else "reverse"
    case = "with inflow" if advance else case
    measured(
        MODEL,
        "speed by four thrusters",
        found,
        speed,
        "m/s",
        "closed form",
        relative=1e-3,
        case=case,
    )


def test_it_drifts_with_the_current() -> None:
    fmu = deep(NEUTRAL)
    fmu.set({"current.x": 0.4, "current.y": -0.3})
    fmu.step(0.01, 30000)
    assert np.abs(fmu.vector("velocity") - [0.4, -0.3, 0.0]).max() < 0.02


def test_the_current_carries_a_spinning_vehicle_like_still_water(
    measured: MeasurementCheck,
) -> None:
    """A steady uniform current is another inertial frame."""
    moving = deep(
        {**NEUTRAL, "initial.velocity_body.u": 0.7, "initial.rates.r": 2.0, "initial.rates.p": 1.0}
    )
    moving.set({"current.x": 0.5})
    still = deep(
        {**NEUTRAL, "initial.velocity_body.u": 0.2, "initial.rates.r": 2.0, "initial.rates.p": 1.0}
    )
    for fmu in (moving, still):
        fmu.step(0.01, 1000)
    difference = moving.vector("position") - still.vector("position") - [5.0, 0.0, 0.0]
    measured(
        MODEL,
        "place after 10 s in a current",
        np.abs(difference).max(),
        0.0,
        "m",
        "Galilean",
        within=1e-10,
    )


def test_tumbling_without_damping_keeps_the_energy(measured: MeasurementCheck) -> None:
    inertia = np.array(
        [13.5 + 6.36, 13.5 + 7.12, 13.5 + 18.68, 0.26 + 0.189, 0.23 + 0.135, 0.37 + 0.222]
    )
    start = np.array([0.4, -0.3, 0.2, 1.0, -2.0, 1.5])
    names = [f"initial.velocity_body.{axis}" for axis in "uvw"]
    names += [f"initial.rates.{axis}" for axis in "pqr"]
    fmu = deep({**NEUTRAL, **UNDAMPED, **dict(zip(names, start, strict=True))})
    fmu.step(0.01, 2000)
    end = np.concatenate([fmu.vector("velocity_body", "uvw"), fmu.vector("rates", "pqr")])
    energies = [float(inertia @ motion**2 / 2) for motion in (end, start)]
    assert np.abs(end - start).max() > 0.5
    measured(
        MODEL,
        "energy after 20 s of tumbling",
        energies[0],
        energies[1],
        "J",
        "conservation",
        relative=1e-6,
    )


def test_roll_has_the_period_of_its_righting_moment(measured: MeasurementCheck) -> None:
    fmu = deep({**NEUTRAL, **UNDAMPED, "centre_of_buoyancy.z": 0.02, "initial.rates.p": 0.01})
    crossings, last = [], 1e-9
    for k in range(4000):
        fmu.step(0.01)
        roll = fmu.get("attitude.roll").item()
        if last < 0 <= roll:
            crossings.append(0.01 * (k + last / (last - roll)))
        last = roll
    period = 2 * np.pi * np.sqrt((0.26 + 0.189) / (MASS * GRAVITY * 0.02))
    measured(
        MODEL,
        "period of roll",
        np.diff(crossings).mean(),
        period,
        "s",
        "closed form",
        relative=1e-4,
    )


def test_it_falls_freely_until_it_touches_the_water() -> None:
    fmu = PlantFmu("bluerov2_heavy", {"initial.position.z": 2.0})
    fmu.step(0.01, 50)
    assert fmu.get("velocity.z").item() == pytest.approx(-GRAVITY * 0.5, rel=1e-12)


def test_thrusters_above_the_water_do_not_push() -> None:
    fmu = PlantFmu("bluerov2_heavy", {"initial.position.z": 3.0})
    fmu.set({f"thruster_speed[{k}]": 250.0 for k in range(1, 9)})
    fmu.step(0.01, 30)
    assert np.abs(fmu.vector("velocity_body", "uv")).max() == 0.0


def test_steps_of_10_ms_and_short_steps_agree_over_60_s(measured: MeasurementCheck) -> None:
    places = []
    for size in (0.01, 0.001):
        fmu = deep({"initial.rates.r": 0.4})
        for k, speed in enumerate((90.0, 80.0, -85.0, -95.0, 20.0, -30.0, 25.0, -20.0), 1):
            fmu.set({f"thruster_speed[{k}]": speed})
        fmu.step(size, round(60 / size))
        places.append(fmu.vector("position"))
    measured(
        MODEL,
        "place after 60 s at 10 ms",
        np.abs(places[0] - places[1]).max(),
        0.0,
        "m",
        "1 ms",
        within=1e-6,
    )


def in_world(platforms: dict[str, Any] | None = None, **more: Any) -> WorldHarness:
    return WorldHarness(
        {"rov": {"model": "bluerov2_heavy", "position": [0, 0, -2], **more}}, platforms
    )


def test_world_and_fmu_agree(measured: MeasurementCheck) -> None:
    world = in_world(velocity_body=[0.5, 0, 0], rates=[0, 0.1, 0.3])
    fmu = PlantFmu(
        "bluerov2_heavy",
        {
            "initial.position.z": -2.0,
            "initial.velocity_body.u": 0.5,
            "initial.rates.q": 0.1,
            "initial.rates.r": 0.3,
        },
    )
    speeds = [100.0, 60.0, -80.0, -40.0, 50.0, 50.0, 40.0, 40.0]
    world["rov.thruster_speed"] = speeds
    fmu.set({f"thruster_speed[{k}]": speed for k, speed in enumerate(speeds, 1)})
    world.step(1000)
    fmu.step(0.01, 1000)
    difference = np.abs(world.vector("rov.position") - fmu.vector("position")).max()
    measured(MODEL, "place after 10 s in a world", difference, 0.0, "m", "its FMU", within=1e-10)
    assert not world["rov.ditched"]


def test_it_rests_on_the_bottom_and_crashes_into_a_wall() -> None:
    resting = in_world(
        {"bottom": {"size": [9, 9, 0.2], "position": [0, 0, -3]}},
        parameters={"water_density": 990.0},
    )
    resting.step(3000)
    assert resting["rov.position.z"] == pytest.approx(-2.9 + HEIGHT / 2, abs=2e-3)
    assert resting["rov.contact.force"] == pytest.approx(
        GRAVITY * (MASS - 990.0 * VOLUME), rel=1e-3
    )
    assert not resting["rov.crashed"]
    hitting = in_world(
        {"wall": {"size": [0.2, 9, 9], "position": [0.4, 0, -3]}}, velocity_body=[3, 0, 0]
    ).step(20)
    assert hitting["rov.crashed"]


def test_saved_states_repeat_the_motion_bit_for_bit() -> None:
    trial = in_world(rates=[0.3, 0.2, 0.1])
    trial["rov.thruster_speed"] = [100.0, 60.0, -80.0, -40.0, 50.0, 50.0, 40.0, 40.0]
    trial.step(50)
    state = trial.world.get_state()
    first = trial.step(50).bytes
    trial.world.set_state(state)
    trial.steps -= 50
    assert trial.step(50).bytes == first


FAULTS: list[tuple[Callable[[dict[str, Any]], Any], str]] = [
    (
        lambda d: d.update(displaced_volume=-1),
        r"model\.displaced_volume: found -1, expected a number greater than 0",
    ),
    (
        lambda d: d.update(displaced_volume=10),
        r"model\.displaced_volume: found 10, expected at most 0\.06674, the volume of",
    ),
    (
        lambda d: d.update(added_mass=[1, 2]),
        r"model\.added_mass: found \[1, 2\], expected a list of 6 numbers",
    ),
    (
        lambda d: d.update(added_mass=[-1, 1, 1, 1, 1, 1]),
        r"model\.added_mass: found the eigenvalue -1, expected none below 0",
    ),
    (
        lambda d: d.update(quadratic_damping=[-1, 1, 1, 1, 1, 1]),
        r"model\.quadratic_damping: found the diagonal \[-1",
    ),
    (lambda d: d["thrusters"][1].pop("axis"), r'model\.thrusters\.1: "axis" is missing'),
    (
        lambda d: d["thrusters"][1].update(turn="clockwise"),
        r'model\.thrusters\.1\.turn: unknown key "turn"; did you mean "turns"\?',
    ),
    (
        lambda d: d["thruster"].update(torque_coefficient=1e-6),
        r'model\.thrusters\.0: "turns" is missing',
    ),
    (
        lambda d: d["thruster"].pop("thrust_coefficient"),
        r'thrusters\.0: "thrust_coefficient" is missing, here and in "thruster"',
    ),
    (
        lambda d: d.update(thrusters=d["thrusters"] * 3),
        r"model\.thrusters: found 24, expected 1 to 16",
    ),
    (
        lambda d: d.update(inertia=[1, 1, 3]),
        r"model\.inertia: .* expected none greater than the sum of the other two",
    ),
]


@pytest.mark.parametrize(("change", "text"), FAULTS)
def test_an_impossible_vehicle_is_refused_with_its_path(
    change: Callable[[dict[str, Any]], Any], text: str
) -> None:
    change(data := copy.deepcopy(json.loads(FILE.read_text())))
    with pytest.raises(InputError, match=text) as caught:
        World("plant", {"rov": {"model": data, "position": [0, 0, -2]}})
    assert all(str(problem).startswith("vehicles.rov.model") for problem in caught.value.problems)


def sequence(
    duration: float, strength: float = 1.0
) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Speeds of the thrusters, external force and torque, and current, other ones every second;
    `strength` scales the loads.
    """
    random = np.random.default_rng(11)
    root = np.sqrt(strength)
    return [
        (
            120 * root * random.standard_normal(8),
            3 * strength * random.standard_normal(6),
            0.3 * random.standard_normal(2),
        )
        for _ in range(round(duration))
    ]


def reference(start: np.ndarray, duration: float, strength: float = 1.0) -> np.ndarray:
    """The place after each second by DOP853."""
    state, places = start, []
    for speeds, loads, current in sequence(duration, strength):
        water = np.array([*current, 0.0])
        rate = lambda _t, x, held=(speeds, loads, water): derivative(BLUEROV, x, *held)  # noqa: E731
        state = solve_ivp(rate, (0, 1), state, "DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
        places.append(state[:3])
    return np.array(places)


def simulated(start: np.ndarray, duration: float, step: float, strength: float = 1.0) -> np.ndarray:
    """The place after each second by the FMU."""
    names = (
        *(f"position.{a}" for a in "xyz"),
        *(f"velocity_body.{a}" for a in "uvw"),
        *(f"rates.{a}" for a in "pqr"),
    )
    values = np.concatenate([start[:3], start[7:13]])
    fmu, places = (
        PlantFmu("bluerov2_heavy", {f"initial.{n}": v for n, v in zip(names, values, strict=True)}),
        [],
    )
    for speeds, loads, current in sequence(duration, strength):
        fmu.set({f"thruster_speed[{k}]": value for k, value in enumerate(speeds, 1)})
        kinds = [f"external_force.{axis}" for axis in "xyz"]
        kinds += [f"external_torque.{axis}" for axis in "xyz"]
        fmu.set(dict(zip((*kinds, "current.x", "current.y"), (*loads, *current), strict=True)))
        fmu.step(step, round(1 / step))
        places.append(fmu.vector("position"))
    return np.array(places)


def start_at(height: float) -> np.ndarray:
    return np.concatenate(
        [[0, 0, height, 1, 0, 0, 0], [0.3, -0.1, 0.0, 0.1, 0.2, -0.3], np.zeros(8)]
    )


def growth(start: np.ndarray, strength: float) -> np.ndarray:
    """Change of the place (m) after each second of a minute over a change of the rates (rad/s) at
    the start.
    """
    changed = start + np.repeat([0.0, 1e-7, 0.0], [10, 3, 8])
    return (
        np.abs(
            simulated(changed, 60, 0.0025, strength) - simulated(start, 60, 0.0025, strength)
        ).max(axis=1)
        / 1e-7
    )


@pytest.mark.long
def test_shorter_steps_converge_at_the_surface(measured: MeasurementCheck) -> None:
    """The kinks of the buoyancy at the surface limit the order."""
    start = start_at(-0.1)
    expected = reference(start, 3)
    errors = [np.abs(simulated(start, 3, step) - expected).max() for step in (0.01, 0.0025)]
    assert errors[1] < errors[0] / 2
    measured(MODEL, "place in 3 s at the surface", errors[0], 0.0, "m", "DOP853", within=1e-6)


@pytest.mark.long
def test_a_minute_below_the_surface(measured: MeasurementCheck) -> None:
    """Loads that the righting moment limits: the vehicle stays near its equilibrium, and errors do
    not grow.
    """
    start = start_at(-50.0)
    error = np.abs(simulated(start, 60, 0.01, 0.2) - reference(start, 60, 0.2)).max()
    measured(MODEL, "place in 60 s below the surface", error, 0.0, "m", "DOP853", within=1e-6)
    assert growth(start, 0.2).max() < 1


@pytest.mark.long
def test_shorter_steps_converge_in_a_minute_of_tumbling(measured: MeasurementCheck) -> None:
    """Torques above the righting moment turn the vehicle over again and again; its motion amplifies
    every small difference.
    """
    start = start_at(-50.0)
    expected = reference(start, 60)
    errors = {
        step: np.abs(simulated(start, 60, step) - expected).max()
        for step in (0.01, 0.0025, 0.00125)
    }
    assert errors[0.01] > 20 * errors[0.0025] > 100 * errors[0.00125]
    for step, error in errors.items():
        measured(
            MODEL,
            "place in 60 s of tumbling",
            error,
            0.0,
            "m",
            "DOP853",
            within=2e-3,
            case=f"{1000 * step:g} ms",
        )
    assert growth(start, 1.0)[-1] > 100
