"""Distances along the beam against plain geometry."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from sensor_harness import SensorHarness, quaternion, with_parameters

from cosim.core.errors import InputError
from plant_src.sensors.rangefinder import Rangefinder
from plant_src.vehicles.strider.parameters import DECK_X
from plant_src.world import World

POSE = {"deck.position": "xyz", "orientation": "wxyz"}
TABLE = {"table": {"size": [4.0, 4.0, 0.1], "position": [10.0, 0.0, 0.45]}}  # its top is at 0.5 m


@pytest.fixture
def sensor():
    made = []

    def make(parameters=None, inputs=None, **arguments):
        exact = {"noise_floor": 0.0, "noise_share": 0.0, "rate": 100.0}
        made.append(
            with_parameters(Rangefinder("range", **arguments), **exact | (parameters or {}))
        )
        return SensorHarness(made[-1], **inputs or {})

    yield make
    for component in made:
        component.free()


def test_water_below_a_tilted_vehicle(sensor, measured):
    trial = sensor(
        inputs={
            "vehicle__position": (3, 4, 2.0),
            "vehicle__orientation": quaternion((1, 1, 0), 0.4),
        }
    )
    distance = trial["distance"]
    measured(
        "Sensors",
        "rangefinder, tilted above water",
        distance,
        2.0 / np.cos(0.4),
        "m",
        "plane geometry",
        relative=1e-12,
    )


def test_a_platform_in_between(sensor):
    trial = sensor(platforms=TABLE)
    assert trial.set_inputs(vehicle__position=(11.9, 1.9, 2.0)).step()["distance"] == pytest.approx(
        1.5, abs=1e-6
    )
    assert trial.set_inputs(vehicle__position=(12.1, 1.9, 2.0)).step()["distance"] == pytest.approx(
        2.0, abs=1e-6
    )


def test_the_mounting_turns_with_the_vehicle(sensor):
    parameters = {"mounting": [0.5, 0.0, -0.1], "direction": [2.0, 0.0, -2.0]}
    trial = sensor(
        parameters,
        {"vehicle__position": (0, 0, 3.0), "vehicle__orientation": quaternion((0, 1, 0), 0.3)},
    )
    turn = Rotation.from_rotvec([0, 0.3, 0])
    height = 3.0 + turn.apply([0.5, 0, -0.1])[2]
    assert trial["distance"] == pytest.approx(
        -height / (turn.apply([1, 0, -1]) / np.sqrt(2))[2], rel=1e-12
    )


def test_the_deck_of_a_heeling_vessel_where_it_is(sensor, measured):
    heel, point = 0.2, np.array([5.0, -3.0, 0.3])
    inputs = {
        "usv__deck__position": point,
        "usv__orientation": quaternion((1, 0, 0), heel),
        "vehicle__position": (5.1, -3.05, 2.0),
    }
    trial = sensor(vessels={"usv": "strider"}, inputs=inputs)
    turn = Rotation.from_rotvec([heel, 0, 0])
    normal = turn.apply([0, 0, 1])
    height = point[2] - (normal[0] * (5.1 - point[0]) + normal[1] * (-3.05 - point[1])) / normal[2]
    distance = trial["distance"]
    measured(
        "Sensors",
        "rangefinder above a heeling deck",
        distance,
        2.0 - height,
        "m",
        "plane geometry",
        within=1e-6,
    )


def test_the_deck_moves_on_and_leaves_the_water(sensor):
    trial = sensor(
        vessels={"usv": "strider"},
        inputs={"vehicle__position": (0, 0, 2.0), "usv__deck__position": (0, 0, 0.27)},
    )
    assert trial["distance"] == pytest.approx(2.0 - 0.27, abs=1e-6)
    trial.set_inputs(usv__deck__position=((DECK_X[0] - DECK_X[1]) / 2 - 0.01, 0, 0.27)).step()
    assert trial["distance"] == pytest.approx(2.0, abs=1e-6)


def test_out_of_reach_is_the_largest_distance_and_invalid(sensor):
    trial = sensor(inputs={"vehicle__position": (0, 0, 12.5)})
    assert (trial["distance"], trial["valid"]) == (12.0, False)
    assert trial.set_inputs(vehicle__position=(0, 0, 0.05)).step()["valid"] is False
    assert trial.set_inputs(vehicle__position=(0, 0, 11.9)).step()["valid"] is True


def test_the_beam_passes_the_water_plane_without_water(sensor):
    assert sensor(water=False, inputs={"vehicle__position": (0, 0, 2.0)})["valid"] is False


def test_noise_grows_with_distance(sensor):
    parameters = {"noise_floor": 0.02, "noise_share": 0.01}
    for height, sigma in ((1.0, 0.02), (10.0, 0.1)):
        trial = sensor(parameters, {"vehicle__position": (0, 0, height)}, seed=3)
        assert trial.record(3000, ["distance"]).std() == pytest.approx(sigma, rel=0.05)


def test_a_vehicle_that_is_not_a_vessel_is_rejected_with_the_other_problems():
    with pytest.raises(InputError) as caught:
        Rangefinder(
            "range",
            vessels={"uav": "ar_drone"},
            platforms={"start": {"size": [1, 2], "position": [0, 0, 0]}},
        )
    assert [problem.subject[1:3] for problem in caught.value.problems] == [
        ("vessels", "uav"),
        ("platforms", "start"),
    ]


@pytest.mark.parametrize(
    ("vehicle", "motion"), [("strider", "planar"), ("strider", "6dof"), ("otter", "6dof")]
)
def test_distance_to_the_deck_agrees_with_the_world(sensor, vehicle, motion):
    world = World(
        "plant", {"usv": {"model": vehicle, "motion": motion, "position": [3.0, -2.0], "yaw": 0.6}}
    )
    try:
        pose = {}
        for name, axes in POSE.items():
            pose[f"usv.{name}"] = [world.get(f"usv.{name}.{axis}") for axis in axes]
        deck = np.array([world.get(f"usv.deck.position.{axis}") for axis in "xyz"])
    finally:
        world.free()
    trial = sensor(
        vessels={"usv": vehicle}, inputs=pose | {"vehicle__position": deck + np.array([0, 0, 1.5])}
    )
    assert trial["distance"] == pytest.approx(1.5, abs=1e-6)
