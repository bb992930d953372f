"""Worlds with wind, waves, current and ground effect: inputs of the vehicles, outputs and saved
states.
"""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from plant_validation import MeasurementCheck
from world_harness import (
    DECK_TOP,
    PLATFORM,
    PLATFORM_TOP,
    REST_HEIGHT,
    WorldHarness,
    quadcopter_settings,
    vessel_settings,
)

import cosim
from cosim.core.errors import ComponentError, InputError
from plant_src.environment import sea
from plant_src.physics.body import ContactBody
from plant_src.world import World

DRAG = {
    f"{name}_drag.{axis}": value
    for name, value in (("rotor", 2e-5), ("body", 0.02))
    for axis in "xyz"
}
AGAIN = "60 steps from flight, touchdown and rest, repeated"
HOVER = [345.0, 346.0, 344.0, 345.0]
GUSTY = {
    "seed": 5,
    "wind": {"speed": 4.0, "direction": 0.5, "turbulence": {}, "profile": {"exponent": 0.14}},
    "current": {
        "speed": 0.1,
        "ramp": {"change": [0.1, 0.0], "start": 0.5, "duration": 1.0},
        "variation": {"standard_deviation": 0.05, "time_constant": 20.0},
    },
}


def test_a_calm_world_has_no_environment() -> None:
    names = [
        variable.name
        for variable in World(
            "plant", {"uav": quadcopter_settings([0, 0, 2]), "usv": vessel_settings([0, 0])}
        ).variables
    ]
    assert not [name for name in names if "environment" in name or "wind" in name or "wave" in name]


def test_a_vessel_drifting_with_air_and_water_moves_as_in_calm_conditions(
    measured: MeasurementCheck,
) -> None:
    """Galilean invariance: water, air and vessel with the same velocity on top."""
    drift = np.array([0.4, -0.3])
    start = np.array([0.5, 0.1])  # through the water, world frame at yaw 0
    calm = WorldHarness({"usv": vessel_settings([0.0, 0.0], velocity_body=[*start, 0.0])})
    moving = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0], velocity_body=[*(start + drift), 0.0])},
        environment={"wind": {"velocity": [*drift, 0.0]}, "current": {"velocity": [*drift]}},
    )
    for trial in (calm, moving):
        trial["usv.thrust"], trial["usv.rudder_angle"] = 1.0, 0.2
        trial.step(1000)
    expected = calm.vector("usv.position", "xy") + 10.0 * drift
    assert np.abs(calm.vector("usv.position", "xy")).max() > 1.0
    error = moving.vector("usv.position", "xy") - expected
    measured(
        "Wind and current",
        "Strider that drifts with both, 10 s",
        error,
        0.0,
        "m",
        "calm, Galilean",
        within=1e-8,
    )
    assert moving["usv.attitude.yaw"] == pytest.approx(calm["usv.attitude.yaw"], abs=1e-9)


def test_a_multirotor_drifting_with_the_air_flies_as_in_calm_air(
    measured: MeasurementCheck,
) -> None:
    drift = np.array([3.0, -2.0, 0.5])
    calm = WorldHarness(
        {
            "uav": quadcopter_settings(
                [0.0, 0.0, 50.0], parameters=DRAG, velocity_body=[4.0, 1.0, 0.0]
            )
        }
    )
    moving = WorldHarness(
        {
            "uav": quadcopter_settings(
                [0.0, 0.0, 50.0], parameters=DRAG, velocity_body=[7.0, -1.0, 0.5]
            )
        },
        environment={"wind": {"velocity": [*drift]}},
    )
    for trial in (calm, moving):
        trial["uav.rotor_speed"] = HOVER
        trial.step(300)
    expected = calm.vector("uav.position") + 3.0 * drift
    error = moving.vector("uav.position") - expected
    measured(
        "Wind and current",
        "AR.Drone that drifts with the air, 3 s",
        error,
        0.0,
        "m",
        "calm, Galilean",
        within=1e-8,
    )


def test_the_wind_at_a_vehicle_is_published() -> None:
    trial = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, 2.5])},
        environment={"wind": {"speed": 6.0, "profile": {"exponent": 0.5}}},
    )
    assert trial.vector("uav.wind") == pytest.approx([3.0, 0.0, 0.0])


def test_gusts_of_different_vehicles_are_independent() -> None:
    wind = {"speed": 5.0, "turbulence": {}}
    trial = WorldHarness(
        {"a": quadcopter_settings([0, 0, 20]), "b": quadcopter_settings([0, 9, 20])},
        environment={"wind": wind},
    ).step(50)
    assert trial["a.wind.y"] != trial["b.wind.y"]
    alone = WorldHarness({"b": quadcopter_settings([0, 9, 20])}, environment={"wind": wind}).step(
        50
    )
    assert alone["b.wind.y"] == trial["b.wind.y"]


