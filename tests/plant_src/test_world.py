"""The world as a component: arguments, variables and errors."""

from __future__ import annotations

import gc
import math
from typing import Any

import pybullet
import pytest
from world_harness import PLATFORM, WorldHarness, quadcopter_settings, vessel_settings

from cosim.core.errors import ComponentError, InputError
from plant_src.world import World

UAV = quadcopter_settings([0.0, 0.0, 2.0])


def refused(**arguments: Any) -> InputError:
    with pytest.raises(InputError) as caught:
        World("plant", **{"vehicles": {"uav": UAV}, **arguments})
    return caught.value


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            {**UAV, "model": "ar_dron"},
            r'vehicles.uav.model: unknown vehicle model "ar_dron"; did you mean "ar_drone"\?',
        ),
        (
            {**UAV, "model": 7},
            (
                "vehicles.uav.model: found 7, expected the name of a vehicle model, or its data: "
                "ar_drone, "
            ),
        ),
        ({"position": [0.0, 0.0, 2.0]}, 'vehicles.uav: "model" is missing'),
        ({"model": "ar_drone"}, 'vehicles.uav: "position" is missing'),
        (
            {"model": "ar_drone", "positon": [0.0, 0.0, 2.0]},
            'vehicles.uav.positon: unknown key "positon"; did you mean "position"',
        ),
        ({**UAV, "yow": 1.0}, r'vehicles.uav.yow: unknown key "yow"; did you mean "yaw"\?'),
        (
            quadcopter_settings([0.0, 0.0]),
            r"vehicles.uav.position: found \[0.0, 0.0\], expected a list of 3 numbers \[x, y, z\]",
        ),
        (
            vessel_settings([0.0, 0.0, 0.1]),
            r"vehicles.uav.position: found .* expected a list of 2 numbers \[x, y\]",
        ),
        (
            quadcopter_settings([0.0, math.nan, 2.0]),
            "vehicles.uav.position: found nan, expected a finite number",
        ),
        ({**UAV, "yaw": "north"}, "vehicles.uav.yaw: found 'north', expected a finite number"),
        ({**UAV, "yaw": True}, "vehicles.uav.yaw: found True, expected a finite number"),
        (
            {**UAV, "rates": [0.0, 1.0]},
            r"vehicles.uav.rates: .* expected a list of 3 numbers \[p, q, r\]",
        ),
        (
            vessel_settings([0.0, 0.0], velocity_body=[1.0, 0.0, 0.5]),
            (
                "vehicles.uav.velocity_body: found velocity_body.w = 0.5; a strider does not move "
                "that way"
            ),
        ),
        ("ar_drone", r"vehicles.uav: found 'ar_drone', expected an object \{...\}"),
    ],
)
def test_a_faulty_vehicle_is_refused(spec: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        World("plant", {"uav": spec})


@pytest.mark.parametrize(
    ("spec", "message"),
    [
        (
            {**PLATFORM, "size": [1.0, -1.0, 1.0]},
            r"platforms.start.size: found \[1.0, -1.0, 1.0\], expected edges greater than 0",
        ),
        ({"size": [1.0, 1.0, 1.0]}, 'platforms.start: "position" is missing'),
        (
            {**PLATFORM, "colour": "red"},
            'platforms.start.colour: unknown key "colour"; valid: size, position',
        ),
    ],
)
def test_a_faulty_platform_is_refused(spec: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        World("plant", {"uav": UAV}, {"start": spec})


@pytest.mark.parametrize("seed", [-1, 1.5, True, "one"])
def test_a_seed_is_an_integer(seed: Any) -> None:
    with pytest.raises(
        InputError, match=r"environment.seed: found .* expected an integer of at least 0"
    ):
        World("plant", {"uav": UAV}, {}, {"seed": seed})


def test_a_world_needs_a_vehicle() -> None:
    assert "vehicles: found no vehicle, expected at least one" in str(refused(vehicles={}))


def test_a_vehicle_name_must_be_valid_in_variable_names() -> None:
    assert 'found the name "my.uav"' in str(refused(vehicles={"my.uav": UAV}))


def test_all_problems_are_reported_together_with_their_paths() -> None:
    error = refused(
        vehicles={"uav": {**UAV, "model": "helicopter"}, "usv": vessel_settings([0.0])},
        platforms={"start": {**PLATFORM, "size": [0.0, 1.0, 1.0]}},
        environment={"wind": 3.0},
    )
    assert [problem.subject for problem in error.problems] == [
        ("arguments", "vehicles", "uav", "model"),
        ("arguments", "vehicles", "usv", "position"),
        ("arguments", "platforms", "start", "size"),
        ("arguments", "environment", "wind"),
    ]


def test_vehicles_may_not_start_inside_each_other() -> None:
    error = refused(
        vehicles={"uav": quadcopter_settings([0.0, 0.0, 0.27]), "usv": vessel_settings([0.0, 0.0])}
    )
    assert "overlap" in str(error)
    assert "vehicles.uav" in str(error)
    assert "vehicles.usv" in str(error)


def test_a_refused_world_leaves_no_client_behind() -> None:
    clients = [pybullet.isConnected(k) for k in range(20)]
    refused(vehicles={"a": vessel_settings([0.0, 0.0]), "b": vessel_settings([0.1, 0.0])})
    assert [pybullet.isConnected(k) for k in range(20)] == clients


def test_a_freed_world_leaves_no_client_behind() -> None:
    clients = [pybullet.isConnected(k) for k in range(20)]
    World("plant", {"uav": UAV}).free()
    assert [pybullet.isConnected(k) for k in range(20)] == clients


def test_a_collected_world_leaves_no_client_behind() -> None:
    """For example a scenario in a notebook that was loaded and not run."""
    gc.collect()
    clients = [pybullet.isConnected(k) for k in range(20)]
    WorldHarness({"uav": UAV}).step(3)
    gc.collect()
    assert [pybullet.isConnected(k) for k in range(20)] == clients


def test_initial_outputs_are_the_arguments() -> None:
    start = {
        "position": [1.0, 2.0, 3.0],
        "yaw": math.pi / 2,
        "velocity_body": [1.0, 0.0, 0.5],
        "rates": [0.1, 0.2, 0.3],
    }
    trial = WorldHarness({"uav": {"model": "ar_drone", **start}})
    assert trial.vector("uav.position") == pytest.approx([1.0, 2.0, 3.0])
    assert trial.vector("uav.attitude", ("roll", "pitch", "yaw")) == pytest.approx(
        [0.0, 0.0, math.pi / 2]
    )
    assert trial.vector("uav.velocity") == pytest.approx([0.0, 1.0, 0.5])
    assert trial.vector("uav.velocity_body", "uvw") == pytest.approx([1.0, 0.0, 0.5])
    assert trial.vector("uav.rates", "pqr") == pytest.approx([0.1, 0.2, 0.3])


def test_the_deck_lies_where_the_fact_sheet_puts_it() -> None:
    trial = WorldHarness(
        {"usv": vessel_settings([1.0, 2.0], yaw=math.pi / 2, rates=[0.0, 0.0, 0.5])}
    )
    assert trial.vector("usv.deck.position") == pytest.approx([1.0 - 0.002, 2.0 - 0.0135, 0.2689])
    assert trial.vector("usv.deck.velocity") == pytest.approx([0.5 * 0.0135, -0.5 * 0.002, 0.0])


@pytest.mark.parametrize(
    ("angle", "faster", "slower"),
    [("roll", (2,), (4,)), ("pitch", (3,), (1,)), ("yaw", (1, 3), (2, 4))],
)
def test_signs_of_the_attitude(
    angle: str, faster: tuple[int, ...], slower: tuple[int, ...]
) -> None:
    """Positive roll lifts the left side, positive pitch lowers the nose, positive yaw is
    counter-clockwise from above.
    """
    trial = WorldHarness({"uav": UAV})
    trial["uav.rotor_speed"] = [
        345.0 + 7.0 * (k in faster) - 7.0 * (k in slower) for k in (1, 2, 3, 4)
    ]
    trial.step(5)
    assert trial[f"uav.attitude.{angle}"] > 1e-4


def test_variables_follow_the_contract() -> None:
    trial = WorldHarness({"uav": UAV, "usv": vessel_settings([0.0, 0.0])})
    variables = {variable.name: variable for variable in trial.world.variables}
    assert variables["uav.rotor_speed"].shape == (4,)
    assert variables["uav.rotor_speed"].scalar_names[0] == "uav.rotor_speed[1]"
    assert variables["usv.deck.velocity.z"].unit.name == "m/s"
    assert variables["usv.contact.touching"].type == "Boolean"
    assert {v.causality for v in variables.values()} == {"input", "output", "local"}
    assert variables["uav.mass"].variability == "constant"
    assert variables["uav.mass"].start == trial.world.get("uav.mass") == 0.443892
    assert "uav.deck.position.x" not in variables


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "uav.rotor_speed",
            [1.0, math.nan, 1.0, 1.0],
            r"plant: do_step failed at t = 0.03 s: uav.rotor_speed\[2\] is nan",
        ),
        ("usv.rudder_angle", math.inf, "usv.rudder_angle is inf, expected a finite number"),
        (
            "uav.external_force.z",
            1e200,
            r"uav.velocity.z became 2.\d+e\+198: the motion has diverged",
        ),
    ],
)
def test_a_vehicle_with_an_invalid_state_is_named(name: str, value: Any, message: str) -> None:
    trial = WorldHarness({"uav": UAV, "usv": vessel_settings([0.0, 0.0])}).step(3)
    trial[name] = value
    with pytest.raises(ComponentError, match=message):
        trial.step()


