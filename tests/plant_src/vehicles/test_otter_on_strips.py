"""The Otter with pontoons cut by the surface: hydrostatics, waves, derivatives, and the values of
MSS that it keeps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from otter_reference import RHO, G
from otter_strips_reference import OtterOnStrips
from plant_validation import MeasurementCheck
from scipy.optimize import fsolve
from scipy.spatial.transform import Rotation
from test_strip_theory import at_sea, regular_waves
from test_vessel_derivatives import SHORT_CRESTED, STATES, rate_function, waves
from world_harness import WorldHarness

from plant_src.environment import sea
from plant_src.vehicles.otter import parameters as p

MODEL, GOLDEN, NUMPY = "Otter", "golden value of MSS `otter.m`", "equations a second time in NumPy"
ACCELERATIONS = "accelerations at 1000 random states, pontoons emerged in a part of them"
LONG_WAVES = "heave, roll and pitch over those of the wave, T 20 s"
PAYLOADS = [0.0, 25.0, 45.0]
ENVIRONMENT = ("wind.x", "wind.y", "wind.z", "current.x", "current.y")


def otter(payload: float = 25.0, **more: Any) -> dict[str, Any]:
    parameters = {"payload_mass": payload, **more.pop("parameters", {})}
    return {"model": "otter", "position": [0.0, 0.0], "parameters": parameters, **more}


@pytest.fixture(scope="module")
def dash() -> WorldHarness:
    """30 s at 100 rad/s from rest."""
    trial = WorldHarness({"usv": otter()})
    trial["usv.propeller_speed"] = [100.0, 100.0]
    return trial.step(3000)


def test_speed_sinkage_and_trim_are_those_of_mss(
    dash: WorldHarness, measured: MeasurementCheck
) -> None:
    turned = Rotation.from_quat(dash.vector("usv.orientation", "xyzw"))
    height = dash["usv.position.z"] - turned.apply([0.153125, 0.0, 0.246875])[2]
    speed, trim = dash["usv.velocity_body.u"], np.degrees(dash["usv.attitude.pitch"])
    measured(MODEL, "speed at 100/100 rad/s", speed, 2.85735, "m/s", GOLDEN, within=5e-6)
    measured(MODEL, "sinkage with 25 kg of payload", -height, 0.03771, "m", GOLDEN, within=5e-6)
    measured(MODEL, "trim, bow down", trim, 1.49063, "deg", GOLDEN, within=5e-6)


def test_a_straight_course_stays_straight(dash: WorldHarness) -> None:
    """Its course is unstable: the sums over both pontoons must be exactly symmetric."""
    assert dash["usv.position.y"] == 0.0
    assert dash["usv.attitude.roll"] == 0.0


def rate_of(payload: float, **given: Any) -> Callable[..., np.ndarray]:
    """Return the function from position, attitude, nu, time, inputs by name and shaft speeds to
    nu'.
    """
    pytest.importorskip("casadi")
    from plant_src.vehicles.otter import equations, loads

    rate, names = rate_function(
        loads.otter_model(equations.VESSEL), {"payload_mass": payload, **given}
    )

    def evaluate(
        place: Any,
        attitude: np.ndarray,
        nu: Any,
        time: float,
        inputs: dict[str, float],
        shafts: Any,
    ) -> np.ndarray:
        x, y, z, w = Rotation.from_matrix(attitude).as_quat()
        state = [*place, w, x, y, z, *nu, time, *shafts]
        return rate(state, [inputs.get(name, 0.0) for name in names]).full().ravel()[7:13]

    return evaluate


def test_accelerations_at_random_states(measured: MeasurementCheck) -> None:
    """Half of the states lie in all attitudes and up to 0.5 m above or below the water, the others
    near the rest.
    """
    realisation, random = sea(SHORT_CRESTED), np.random.default_rng(6)
    vessels = [OtterOnStrips(payload, realisation) for payload in PAYLOADS]
    rates = [rate_of(payload, **waves(realisation)) for payload in PAYLOADS]
    worst, emerged = [], 0
    for k in range(STATES):
        vessel, rate = vessels[k % 3], rates[k % 3]
        tilt, rise = (np.pi, 0.5) if k % 2 else (0.05, 0.03)
        attitude = Rotation.from_euler(
            "ZYX", [random.uniform(-3, 3), *random.uniform(-tilt, tilt, 2)]
        ).as_matrix()
        place, nu = (
            [*random.uniform(-5, 5, 2), random.uniform(-rise, rise)],
            random.uniform(-1, 1, 6),
        )
        vessel.current, vessel.wind = (
            tuple(random.uniform(-0.5, 0.5, 2)),
            tuple(random.uniform(-5, 5, 3)),
        )
        vessel.shafts, time = tuple(random.uniform(-120, 120, 2)), random.uniform(0, 60)
        inputs = {"wave_gain": 1.0}
        inputs |= {f"wind.{axis}": v for axis, v in zip("xyz", vessel.wind, strict=True)}
        inputs |= {f"current.{axis}": v for axis, v in zip("xy", vessel.current, strict=True)}
        found, expected = (
            rate(place, attitude, nu, time, inputs, vessel.shafts),
            vessel.rate(time, np.array(place), attitude, nu),
        )
        worst.append(np.abs(found - expected).max() / np.linalg.norm(expected))
        emerged += vessel.displaced(attitude[2], place[2], np.zeros(10))[2].min() == 0
    assert emerged > STATES / 4
    measured(
        MODEL,
        "accelerations at 1000 random states, pontoons emerged in a part of them",
        worst,
        0.0,
        "1",
        NUMPY,
        within=1e-12,
    )


@pytest.mark.parametrize("payload", PAYLOADS)
def test_static_roll_stiffness(payload: float, measured: MeasurementCheck) -> None:
    """The moment of a heel of 1e-5 rad about the level long axis; M nu' at rest is the load."""
    vessel, angle = OtterOnStrips(payload), 1e-5
    heeled = Rotation.from_euler("x", angle).as_matrix() @ vessel.to_level
    acceleration = rate_of(payload)([0, 0, vessel.rest[0]], heeled, np.zeros(6), 0.0, {}, (0, 0))
    moment = p.TRANSVERSE_MOMENT / np.cos(vessel.rest[2])  # of the trimmed waterplane
    height = vessel.buoyancy_centre[2] + moment / vessel.volume - vessel.level_centre[2]
    found, case = -(vessel.mass_matrix @ acceleration)[3] / angle, f"{payload:g} kg"
    measured(
        MODEL,
        "static roll stiffness",
        found,
        RHO * G * vessel.volume * height,
        "N.m/rad",
        "rho g V GM",
        relative=1e-3,
        case=case,
    )