def test_wind_and_current_can_be_changed_at_any_time() -> None:
    trial = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0], yaw=math.pi / 2)},
        environment={"wind": {"speed": 0}, "current": {"speed": 0}},
    )
    assert np.abs(trial.step(100).vector("usv.position", "xy")).max() == 0.0
    trial["environment.current.x"] = 0.5
    trial.step(1000)
    assert 0.4 < trial["usv.velocity.x"] < 0.5
    trial["environment.wind.x"] = 2.0
    assert trial.step()["usv.wind.x"] == 2.0


def test_an_input_that_is_not_finite_is_named() -> None:
    trial = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0])}, environment={"current": {"speed": 0}}
    )
    trial["environment.current.y"] = math.nan
    with pytest.raises(ComponentError, match=r"usv.current.y is nan, expected a finite number"):
        trial.step()


def landing(
    environment: dict[str, Any], motion: str = "planar", height: float = 0.15
) -> WorldHarness:
    """Drop from a height (m) in ground effect onto a moving, turning deck in gusts: flight,
    touchdown, rest.
    """
    uav = quadcopter_settings(
        [-0.0135, 0.002, DECK_TOP + REST_HEIGHT + height],
        parameters=DRAG | {"ground_effect": 1.0, "rotor_time_constant": 0.05},
    )
    usv = vessel_settings(
        [0.0, 0.0], velocity_body=[0.2, 0.0, 0.0], rates=[0.0, 0.0, 0.2], motion=motion
    )
    trial = WorldHarness({"uav": uav, "usv": usv}, environment=environment)
    trial["uav.rotor_speed"], trial["usv.thrust"] = [120.0, 121.0, 119.0, 120.0], 1.0
    return trial


@pytest.mark.parametrize("steps", [0, 5, 18, 22, 30, 120, 255, 256, 300])
def test_a_state_is_restored_bit_for_bit_in_gusts(steps: int, measured: MeasurementCheck) -> None:
    differing = returned_to(landing(GUSTY).step(steps))
    measured(
        "Determinism and saved states",
        "steps that differ after a return, in gusts",
        differing,
        0,
        "1",
        AGAIN,
    )


def test_a_state_just_before_a_touchdown_is_restored_bit_for_bit(
    measured: MeasurementCheck,
) -> None:
    """Bullet keeps contact points of later steps; whether they matter depends on the way of the
    first contact.
    """
    differing = 0
    for height in np.linspace(0.05, 0.25, 12):
        steps = 0
        while not (trial := landing(GUSTY, height=height).step(steps))["uav.contact.vessel"]:
            steps += 1
        del trial
        differing += returned_to(landing(GUSTY, height=height).step(steps - 1))
    measured(
        "Determinism and saved states",
        "steps that differ after a return before touchdown",
        differing,
        0,
        "1",
        AGAIN,
    )


def returned_to(trial: WorldHarness) -> int:
    """Return how many of 60 steps differ when they are repeated twice from a saved state."""
    state, before, begun = trial.world.get_state(), trial.bytes, trial.steps
    expected, differing = [trial.step().bytes for _ in range(60)], 0
    for _ in range(2):
        trial.world.set_state(state)
        trial.world.get_outputs()
        assert trial.bytes == before
        trial.steps = begun
        differing += sum(trial.step().bytes != row for row in expected)
    trial.world.free_state(state)
    return differing


def test_the_vehicle_of_these_tests_lands() -> None:
    trial = landing(GUSTY)
    assert not trial.step(15)["uav.contact.vessel"]
    assert trial.step(285)["uav.contact.vessel"]


def test_a_state_includes_the_inputs_of_the_environment() -> None:
    trial = landing(GUSTY)
    state = trial.world.get_state()
    trial["environment.wind.x"] = 9.0
    trial.world.set_state(state)
    assert trial["environment.wind.x"] == pytest.approx(4.0 * math.cos(0.5))


def test_time_counts_from_the_start_of_the_run() -> None:
    early, late = landing(GUSTY), landing(GUSTY)
    late.world.enter_initialization_mode(100.0, 1e3)
    late.steps = 10_000
    assert early.step(50).bytes == late.step(50).bytes


def ground_distance(body: ContactBody) -> float:
    names = [variable.name for variable in body.model.environment_inputs]
    return float(body.environment_inputs[names.index("ground_distance")])


