"""Multirotors with rotor lag, drag, wind and ground effect fly as an independent integration of their data sheets says."""

from __future__ import annotations

import numpy as np
import pytest
from multirotor_reference import FLIP, VEHICLES, Held, Pilot, Vehicle, fly, start
from plant_fmu import PlantFmu

STEP = 0.01


def pilot(vehicle: Vehicle) -> Pilot:
    """Every 0.1 s other commands, loads, wind and heights, now and then beyond the limits of the motors; torques and thrust that
    keep the vehicle from tumbling and falling."""
    random, count = np.random.default_rng(3), len(vehicle.rotors)

    def segment(k: int, state: np.ndarray) -> Held:
        velocity, tilt, rates = state[3:6], FLIP @ state[12:15] @ FLIP, FLIP @ state[15:18]
        upright = np.array([-tilt[1], tilt[0], 0.0])
        torque = vehicle.inertia @ (9 * upright - 6 * rates + random.standard_normal(3))
        climbing = np.clip(1 - 0.1 * velocity[2], 0.5, 1.5)
        command = vehicle.hover_speed * climbing * (1 + 0.002 * random.standard_normal(count))
        command += {10: vehicle.limit, 11: -2 * vehicle.limit}.get(k % 25, 0.0)
        force, wind = 0.2 * vehicle.mass * random.standard_normal(3), 2 * random.standard_normal(3)
        height = float(vehicle.radius * (0.3, 0.6, 1.5, 4.0, 1e4)[k % 5])
        return Held(0.1, command, force, torque, wind, height)

    return segment


def inputs(held: Held) -> dict[str, float]:
    """A segment as inputs of a plant FMU."""
    named = {f"rotor_speed[{number}]": value for number, value in enumerate(held.command, 1)}
    for name, vector in (("external_force", held.force), ("external_torque", held.torque), ("wind", held.wind)):
        named |= {f"{name}.{axis}": value for axis, value in zip("xyz", vector, strict=True)}
    return named | {"ground_distance": held.height}


@pytest.mark.parametrize("name", VEHICLES)
def test_flight_with_all_effects(name: str) -> None:
    vehicle, rates = VEHICLES[name], {"p": 0.2, "q": -0.1, "r": 0.3}
    speed, velocity = vehicle.hover_speed, {"u": 1.0, "v": 0.5, "w": -0.2}
    state = start([0, 0, 50], [*velocity.values()], [*rates.values()], speed, len(vehicle.rotors))
    acted, expected = fly(vehicle, state, 100, pilot(vehicle))
    initial = {f"velocity_body.{axis}": value for axis, value in velocity.items()} | {"position.z": 50.0}
    initial |= {f"rates.{axis}": value for axis, value in rates.items()}
    fmu = PlantFmu(name, {f"initial.{key}": value for key, value in initial.items()} | {"initial_rotor_speed": speed})
    found = []
    for held in acted:
        fmu.set(inputs(held))
        fmu.step(STEP, 10)
        found.append(np.concatenate([fmu.vector("position"), fmu.vector("rates", "pqr")]))
    assert np.linalg.norm(np.array(found)[:, :3] - expected[:, :3], axis=1).max() < 1e-6
    assert np.abs(np.array(found)[:, 3:] - expected[:, 15:18] @ FLIP).max() < 1e-6
    assert np.ptp(expected[:, :3], axis=0).min() > 1  # it has gone somewhere in every direction
