"""Multirotors with rotor lag, drag, wind and ground effect against an independent implementation of their data sheets."""

from __future__ import annotations

import numpy as np
import pytest
from multirotor_reference import FLIP, VEHICLES, HeldInputs, InputFunction, Vehicle, initial_state, simulate_flight
from plant_fmu import PlantFmu
from plant_validation import MeasurementCheck

STEP = 0.01


def pilot(vehicle: Vehicle) -> InputFunction:
    """Every 0.1 s other commands, loads, wind and heights, now and then beyond the limits of the motors; torque and thrust that
    keep the vehicle, which is unstable, upright."""
    random, count = np.random.default_rng(3), len(vehicle.rotors)

    def segment(k: int, velocity: np.ndarray, up: np.ndarray, rates: np.ndarray) -> HeldInputs:
        upright = np.array([-up[1], up[0], 0.0])
        torque = vehicle.inertia @ (9 * upright - 6 * rates + random.standard_normal(3))
        climbing = np.clip(1 - 0.1 * velocity[2], 0.5, 1.5)
        command = vehicle.hover_speed * climbing * (1 + 0.002 * random.standard_normal(count))
        command += {40: vehicle.max_rotor_speed, 41: -2 * vehicle.max_rotor_speed}.get(k % 50, 0.0)
        force, wind = 0.2 * vehicle.mass * random.standard_normal(3), 2 * random.standard_normal(3)
        height = float(vehicle.radius * (0.3, 0.6, 1.5, 4.0, 1e4)[k % 5])
        return HeldInputs(0.1, command, force, torque, wind, height)

    return segment


def inputs(held: HeldInputs) -> dict[str, float]:
    """A segment as inputs of a plant FMU."""
    named = {f"rotor_speed[{number}]": value for number, value in enumerate(held.command, 1)}
    for name, vector in (("external_force", held.force), ("external_torque", held.torque), ("wind", held.wind)):
        named |= {f"{name}.{axis}": value for axis, value in zip("xyz", vector, strict=True)}
    return named | {"ground_distance": held.height}


def up(orientation: np.ndarray) -> np.ndarray:
    """The upward direction in the body frame of a quaternion (w, x, y, z)."""
    w, x, y, z = orientation
    return np.array([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


@pytest.mark.parametrize("name", VEHICLES)
def test_flight_with_all_effects(name: str, measured: MeasurementCheck) -> None:
    vehicle, velocity, rates = VEHICLES[name], (1.0, 0.5, -0.2), (0.2, -0.1, 0.3)
    speed = vehicle.hover_speed
    expected = simulate_flight(
        vehicle, initial_state([0, 0, 50], velocity, rates, speed, len(vehicle.rotors)), 100, pilot(vehicle)
    )
    initial = {"initial.position.z": 50.0, "initial_rotor_speed": speed}
    initial |= {f"initial.velocity_body.{axis}": value for axis, value in zip("uvw", velocity, strict=True)}
    initial |= {f"initial.rates.{axis}": value for axis, value in zip("pqr", rates, strict=True)}
    fmu, segment, found = PlantFmu(name, initial), pilot(vehicle), []
    for k in range(100):
        seen = fmu.vector("velocity"), up(fmu.vector("orientation", "wxyz")), fmu.vector("rates", "pqr")
        fmu.set(inputs(segment(k, *seen)))
        fmu.step(STEP, 10)
        found.append(np.concatenate([fmu.vector("position"), fmu.vector("rates", "pqr")]))
    error = np.linalg.norm(np.array(found)[:, :3] - expected[:, :3], axis=1)
    turning = np.array(found)[:, 3:] - expected[:, 15:18] @ FLIP
    measured(
        "Crazyflie and survey hexacopter", "place in 10 s with all effects", error, 0.0, "m", "DOP853", within=1e-6, case=name
    )
    measured("Crazyflie and survey hexacopter", "rates in them", turning, 0.0, "rad/s", "DOP853", within=1e-6, case=name)
    assert np.ptp(expected[:, :3], axis=0).min() > 1  # it has gone somewhere in every direction
