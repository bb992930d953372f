"""What the plant costs per step of 10 ms: one pair in calm and in weather, in flight and landed, and many pairs.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_plant_speed.py
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from time import process_time
from typing import Any

import numpy as np
import pytest
from cost_measurement import MedianCost, measure_rounds, print_heading, print_rows

from cosim.core.component import Ports
from cosim.engine.initialization import copy_start_values
from plant_src.physics.client import pybullet
from plant_src.world import World

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]

STEP = 0.01
VEHICLE_STEPS = 4000  # in one measurement, so many steps times pairs
PAIRS = (1, 2, 4, 8, 16, 32, 64)
APART = 20.0  # between pairs (m)
HOVER = 345.0  # rad/s
FLYING, LANDED = 5.0, 0.3249  # height of the quadcopter (m)
WEATHER = {"seed": 7, "sea_state": 3, "wind": {"speed": 5.0, "turbulence": {}}}
DRAG = {f"{part}_drag.{axis}": value for part, value in (("rotor", 5e-5), ("body", 0.02)) for axis in "xyz"}
#: what one pair may cost (us)
LIMITS = {
    "planar, in flight": 20.0,
    "planar, landed": 35.0,
    "6 DOF in weather, in flight": 60.0,
    "6 DOF in weather, landed": 60.0,
}


def pairs(count: int, height: float, **vessel: Any) -> dict[str, Any]:
    """Quadcopters above or on the decks of their vessels."""
    quadcopter = {"model": "ar_drone", "parameters": DRAG if vessel else {}}
    vehicles: dict[str, Any] = {}
    for k in range(count):
        x, y = APART * (k % 8), APART * (k // 8)
        vehicles[f"uav{k}"] = quadcopter | {"position": [x - 0.0135, y + 0.002, height]}
        vehicles[f"usv{k}"] = {"model": "strider", "position": [x, y], **vessel}
    return vehicles


class Bound:
    """A world as the engine steps it."""

    def __init__(self, vehicles: Mapping[str, Any], environment: Mapping[str, Any] | None = None, speed: float = 0.0):
        self.world = World("plant", vehicles, {}, environment)
        ports = [self._ports(causality) for causality in ("input", "output")]
        self.world.bind(*ports)
        self.world.enter_initialization_mode(0.0, 1e6)
        copy_start_values(self.world, ports[0])
        self.world.exit_initialization_mode()
        for name in vehicles:
            if name.startswith("uav"):
                self.world.set(f"{name}.rotor_speed", [speed] * 4)
        self.clock = ctypes.c_double(0.0)
        (self.call,) = self.world.prepare_step_calls(self.clock, STEP)

    def _ports(self, causality: str) -> Ports:
        variables = [variable for variable in self.world.variables if variable.causality == causality]
        dtypes = dict.fromkeys(variable.dtype for variable in variables)
        return Ports(
            variables,
            {dtype: np.zeros(sum(len(v.scalar_names) for v in variables if v.dtype == dtype), dtype) for dtype in dtypes},
        )

    def run(self, steps: int) -> float:
        """CPU microseconds per step."""
        function, arguments, clock = self.call.function, self.call.arguments, self.clock
        begun = process_time()
        for _ in range(steps):
            function(*arguments)
            clock.value += STEP
        return (process_time() - begun) / steps * 1e6


def flight(bound: Bound) -> Callable[[], float]:
    """Steps from the same moment of a flight in each round."""
    bound.run(20)
    state = bound.world.get_state()

    def cost() -> float:
        bound.world.set_state(state)
        bound.clock.value = 20 * STEP
        return bound.run(300)

    return cost


def landed(bound: Bound) -> Callable[[], float]:
    bound.run(200)
    assert bound.world.get("uav0.contact.vessel")
    return lambda: bound.run(300)


def test_one_pair() -> None:
    print_heading("one pair of quadcopter and vessel")
    six = {"motion": "6dof"}
    contenders = {
        "PyBullet alone, in flight": raw(1, FLYING),
        "PyBullet alone, landed": raw(1, LANDED),
        "planar, in flight": flight(Bound(pairs(1, FLYING), speed=HOVER)),
        "planar, landed": landed(Bound(pairs(1, LANDED))),
        "6 DOF in a calm, in flight": flight(Bound(pairs(1, FLYING, **six), {}, HOVER)),
        "6 DOF in weather, in flight": flight(Bound(pairs(1, FLYING, **six), WEATHER, HOVER)),
        "6 DOF in weather, landed": landed(Bound(pairs(1, LANDED, **six), WEATHER)),
    }
    rows = measure_rounds(contenders)
    print_rows("one pair", rows)
    for row in rows:
        if row.name in LIMITS:
            print(f"  {row.name}: {row.cost:.1f} us, at most {LIMITS[row.name]:g} us wanted on a machine of its own")
    ratios = {row.name: row.cost / rows[1].cost for row in rows}
    assert ratios["planar, in flight"] < 1 and ratios["planar, landed"] < 2.5 and ratios["6 DOF in weather, landed"] < 5


def raw(count: int, height: float) -> Callable[[], float]:
    """PyBullet alone with the same bodies: read every vehicle, push every vehicle, step, ask for contacts."""
    world = World("plant", pairs(count, height))
    client, bodies = world._client, world._fleet.bodies
    pybullet.setPhysicsEngineParameter(fixedTimeStep=STEP, physicsClientId=client)
    weight = 9.81 * 0.443892 if height == LANDED else 0.0
    upwards = {body.body_id: weight if body.model.is_vessel else -weight for body in bodies}

    def step() -> None:
        for body, force in upwards.items():
            position, _ = pybullet.getBasePositionAndOrientation(body, client)
            pybullet.getBaseVelocity(body, client)
            pybullet.applyExternalForce(body, -1, (0, 0, force), position, pybullet.WORLD_FRAME, client)
            pybullet.applyExternalTorque(body, -1, (0, 0, 0), pybullet.WORLD_FRAME, client)
        pybullet.stepSimulation(client)
        pybullet.getContactPoints(physicsClientId=client)

    def cost() -> float:
        assert world  # it keeps the client
        begun, steps = process_time(), max(20, VEHICLE_STEPS // count // 10)
        for _ in range(steps):
            step()
        return (process_time() - begun) / steps * 1e6

    return cost


def many(count: int, height: float) -> Callable[[], float]:
    bound = Bound(pairs(count, height), speed=HOVER if height == FLYING else 0.0)
    bound.run(20)
    return lambda: bound.run(max(20, VEHICLE_STEPS // count // 10))


@pytest.mark.parametrize("height", [FLYING, LANDED], ids=["in flight", "landed"])
def test_many_pairs(height: float) -> None:
    """Linear in the number of pairs."""
    print_heading(f"N planar pairs, {'in flight' if height == FLYING else 'landed'}")
    costs: dict[int, MedianCost] = {}
    for count in PAIRS:
        rows = measure_rounds({"PyBullet alone": raw(count, height), "plant": many(count, height)}, rounds=3)
        print_rows(f"pairs: {count}", rows)
        costs[count] = rows[1]
    per_pair = {count: row.cost / count for count, row in costs.items()}
    print("  us per pair: " + ", ".join(f"{count}: {cost:.1f}" for count, cost in per_pair.items()))
    assert per_pair[64] < 2 * per_pair[1]


def test_many_pairs_in_weather() -> None:
    """Six degrees of freedom, sea state 3, gusts."""
    print_heading("N pairs in weather, in flight")
    per_pair = {}
    for count in (1, 4, 16, 64):
        bound = Bound(pairs(count, FLYING, motion="6dof"), WEATHER, HOVER)
        bound.run(20)
        (row,) = measure_rounds({"plant": lambda b=bound, n=count: b.run(max(20, 400 // n))}, rounds=3)
        print_rows(f"pairs: {count}", [row])
        per_pair[count] = row.cost / count
    print("  us per pair: " + ", ".join(f"{count}: {cost:.1f}" for count, cost in per_pair.items()))
    assert per_pair[64] < 2 * per_pair[1]
