"""The Otter of MSS against values of Fossen's Marine Systems Simulator and an independent
implementation.
"""

from __future__ import annotations

import numpy as np
import pytest
from otter_reference import Otter
from plant_validation import MeasurementCheck
from world_harness import WorldHarness

MODEL, GOLDEN, NUMPY = (
    "Otter of MSS",
    "golden value of MSS `otter.m`",
    "`otter.m` a second time in NumPy",
)
FLIP = np.array([1.0, -1.0, -1.0])
ORIGIN_FROM_CENTRE = -np.array(
    [0.153125, 0.0, 0.246875]
)  # with the reference payload, forward-left-up


def otter(**more: object) -> WorldHarness:
    return WorldHarness({"usv": {"model": "otter_mss", "position": [0.0, 0.0], **more}})


def run(trial: WorldHarness, port: float, starboard: float, steps: int) -> WorldHarness:
    trial["usv.propeller_speed"] = [port, starboard]
    return trial.step(steps)


def origin(trial: WorldHarness) -> np.ndarray:
    """Position of the origin of the hull's frame, by its published attitude."""
    w, *v = trial.vector("usv.orientation", "wxyz")
    turned = np.cross(v, ORIGIN_FROM_CENTRE)
    return (
        trial.vector("usv.position") + ORIGIN_FROM_CENTRE + 2 * (w * turned + np.cross(v, turned))
    )


@pytest.fixture(scope="module")
def dash() -> tuple[WorldHarness, float]:
    """30 s at 100 rad/s from rest, and when 63.2 % of the final speed were reached."""
    trial, reached = otter(), 0.0
    while trial.steps < 3000:
        run(trial, 100.0, 100.0, 1)
        if not reached and trial["usv.velocity_body.u"] > 0.632 * 2.85735:
            reached = trial.steps * 0.01
    return trial, reached


def test_speed_is_thrust_over_damping(
    dash: tuple[WorldHarness, float], measured: MeasurementCheck
) -> None:
    u, thrust, damping = dash[0]["usv.velocity_body.u"], 221.6, 24.4 * 9.81 / (6 * 0.5144)
    measured(MODEL, "speed at 100/100 rad/s", u, 2.85735, "m/s", GOLDEN, within=5e-6)
    measured(
        MODEL,
        "the same, as thrust over damping",
        u,
        thrust / damping,
        "m/s",
        "closed form",
        relative=1e-6,
    )


def test_time_to_speed(dash: tuple[WorldHarness, float], measured: MeasurementCheck) -> None:
    measured(MODEL, "time to 63.2 % of it from rest", dash[1], 1.26, "s", GOLDEN, within=1e-9)


def test_sinkage_and_trim(dash: tuple[WorldHarness, float], measured: MeasurementCheck) -> None:
    """Bow down is a positive pitch here."""
    measured(
        MODEL,
        "sinkage with 25 kg of payload",
        -origin(dash[0])[2],
        0.03771,
        "m",
        GOLDEN,
        within=5e-6,
    )
    trim = np.degrees(dash[0]["usv.attitude.pitch"])
    measured(MODEL, "trim, bow down", trim, 1.49063, "deg", GOLDEN, within=5e-6)


def test_coasting(measured: MeasurementCheck) -> None:
    trial = run(otter(), 100.0, 100.0, 3000)
    start = origin(trial)[0]
    run(trial, 0.0, 0.0, 2000)
    measured(
        MODEL,
        "way in 20 s without thrust",
        origin(trial)[0] - start,
        3.2933,
        "m",
        GOLDEN,
        within=5e-5,
    )
    measured(
        MODEL,
        "speed left after them",
        trial["usv.velocity_body.u"],
        0.0,
        "m/s",
        GOLDEN,
        within=5e-6,
    )


def test_mass_matrix(measured: MeasurementCheck) -> None:
    casadi = pytest.importorskip("casadi")
    from plant_src.vehicles.otter.loads import otter_model
    from plant_src.vehicles.otter_mss import equations

    model = otter_model(equations.VESSEL)
    parameters = np.concatenate(
        [np.ravel(v.start) for v in model.variables if v.causality == "parameter"]
    )
    assert model.derived_parameters is not None
    constants = equations.VESSEL.constants.by_name(model.derived_parameters(casadi.SX(parameters)))
    diagonal = np.diag(np.linalg.inv(casadi.DM(constants["inverse_mass_matrix"]).full()))
    golden = [85.282, 162.500, 135.000, 17.657, 32.894, 40.045]
    measured(
        MODEL, "diagonal of the mass matrix", diagonal, golden, "kg, kg.m2", GOLDEN, within=5e-4
    )