def test_a_divergence_with_long_steps_names_them_as_the_cause() -> None:
    trial = WorldHarness({"uav": UAV})
    trial["uav.external_force.z"] = 1e200
    with pytest.raises(
        ComponentError,
        match=r"the motion has diverged; probable cause: the step of 1 s, 0\.01 s is usual",
    ):
        trial.step(1, 1.0)


def test_a_step_size_is_positive() -> None:
    trial = WorldHarness({"uav": UAV})
    with pytest.raises(ComponentError, match=r"found step size 0.0, expected a positive number"):
        trial.step(1, 0.0)


def test_unknown_variables_are_refused_with_the_nearest_name() -> None:
    trial = WorldHarness({"uav": UAV})
    with pytest.raises(
        ComponentError, match=r'no variable "uav.rotor_sped"; did you mean "uav.rotor_speed"\?'
    ):
        trial["uav.rotor_sped"] = [0.0] * 4
    with pytest.raises(ComponentError, match=r"uav.position.x is an output"):
        trial["uav.position.x"] = 0.0


def test_a_vessel_starts_with_the_velocity_of_the_waves_unless_it_starts_on_still_water() -> None:
    """The start velocity of the scenario is relative to the water."""

    def start(**settings: Any) -> Any:
        boat = {"model": "otter", "position": [0.0, 0.0], **settings}
        return WorldHarness({"usv": boat}, environment={"seed": 1, "sea_state": 2}).vector(
            "usv.velocity_body", "uvw"
        )

    assert abs(start()[0]) > 0.05
    assert start(velocity_body=[1.0, 0.0, 0.0]) - start() == pytest.approx([1.0, 0.0, 0.0])
    assert start(parameters={"initial.on_waves": 0.0}) == pytest.approx([0.0, 0.0, 0.0])


