"""Forces of water on a multirotor, each against its closed form."""

from __future__ import annotations

import numpy as np
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck
from world_harness import WorldHarness, quadcopter_settings

GRAVITY, WATER = 9.81, 1025.0
AR_DRONE_MASS, AR_DRONE_VOLUME, AR_DRONE_HEIGHT = 0.443892, 7.5e-4, 0.0866
CRAZYFLIE_MASS, CRAZYFLIE_AREA = 0.027, 0.056 * 0.056


def test_a_light_quadcopter_floats_at_the_depth_of_archimedes(measured: MeasurementCheck) -> None:
    fmu = PlantFmu("ar_drone", {"initial.position.z": 0.3})
    fmu.set({"water_level": 0.05})
    fmu.step(0.01, 3000)
    depth = AR_DRONE_HEIGHT * (AR_DRONE_MASS / (WATER * AR_DRONE_VOLUME) - 0.5)
    depths = []
    for _ in range(300):  # it still heaves by millimetres, because the drag is quadratic
        fmu.step(0.01)
        depths.append(0.05 - fmu.get("position.z").item())
    measured(
        "Multirotors",
        "mean depth of a floating AR.Drone",
        np.mean(depths),
        depth,
        "m",
        "Archimedes",
        within=2e-4,
    )


def test_a_heavy_quadcopter_sinks_at_the_speed_of_its_drag(measured: MeasurementCheck) -> None:
    fmu = PlantFmu("crazyflie", {"initial.position.z": 0.5, "water_drag_coefficient": 1.2})
    fmu.set({"water_level": 0.0})
    fmu.step(0.01, 1000)
    weight = GRAVITY * CRAZYFLIE_MASS * (1 - WATER / 1200)
    speed = np.sqrt(2 * weight / (WATER * 1.2 * CRAZYFLIE_AREA))
    measured(
        "Multirotors",
        "speed of a sinking Crazyflie",
        -fmu.get("velocity.z"),
        speed,
        "m/s",
        "closed form",
        relative=1e-9,
    )


def test_it_drifts_with_the_current_and_stops_turning() -> None:
    fmu = PlantFmu("ar_drone", {"initial.position.z": 0.0, "initial.rates.r": 20.0})
    fmu.set({"water_level": 0.0, "current.x": 0.4, "current.y": -0.3})
    fmu.step(0.01, 6000)
    assert np.abs(fmu.vector("velocity") - [0.4, -0.3, 0.0]).max() < 0.02
    assert abs(fmu.get("rates.r")[0]) < 0.2


def test_rotors_below_the_surface_have_no_thrust() -> None:
    """Full thrust lifts the quadcopter from the surface, on which its rotors are dry, but not from
    below.
    """
    heights = []
    for start in (0.06, -0.3):
        fmu = PlantFmu("ar_drone", {"initial.position.z": start, "displaced_volume": 4e-4})
        fmu.set({"water_level": 0.0, **{f"rotor_speed[{k}]": 520.0 for k in range(1, 5)}})
        fmu.step(0.01, 100)
        heights.append(fmu.get("position.z").item())
    assert heights[0] > 2.0
    assert heights[1] < -0.3


def test_far_above_the_water_its_parameters_do_not_matter() -> None:
    positions = []
    for volume in (0.0, 1.0):
        fmu = PlantFmu("ar_drone", {"initial.position.z": 0.2, "displaced_volume": volume})
        fmu.set(
            {
                "water_level": 0.0,
                "rotor_speed[1]": 345.0,
                "rotor_speed[3]": 346.0,
                "external_force.z": 2.2,
            }
        )
        fmu.step(0.01, 20)
        positions.append(fmu.vector("position").tolist())
    assert positions[0] == positions[1]


def test_shorter_steps_converge_on_a_fast_impact(measured: MeasurementCheck) -> None:
    """The impact is not smooth: the error decreases with the first order."""
    depths = []
    for size in (0.01, 0.005, 0.0025, 0.0001):
        fmu = PlantFmu("ar_drone", {"initial.position.z": 5.0, "initial.velocity_body.w": -8.0})
        fmu.set({"water_level": 0.0})
        fmu.step(size, round(1.0 / size))
        depths.append(fmu.get("position.z").item())
    errors = np.abs(np.array(depths[:3]) - depths[3])
    assert errors[2] <= errors[0]
    measured(
        "Multirotors",
        "place 1 s after the start of a fall into water at 10 ms",
        errors[0],
        0.0,
        "m",
        "0.1 ms",
        within=2e-4,
    )


def test_the_world_has_water_everywhere(measured: MeasurementCheck) -> None:
    trial = WorldHarness({"uav": quadcopter_settings([0.0, 0.0, 2.0])})
    trial.step(2000)
    depth = AR_DRONE_HEIGHT * (AR_DRONE_MASS / (WATER * AR_DRONE_VOLUME) - 0.5)
    measured(
        "Multirotors",
        "depth of an AR.Drone that fell into the sea",
        -trial["uav.position.z"],
        depth,
        "m",
        "Archimedes",
        within=0.01,
    )


def test_a_floating_quadcopter_follows_the_waves() -> None:
    waves = {"spectrum": "jonswap", "significant_height": 0.3, "peak_period": 5.0}
    trial = WorldHarness(
        {"uav": quadcopter_settings([0.0, 0.0, 0.5])}, environment={"waves": waves}
    )
    trial.step(1000)
    errors = []
    for _ in range(400):
        trial.step()
        level = trial.world._environment.water_level(
            trial["uav.position.x"], trial["uav.position.y"], trial.steps * 0.01
        )
        errors.append(trial["uav.position.z"] - level)
    assert np.abs(errors).max() < 0.05