def test_without_thrust_it_rests(measured: MeasurementCheck) -> None:
    trial = otter().step(1000)
    measured(
        "Otter of MSS",
        "speed after 10 s at zero thrust",
        trial.vector("usv.velocity"),
        0.0,
        "m/s",
        "equilibrium",
        within=1e-12,
    )
    measured(
        MODEL,
        "way in them",
        trial.vector("usv.position", "xy"),
        0.0,
        "m",
        "equilibrium",
        within=1e-9,
    )


@pytest.mark.parametrize(("payload", "turning"), [(0.0, 100), (25.0, 800), (45.0, 100)])
def test_circle_agrees_with_an_independent_implementation(
    payload: float, turning: int, measured: MeasurementCheck
) -> None:
    """1 s ahead, then a turning circle, with the reference payload for 8 s."""
    reference, trial = Otter(payload), otter(parameters={"payload_mass": payload})
    for _ in range(50):
        reference.eta = reference.trim(reference.eta)
    offset = trial.vector("usv.position")[:2] - centre(reference)[:2]
    for port, starboard, steps in ((100.0, 100.0, 100), (100.0, 60.0, turning)):
        run(trial, port, starboard, steps)
        for _ in range(steps):
            reference.step((port, starboard))
        found = trial.vector("usv.position") - [*offset, 0.0]
        measured(
            MODEL,
            "place on a circle at 100/60 rad/s",
            found - centre(reference),
            0.0,
            "m",
            NUMPY,
            within=1e-6,
        )
        attitude = trial.vector("usv.attitude", ("roll", "pitch", "yaw")) * FLIP
        turned = np.angle(np.exp(1j * (attitude - reference.eta[3:])))
        measured(MODEL, "attitude on it", turned, 0.0, "rad", NUMPY, within=1e-6)
    assert abs(reference.eta[5]) > turning * 1e-3


def centre(reference: Otter) -> np.ndarray:
    """Position of the centre of mass, world frame of the plant."""
    from otter_reference import rotation

    return FLIP * (reference.eta[:3] + rotation(reference.eta[3:]) @ reference.centre)


def test_current_carries_it_like_the_independent_implementation(measured: MeasurementCheck) -> None:
    reference = Otter(current=(0.3, 0.2))
    for _ in range(50):
        reference.eta = reference.trim(reference.eta)
    trial = WorldHarness(
        {"usv": {"model": "otter_mss", "position": [0.0, 0.0]}},
        environment={"current": {"velocity": [0.3, -0.2]}},
    )
    offset = trial.vector("usv.position")[:2] - centre(reference)[:2]
    run(trial, 80.0, 50.0, 200)
    for _ in range(200):
        reference.step((80.0, 50.0))
    error = trial.vector("usv.position") - [*offset, 0.0] - centre(reference)
    measured(MODEL, "place after 2 s in a current", error, 0.0, "m", NUMPY, within=1e-6)


@pytest.mark.parametrize(("speed", "force"), [(200.0, 24.4 * 9.81), (-200.0, -13.6 * 9.81)])
def test_thrust_is_limited_to_the_bollard_pull(speed: float, force: float) -> None:
    """The first step from rest without lag: force over mass."""
    trial = run(otter(parameters={"propeller_time_constant": 0.0}), speed, speed, 1)
    slow = run(
        otter(parameters={"propeller_time_constant": 0.0}),
        np.sign(speed) * 10.0,
        np.sign(speed) * 10.0,
        1,
    )
    coefficient = 0.02216 if speed > 0 else -0.01289
    ratio = trial["usv.velocity_body.u"] / slow["usv.velocity_body.u"]
    assert ratio == pytest.approx(force / (coefficient * 100.0), rel=1e-3)


def test_port_propeller_turns_to_starboard() -> None:
    assert run(otter(), 50.0, 0.0, 100)["usv.attitude.yaw"] < -0.01


def test_wind_from_abeam_pushes_and_heels_it() -> None:
    trial = WorldHarness(
        {"usv": {"model": "otter_mss", "position": [0.0, 0.0]}},
        environment={"wind": {"velocity": [0.0, 10.0, 0.0]}},
    )
    trial.step(300)
    assert trial["usv.velocity.y"] > 0.1
    assert trial["usv.attitude.roll"] < -1e-3
