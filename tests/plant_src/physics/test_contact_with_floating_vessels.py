"""Contact with vessels in six degrees of freedom."""

from __future__ import annotations

import numpy as np
import original_system_reference as reference
import pytest
from plant_validation import MeasurementCheck
from world_harness import DECK_TOP, REST_HEIGHT, WorldHarness, quadcopter_settings, vessel_settings

from plant_src.vehicles.strider_6dof import parameters as p

WEIGHT = reference.QUADCOPTER_MASS * reference.GRAVITY
AGAIN = "40 steps from flight, touchdown and rest, repeated"
OTTER_DECK = 0.4 - 0.0377  # m above the water
WAVES = {
    "seed": 2,
    "waves": {"significant_height": 0.05, "peak_period": 2.0},
    "wind": {"velocity": [1.0, 0.0, 0.0]},
}


def landing(
    offset: tuple[float, float] = (0.15, 0.1), height: float = 0.02, **more: object
) -> WorldHarness:
    """A quadcopter above the deck of a catamaran at rest."""
    uav = quadcopter_settings([*offset, DECK_TOP + REST_HEIGHT + height])
    return WorldHarness({"uav": uav, "usv": vessel_settings([0.0, 0.0], motion="6dof")}, **more)


def test_the_weight_on_the_deck_sinks_and_heels_the_vessel(measured: MeasurementCheck) -> None:
    """Expected values: weight over stiffness, lever arms from the position of the quadcopter."""
    trial = landing().step(500)
    x, y, _ = trial.vector("uav.position") - trial.vector("usv.position")
    heave, roll, pitch = p.STIFFNESS
    sink, heel, trim = (
        p.CENTRE_OF_MASS_HEIGHT - trial["usv.position.z"],
        trial["usv.attitude.roll"],
        trial["usv.attitude.pitch"],
    )
    measured(
        "Contact",
        "force of an AR.Drone at rest on a floating deck",
        trial["uav.contact.force"],
        WEIGHT,
        "N",
        "weight",
        relative=1e-4,
    )
    measured(
        "Contact",
        "sinkage of the Strider under it",
        sink,
        WEIGHT / heave,
        "m",
        "hydrostatics",
        relative=5e-3,
    )
    measured(
        "Contact",
        "heel, 0.1 m off centre",
        heel,
        -WEIGHT * y / roll,
        "rad",
        "hydrostatics",
        relative=5e-3,
    )
    measured(
        "Contact",
        "trim, 0.15 m off centre",
        trim,
        WEIGHT * x / pitch,
        "rad",
        "hydrostatics",
        relative=5e-3,
    )


def test_the_quadcopter_stays_where_it_landed() -> None:
    trial = landing().step(100)
    places = [
        trial.vector("uav.position") - trial.vector("usv.deck.position")
        for _ in range(5)
        if trial.step(100)
    ]
    assert np.linalg.norm(places[-1] - places[0]) < 1e-3
    assert np.linalg.norm(trial.vector("usv.velocity")) < 1e-3


def test_a_sideways_landing_conserves_momentum(measured: MeasurementCheck) -> None:
    """Touchdown, 0.2 s of sliding and turning, and off again; without water and air the vessel is a
    free rigid body.
    """
    uav = quadcopter_settings(
        [0.03, 0.01, DECK_TOP + REST_HEIGHT + 0.005], velocity_body=[1.0, -0.5, 0.0]
    )
    usv = vessel_settings(
        [0.0, 0.0], motion="6dof", rates=[0.0, 0.0, 0.2], parameters={"hydrodynamics": 0.0}
    )
    trial = WorldHarness({"uav": uav, "usv": usv})
    before = momentum(trial)
    trial.step(26)
    assert trial["uav.contact.vessel"]
    trial["uav.external_force.z"] = 3 * WEIGHT
    trial.step(30)
    assert not trial["uav.contact.touching"]
    assert np.linalg.norm(trial.vector("usv.velocity", "xy")) > 0.02
    measured(
        "Contact",
        "momentum after a sideways landing",
        momentum(trial),
        before,
        "kg.m/s",
        "conservation",
        relative=1e-7,
    )


def momentum(trial: WorldHarness) -> np.ndarray:
    return reference.QUADCOPTER_MASS * trial.vector("uav.velocity", "xy") + p.MASS * trial.vector(
        "usv.velocity", "xy"
    )


def test_after_a_landing_the_vessel_floats_again_as_before() -> None:
    trial = landing().step(200)
    trial["uav.external_force.z"] = 1.2 * WEIGHT
    trial.step(300)
    assert not trial["usv.contact.touching"]
    assert trial["usv.position.z"] == pytest.approx(p.CENTRE_OF_MASS_HEIGHT, abs=1e-5)
    assert trial["usv.attitude.pitch"] == pytest.approx(0.0, abs=1e-5)


def test_the_otter_carries_a_quadcopter_on_its_deck(measured: MeasurementCheck) -> None:
    trial = WorldHarness(
        {
            "uav": quadcopter_settings([0.0, 0.3, OTTER_DECK + 0.1]),
            "usv": {"model": "otter", "position": [0.0, 0.0]},
        }
    ).step(400)
    assert trial["uav.contact.vessel"]
    assert trial["uav.contact.force"] == pytest.approx(WEIGHT, rel=1e-3)
    # rho g V GM less that of the quadcopter's own weight above the centre of buoyancy, at 0.4 m,
    # and its sinkage
    heel, expected = trial["usv.attitude.roll"], -WEIGHT * 0.3 / (989.64 - WEIGHT * 0.4)
    measured(
        "Contact",
        "heel of the Otter under an AR.Drone",
        heel,
        expected,
        "rad",
        "hydrostatics",
        relative=5e-3,
    )


@pytest.mark.parametrize("steps", [0, 5, 7, 8, 9, 60, 200])
def test_a_saved_state_is_restored_bit_for_bit_in_waves(
    steps: int, measured: MeasurementCheck
) -> None:
    """In flight, at touchdown, at rest."""
    trial = landing(environment=WAVES).step(steps)
    trial["usv.thrust"] = 1.0
    state, before = trial.world.get_state(), trial.bytes
    expected = [trial.step().bytes for _ in range(40)]
    assert trial["uav.contact.vessel"]
    for _ in range(2):
        trial.world.set_state(state)
        trial.steps = steps
        trial.world.get_outputs()
        assert trial.bytes == before
        differing = sum(trial.step().bytes != row for row in expected)
        measured(
            "Determinism and saved states",
            "steps that differ after a return, 6-DOF in waves",
            differing,
            0,
            "1",
            AGAIN,
        )


def test_a_vessel_stops_at_a_wall() -> None:
    wall = {"size": [0.1, 4.0, 1.0], "position": [1.0, 0.0, 0.0]}
    trial = WorldHarness({"usv": vessel_settings([0.0, 0.0], motion="6dof")}, {"wall": wall})
    trial["usv.thrust"] = 2.0
    trial.step(600)
    assert trial["usv.position.x"] == pytest.approx(0.95 - 0.4895, abs=5e-3)
    assert abs(trial["usv.velocity.x"]) < 1e-3