@pytest.mark.parametrize("payload", PAYLOADS)
def test_long_beam_waves(payload: float, measured: MeasurementCheck) -> None:
    """It rides on waves of 624 m: heave and roll are those of the water, pitch stays."""
    wave = regular_waves(20.0)
    amplitude, number, rows = wave.amplitude[0], wave.wave_number[0], []
    trial = at_sea(wave, vehicle=otter(payload)).step(4000)
    for _ in range(400):
        trial.step(5)
        angle = number * trial["usv.position.y"] - wave.frequency[0] * trial.steps * 0.01
        rows.append(
            (angle, trial["usv.position.z"], *trial.vector("usv.attitude", ("roll", "pitch")))
        )
    angle, *signals = np.array(rows).T
    basis = np.column_stack([np.cos(angle), np.sin(angle), np.ones_like(angle)])
    sizes = [np.hypot(*np.linalg.lstsq(basis, signal, rcond=None)[0][:2]) for signal in signals]
    found = np.array(sizes) / [amplitude, number * amplitude, number * amplitude]
    measured(
        MODEL,
        LONG_WAVES,
        found,
        [1.0, 1.0, 0.0],
        "1",
        "limit of long waves",
        within=0.01,
        case=f"{payload:g} kg",
    )


def righting_moment(vessel: OtterOnStrips, angle: float) -> float:
    """Moment (N m) about the level long axis at a heel, with height and trim in equilibrium."""

    def moment(height: float, pitch: float) -> tuple[float, np.ndarray]:
        attitude = Rotation.from_euler("ZYX", [0, pitch, angle]).as_matrix()
        volume, centre, _ = vessel.displaced(attitude[2], height, np.zeros(10))
        return volume, G * attitude @ np.cross(
            RHO * centre - vessel.mass * vessel.centre, attitude[2]
        )

    def unbalanced(rest: np.ndarray) -> list[float]:
        volume, turning = moment(*rest)
        return [RHO * (volume - vessel.volume), turning[1]]

    height, pitch = fsolve(
        unbalanced, [vessel.rest[0] + 0.2 * np.sin(angle), vessel.rest[2]], xtol=1e-10
    )
    return -moment(height, pitch)[1][0]


def test_it_capsizes_beyond_the_largest_righting_moment(measured: MeasurementCheck) -> None:
    """A heeling moment that grows slowly, until the vessel turns over; linear stiffness would give
    240 N m at 14 degrees.
    """
    vessel, trial, moment = OtterOnStrips(), WorldHarness({"usv": otter()}), 0.0
    largest = max(righting_moment(vessel, angle) for angle in np.radians(range(10, 20)))
    while trial["usv.attitude.roll"] < np.radians(16) and moment < 300.0:
        moment += 0.02
        trial["usv.external_torque.x"] = moment
        trial.step()
    measured(
        MODEL,
        "moment that capsizes it",
        moment,
        largest,
        "N.m",
        "hydrostatics in NumPy",
        relative=0.05,
    )
    assert trial.step(500)["usv.crashed"]


def test_it_starts_on_the_waves_without_a_jump() -> None:
    wave = regular_waves(3.0, steepness=0.05)
    water, largest = wave.amplitude[0] * wave.frequency[0] ** 2, []
    for parameters in ({}, {"initial.on_waves": 0.0}):
        trial = at_sea(wave, vehicle=otter(parameters=parameters))
        speeds = [trial["usv.velocity.z"]] + [trial.step()["usv.velocity.z"] for _ in range(30)]
        largest.append(np.abs(np.diff(speeds)).max() / 0.01)
    assert largest[0] < 1.3 * water
    assert largest[1] > 2 * water


@pytest.mark.long
def test_a_minute_in_waves_current_and_wind(measured: MeasurementCheck) -> None:
    settings = {
        "seed": 3,
        "waves": {
            "significant_height": 0.02,
            "peak_period": 2.5,
            "direction": 0.4,
            "spreading": 2,
            "components": 12,
        },
        "wind": {"velocity": [-3.0, 1.0, 0.0]},
        "current": {"velocity": [0.2, -0.1]},
    }
    times = np.arange(1.0, 61.0)
    reference = OtterOnStrips(45.0, sea(settings), (0.2, -0.1), (-3.0, 1.0, 0.0), (60.0, 50.0))
    vehicle = otter(45.0, parameters={"initial.on_waves": 0.0, "propeller_time_constant": 0.0})
    trial, expected = (
        WorldHarness({"usv": vehicle}, environment=settings),
        reference.simulate(times),
    )
    trial["usv.propeller_speed"] = [60.0, 50.0]
    found = np.array([trial.step(100).vector("usv.position") for _ in times])
    error = np.linalg.norm(found - expected, axis=1)
    measured(
        MODEL,
        "place during 60 s in waves, wind and current",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
    )