def test_the_ground_distance_counts_from_the_rotor_centre() -> None:
    """Above a platform and a deck: from the centre of the rotors, 6 mm below the centre of mass, to
    the top.
    """
    on = {"parameters": {"ground_effect": 1.0}}
    vehicles = {
        "a": quadcopter_settings([0, 0, 1.0], **on),
        "b": quadcopter_settings([9, 0, 1.0], **on),
        "c": quadcopter_settings([20, 0, 1.0], **on),
    }
    trial = WorldHarness(
        vehicles | {"usv": vessel_settings([9.0, 0.0])}, {"start": PLATFORM}, {"wind": {"speed": 0}}
    )
    distances = [ground_distance(body) for body in trial.world._fleet.bodies[:3]]
    assert distances == pytest.approx([1.0 - PLATFORM_TOP, 1.0 - DECK_TOP, 1.0], abs=0.007)
    assert np.ptp(np.array(distances) - [1.0 - PLATFORM_TOP, 1.0 - DECK_TOP, 1.0]) < 1e-12


def test_without_ground_effect_no_distance_is_computed() -> None:
    trial = WorldHarness(
        {"a": quadcopter_settings([0, 0, 1.0])}, {"start": PLATFORM}, {"wind": {"speed": 0}}
    ).step()
    assert ground_distance(trial.world._fleet.bodies[0]) == 1e3


def test_a_planar_vessel_in_waves_gives_a_warning(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING, "cosim.component"):
        WorldHarness({"usv": vessel_settings([0.0, 0.0])}, environment={"sea_state": 3})
    assert "the planar vessel usv does not move with the waves" in caplog.text


@pytest.mark.parametrize(("drag", "warned"), [({}, True), (DRAG, False)])
def test_wind_that_acts_on_no_vehicle_causes_a_warning(
    caplog: pytest.LogCaptureFixture, drag: dict[str, float], warned: bool
) -> None:
    with caplog.at_level(logging.WARNING):
        World(
            "plant",
            {"uav": quadcopter_settings([0, 0, 2], parameters=drag)},
            environment={"wind": {"speed": 4.0}},
        ).free()
    assert ("the wind acts on no vehicle" in caplog.text) == warned