def test_limits_of_commands_are_those_of_the_data_of_each_vehicle():
    names = ("ar_drone", "bluerov2_heavy", "blueboat", "cybership2", "otter", "strider", "wamv16")
    vehicles = {
        name: {
            "model": name,
            "position": [20.0 * i, 0.0, 2.0][: 3 if name in ("ar_drone", "bluerov2_heavy") else 2],
        }
        for i, name in enumerate(names)
    }
    vehicles["ar_drone"]["parameters"] = {"max_rotor_speed": 600.0}
    world = World("plant", vehicles)
    limits = world.input_limits
    world.free()
    assert limits["ar_drone.rotor_speed[4]"] == (0.0, 600.0)
    assert limits["bluerov2_heavy.thruster_speed[8]"] == (-283.0, 283.0)
    assert limits["cybership2.propeller_speed[3]"] == (-209.44, 209.44)
    assert limits["cybership2.rudder_angle[2]"] == (-0.6109, 0.6109)
    assert limits["wamv16.azimuth[1]"] == pytest.approx((-math.pi / 2, math.pi / 2))
    assert limits["otter.propeller_speed[1]"] == pytest.approx((-101.7, 103.9), abs=0.05)
    assert limits["strider.rudder_angle"] == (-math.pi / 2, math.pi / 2)
    assert not [
        name for name in limits if name.startswith("blueboat.rudder_angle") or "external" in name
    ]
