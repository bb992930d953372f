"""Multirotors with rotor lag, drag, wind and ground effect against an independent implementation of
their data sheets.
"""

from __future__ import annotations

import numpy as np
import pytest
from multirotor_reference import (
    FLIP,
    VEHICLES,
    HeldInputs,
    InputFunction,
    Vehicle,
    initial_state,
    simulate_flight,
)
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck

STEP = 0.01


def pilot(vehicle: Vehicle, within_limits: bool = False) -> InputFunction:
    """Every 0.1 s other commands, loads, wind and heights, now and then beyond the limits of motors
    and ground effect, unless
    `within_limits`; torque and thrust that keep the vehicle, which is unstable, upright.
    """
    random, count = np.random.default_rng(3), len(vehicle.rotors)
    strength = 0.3 if within_limits else 1.0
    heights = np.array([0.6, 1.5, 4.0, 1e4] if within_limits else [0.3, 0.6, 1.5, 4.0, 1e4])
    beyond = (
        {} if within_limits else {40: vehicle.max_rotor_speed, 41: -2 * vehicle.max_rotor_speed}
    )

    def segment(k: int, velocity: np.ndarray, up: np.ndarray, rates: np.ndarray) -> HeldInputs:
        upright = np.array([-up[1], up[0], 0.0])
        torque = vehicle.inertia @ (9 * upright - 6 * rates + strength * random.standard_normal(3))
        climbing = np.clip(1 - 0.1 * velocity[2], 0.5, 1.5)
        command = vehicle.hover_speed * climbing * (1 + 0.002 * random.standard_normal(count))
        command += beyond.get(k % 50, 0.0)
        force, wind = (
            strength * (0.2 * vehicle.mass) * random.standard_normal(3),
            2 * strength * random.standard_normal(3),
        )
        height = float(vehicle.radius * heights[k % len(heights)])
        return HeldInputs(0.1, command, force, torque, wind, height)

    return segment


def inputs(held: HeldInputs) -> dict[str, float]:
    """A segment as inputs of a plant FMU."""
    named = {f"rotor_speed[{number}]": value for number, value in enumerate(held.command, 1)}
    for name, vector in (
        ("external_force", held.force),
        ("external_torque", held.torque),
        ("wind", held.wind),
    ):
        named |= {f"{name}.{axis}": value for axis, value in zip("xyz", vector, strict=True)}
    return named | {"ground_distance": held.height}


def up(orientation: np.ndarray) -> np.ndarray:
    """The upward direction in the body frame of a quaternion (w, x, y, z)."""
    w, x, y, z = orientation
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


def fly(name: str, count: int, within_limits: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Place and rates after each segment of 0.1 s, by the FMU and by DOP853."""
    vehicle, velocity, rates = VEHICLES[name], (1.0, 0.5, -0.2), (0.2, -0.1, 0.3)
    speed = vehicle.hover_speed
    start = initial_state([0, 0, 50], velocity, rates, speed, len(vehicle.rotors))
    states = simulate_flight(vehicle, start, count, pilot(vehicle, within_limits))
    initial = {"initial.position.z": 50.0, "initial_rotor_speed": speed}
    initial |= {
        f"initial.velocity_body.{axis}": value for axis, value in zip("uvw", velocity, strict=True)
    }
    initial |= {f"initial.rates.{axis}": value for axis, value in zip("pqr", rates, strict=True)}
    fmu, segment, found = PlantFmu(name, initial), pilot(vehicle, within_limits), []
    for k in range(count):
        seen = (
            fmu.vector("velocity"),
            up(fmu.vector("orientation", "wxyz")),
            fmu.vector("rates", "pqr"),
        )
        fmu.set(inputs(segment(k, *seen)))
        fmu.step(STEP, 10)
        found.append(np.concatenate([fmu.vector("position"), fmu.vector("rates", "pqr")]))
    return np.array(found), np.hstack([states[:, :3], states[:, 15:18] @ FLIP])


@pytest.mark.parametrize("name", VEHICLES)
def test_flight_with_all_effects(name: str, measured: MeasurementCheck) -> None:
    found, expected = fly(name, 100)
    error = np.linalg.norm(found[:, :3] - expected[:, :3], axis=1)
    turning = found[:, 3:] - expected[:, 3:]
    measured(
        "Crazyflie and survey hexacopter",
        "place in 10 s with all effects",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
        case=name,
    )
    measured(
        "Crazyflie and survey hexacopter",
        "rates in them",
        turning,
        0.0,
        "rad/s",
        "DOP853",
        within=1e-6,
        case=name,
    )
    assert np.ptp(expected[:, :3], axis=0).min() > 1  # it has gone somewhere in every direction


@pytest.mark.long
@pytest.mark.parametrize("name", VEHICLES)
def test_a_minute_within_the_limits(name: str, measured: MeasurementCheck) -> None:
    """Without saturated motors and the limit of the ground effect very near to the ground."""
    found, expected = fly(name, 600, within_limits=True)
    error = np.linalg.norm(found[:, :3] - expected[:, :3], axis=1)
    measured(
        "Crazyflie and survey hexacopter",
        "place in 60 s within the limits",
        error,
        0.0,
        "m",
        "DOP853",
        within=1e-6,
        case=name,
    )