def test_a_world_that_prepares_a_study_leaves_the_warnings_to_the_runs(
    caplog: pytest.LogCaptureFixture,
) -> None:
    arguments: dict[str, Any] = {
        "vehicles": {"uav": quadcopter_settings([0, 0, 2])},
        "environment": {"wind": {"speed": 4.0}},
    }
    with caplog.at_level(logging.WARNING):
        World.warm(**arguments)
        assert not caplog.text
        World("plant", **arguments).free()
    assert "the wind acts on no vehicle" in caplog.text


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        ({"motion": "6dofs"}, r"""vehicles.usv.motion: found '6dofs'; did you mean "6dof"\?"""),
        ({"motion": 6}, "vehicles.usv.motion: found 6, expected one of: planar, 6dof"),
        (
            {"parameters": {"mas": 1.0}},
            (
                'vehicles.usv.parameters.mas: strider has no parameter "mas" to set; valid: '
                "resistance, propeller_diameter"
            ),
        ),
        ({"parameters": {"initial.yaw": 1.0}}, 'strider has no parameter "initial.yaw" to set'),
        ({"parameters": 3}, r"vehicles.usv.parameters: found 3, expected an object"),
    ],
)
def test_faulty_settings_of_a_vehicle_are_refused(spec: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        World("plant", {"usv": vessel_settings([0.0, 0.0], **spec)})


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        (
            {"rotor_drg.x": 1.0},
            r'parameters.rotor_drg.x: ar_drone has no parameter .*; did you mean "rotor_drag.x"\?',
        ),
        (
            {"ground_effect": 2.0},
            "parameters.ground_effect: found 2.0, expected a number from 0 to 1",
        ),
        ({"body_drag.x": -1.0}, "parameters.body_drag.x: found -1.0, expected at least 0"),
        (
            {"rotor_inertia": [1.0]},
            r"parameters.rotor_inertia: found \[1.0\], expected a finite number",
        ),
    ],
)
def test_faulty_parameters_are_refused(parameters: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        World("plant", {"uav": quadcopter_settings([0.0, 0.0, 2.0], parameters=parameters)})


def test_parameters_reach_the_equations(measured: MeasurementCheck) -> None:
    """Free fall with drag ends at sqrt(m g / body_drag)."""
    trial = WorldHarness(
        {
            "uav": quadcopter_settings(
                [0.0, 0.0, 300.0], parameters={f"body_drag.{axis}": 0.1 for axis in "xyz"}
            )
        }
    ).step(800)
    speed, terminal = -trial["uav.velocity.z"], math.sqrt(0.443892 * 9.81 / 0.1)
    measured(
        "AR.Drone 2.0",
        "terminal velocity with body drag",
        speed,
        terminal,
        "m/s",
        "closed form",
        relative=1e-4,
    )


def test_the_elevation_at_a_vessel_is_that_of_the_sea() -> None:
    environment = {"seed": 3, "waves": {"significant_height": 0.05, "peak_period": 2.0}}
    trial = WorldHarness(
        {"usv": vessel_settings([2.0, 1.0], motion="6dof")}, environment=environment
    )
    waves = sea(environment)
    assert trial["usv.wave.elevation"] == pytest.approx(waves.elevation(2.0, 1.0, 0.0), abs=1e-13)
    trial["environment.wave_gain"] = 0.5
    trial.step(70)
    x, y = trial.vector("usv.position", "xy")
    assert trial["usv.wave.elevation"] == pytest.approx(0.5 * waves.elevation(x, y, 0.7), abs=1e-13)


@pytest.mark.parametrize("steps", [0, 10, 22, 60, 300])
def test_a_state_is_restored_bit_for_bit_in_waves(steps: int, measured: MeasurementCheck) -> None:
    differing = returned_to(landing(GUSTY | {"sea_state": 1}, "6dof").step(steps))
    measured(
        "Determinism and saved states",
        "steps that differ after a return, gusts and waves",
        differing,
        0,
        "1",
        AGAIN,
    )


def test_a_vessel_follows_the_waves_of_the_scenario() -> None:
    """Waves much longer than the vessel carry it up and down; half the gain, half the height."""
    trial = WorldHarness(
        {"usv": vessel_settings([0.0, 0.0], motion="6dof")}, environment={"sea_state": 3}
    )
    trial["environment.wave_gain"] = 0.5
    rows = np.array(
        [
            (trial["usv.position.z"], trial["usv.wave.elevation"])
            for _ in range(1500)
            if trial.step()
        ]
    )
    heave, elevation = rows[500:].T - rows[500:].T.mean(axis=1, keepdims=True)
    assert np.abs(elevation).max() > 0.1
    assert np.abs(heave - elevation).max() < 0.2 * np.abs(elevation).max()


EVENTFUL = """
{"name": "eventful", "stop_time": 3, "step_size": 0.01,
 "components": {"plant": {"python": "ROOT/plant_src/world.py:World", "arguments": {
   "vehicles": {"usv": {"model": "strider", "motion": "6dof", "position": [0, 0]}},
   "environment": {"seed": 1, "wind": {"speed": 0},
    "waves": {"significant_height": 0.2, "peak_period": 3}}}}},
 "inputs": [{"file": "gain.csv", "to": {"gain": "plant.environment.wave_gain"}}],
 "events": [{"time": 1, "set": {"plant.environment.wind.x": 4}},
  {"time": 2, "set": {"plant.environment.wind.x": -4}}]}
"""


def test_events_and_profiles_change_the_weather(tmp_path: Path) -> None:
    """The wind is that of the step that ends at a row; waves that fade by a profile are gone at its
    end.
    """
    (tmp_path / "gain.csv").write_text('"time","gain"\n0,1\n1,1\n2,0\n3,0\n')
    (tmp_path / "eventful.json").write_text(
        EVENTFUL.replace("ROOT", str(Path(__file__).parents[3]))
    )
    result = cosim.run(tmp_path / "eventful.json")
    wind, elevation = result["plant.usv.wind.x"], result["plant.usv.wave.elevation"]
    assert wind[[0, 100, 101, 200, 201, 300]].tolist() == [0.0, 0.0, 4.0, 4.0, -4.0, -4.0]
    assert np.abs(elevation[:100]).max() > 0.02
    assert np.abs(elevation[202:]).max() == 0.0


@pytest.mark.parametrize("mass", [-1.0, 46.0])
def test_a_payload_of_impossible_mass_is_refused_with_its_path(mass: float) -> None:
    with pytest.raises(
        InputError, match=f"parameters.payload_mass: found {mass}, expected a number from 0 to 45"
    ) as caught:
        World(
            "plant",
            {"usv": {"model": "otter", "position": [0, 0], "parameters": {"payload_mass": mass}}},
        )
    assert caught.value.problems[0].subject == (
        "arguments",
        "vehicles",
        "usv",
        "parameters",
        "payload_mass",
    )


def test_floating_vessels_may_not_start_inside_each_other() -> None:
    with pytest.raises(InputError, match="overlaps") as caught:
        World(
            "plant",
            {
                "a": vessel_settings([0.0, 0.0], motion="6dof"),
                "b": vessel_settings([0.3, 0.0], motion="6dof"),
            },
        )
    assert caught.value.problems[0].subject in [
        ("arguments", "vehicles", name, "position") for name in "ab"
    ]
