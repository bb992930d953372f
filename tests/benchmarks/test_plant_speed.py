"""Cost of the plant per step of 10 ms: one pair in calm and in weather, in flight and landed, and
many pairs.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_plant_speed.py
"""

from __future__ import annotations

import ctypes
from collections import Counter
from collections.abc import Callable, Mapping
from time import process_time
from typing import Any

import numpy as np
import pytest
from cost_measurement import MedianCost, measure_rounds, print_heading, print_rows

from cosim.core.component import Ports
from cosim.engine.initialization import copy_start_values
from plant_src.physics.bullet import pybullet
from plant_src.world import World

pytestmark = [pytest.mark.benchmark, pytest.mark.timeout(1800)]

STEP = 0.01
VEHICLE_STEPS = 4000  # steps times pairs, per measurement
PAIRS = (1, 2, 4, 8, 16, 32, 64)
SPACING = 20.0  # between pairs (m)
HOVER = 364.0  # rad/s
FLYING, LANDED = 5.0, 0.3249  # height of the quadcopter (m)
ABOVE_WAVES = 0.55  # from which it drops onto a deck in waves (m)
WEATHER = {"seed": 7, "sea_state": 3, "wind": {"speed": 5.0, "turbulence": {}}}
DRAG = {
    **dict.fromkeys((f"rotor_drag.{axis}" for axis in "xyz"), 5e-5),
    **dict.fromkeys((f"body_drag.{axis}" for axis in "xyz"), 0.02),
}
#: largest cost of one pair per step (us) on an idle machine
LIMITS = {
    "planar, in flight": 20.0,
    "planar, landed": 35.0,
    "6 DOF in weather, in flight": 60.0,
    "6 DOF in weather, landed": 60.0,
}


def pairs(count: int, height: float, **vessel: Any) -> dict[str, Any]:
    """Return vehicles: quadcopters above or on the decks of their vessels."""
    quadcopter = {"model": "ar_drone", "parameters": DRAG if vessel else {}}
    vehicles: dict[str, Any] = {}
    for k in range(count):
        x, y = SPACING * (k % 8), SPACING * (k // 8)
        vehicles[f"uav{k}"] = quadcopter | {"position": [x - 0.0135, y + 0.002, height]}
        vehicles[f"usv{k}"] = {"model": "strider", "position": [x, y], **vessel}
    return vehicles


class BoundWorld:
    """A world that is bound to arrays and stepped like by the engine."""

    def __init__(
        self,
        vehicles: Mapping[str, Any],
        environment: Mapping[str, Any] | None = None,
        speed: float = 0.0,
    ):
        self.world = World("plant", vehicles, {}, environment)
        ports = [self._ports(causality) for causality in ("input", "output")]
        self.world.bind(*ports)
        self.world.enter_initialization_mode(0.0, 1e6)
        copy_start_values(self.world, ports[0])
        self.world.exit_initialization_mode()
        for name in vehicles:
            if name.startswith("uav"):
                self.world.set(f"{name}.rotor_speed", [speed] * 4)
        self.current_time = ctypes.c_double(0.0)
        (self.call,) = self.world.prepare_step_calls(self.current_time, STEP)

    def _ports(self, causality: str) -> Ports:
        variables = [
            variable for variable in self.world.variables if variable.causality == causality
        ]
        sizes: Counter[np.dtype[Any]] = Counter()
        for variable in variables:
            sizes[variable.dtype] += len(variable.scalar_names)
        return Ports(variables, {dtype: np.zeros(size, dtype) for dtype, size in sizes.items()})

    def run(self, steps: int) -> float:
        """Return the CPU time (us) per step."""
        function, arguments, current_time = (
            self.call.function,
            self.call.arguments,
            self.current_time,
        )
        start = process_time()
        for _ in range(steps):
            function(*arguments)
            current_time.value += STEP
        return (process_time() - start) / steps * 1e6


def flight(bound: BoundWorld) -> Callable[[], float]:
    """Return a cost that starts at the same moment of a flight in each round."""
    bound.run(20)
    state = bound.world.get_state()

    def cost() -> float:
        bound.world.set_state(state)
        bound.current_time.value = 20 * STEP
        return bound.run(300)

    return cost


def landed(bound: BoundWorld) -> Callable[[], float]:
    bound.run(200)
    assert bound.world.get("uav0.contact.vessel")
    return lambda: bound.run(300)


def test_one_pair() -> None:
    print_heading("one pair of quadcopter and vessel")
    six = {"motion": "6dof"}
    contenders = {
        "PyBullet alone, in flight": raw(1, FLYING),
        "PyBullet alone, landed": raw(1, LANDED),
        "planar, in flight": flight(BoundWorld(pairs(1, FLYING), speed=HOVER)),
        "planar, landed": landed(BoundWorld(pairs(1, LANDED))),
        "6 DOF in a calm, in flight": flight(BoundWorld(pairs(1, FLYING, **six), {}, HOVER)),
        "6 DOF in weather, in flight": flight(BoundWorld(pairs(1, FLYING, **six), WEATHER, HOVER)),
        "6 DOF in weather, landed": landed(BoundWorld(pairs(1, LANDED, **six), WEATHER)),
    }
    rows = measure_rounds(contenders)
    print_rows("one pair", rows)
    for row in rows:
        if row.name in LIMITS:
            print(
                f"  {row.name}: {row.cost:.1f} us, limit on an idle machine {LIMITS[row.name]:g} us"
            )
    ratios = {row.name: row.cost / rows[1].cost for row in rows}
    assert ratios["planar, in flight"] < 1
    assert ratios["planar, landed"] < 2.5
    assert ratios["6 DOF in weather, landed"] < 5


def raw(count: int, height: float) -> Callable[[], float]:
    """Return the cost of PyBullet with the same bodies: read and push every vehicle, step, get
    contacts.
    """
    world = World("plant", pairs(count, height))
    client, bodies = world._client, world._fleet.bodies
    pybullet.setPhysicsEngineParameter(fixedTimeStep=STEP, physicsClientId=client)
    weight = 9.81 * 0.443892 if height == LANDED else 0.0
    upward_forces = {body.body_id: weight if body.model.is_vessel else -weight for body in bodies}

    def step() -> None:
        for body, force in upward_forces.items():
            position, _ = pybullet.getBasePositionAndOrientation(body, client)
            pybullet.getBaseVelocity(body, client)
            pybullet.applyExternalForce(
                body, -1, (0, 0, force), position, pybullet.WORLD_FRAME, client
            )
            pybullet.applyExternalTorque(body, -1, (0, 0, 0), pybullet.WORLD_FRAME, client)
        pybullet.stepSimulation(client)
        pybullet.getContactPoints(physicsClientId=client)

    def cost() -> float:
        assert world  # keeps the client alive
        start, steps = process_time(), max(20, VEHICLE_STEPS // count // 10)
        for _ in range(steps):
            step()
        return (process_time() - start) / steps * 1e6

    return cost


def many(count: int, height: float) -> Callable[[], float]:
    bound = BoundWorld(pairs(count, height), speed=HOVER if height == FLYING else 0.0)
    bound.run(20)
    return lambda: bound.run(max(20, VEHICLE_STEPS // count // 10))


@pytest.mark.parametrize("height", [FLYING, LANDED], ids=["in flight", "landed"])
def test_many_pairs(height: float) -> None:
    """The cost is linear in the number of pairs."""
    print_heading(f"N planar pairs, {'in flight' if height == FLYING else 'landed'}")
    costs: dict[int, MedianCost] = {}
    for count in PAIRS:
        rows = measure_rounds(
            {"PyBullet alone": raw(count, height), "plant": many(count, height)}, rounds=3
        )
        print_rows(f"pairs: {count}", rows)
        costs[count] = rows[1]
    per_pair = {count: row.cost / count for count, row in costs.items()}
    print("  us per pair: " + ", ".join(f"{count}: {cost:.1f}" for count, cost in per_pair.items()))
    assert per_pair[64] < 2 * per_pair[1]


def test_many_pairs_in_weather() -> None:
    """The cost is linear with six degrees of freedom, sea state 3 and gusts."""
    print_heading("N pairs in weather, in flight")
    per_pair = {}
    for count in (1, 4, 16, 64):
        bound = BoundWorld(pairs(count, FLYING, motion="6dof"), WEATHER, HOVER)
        bound.run(20)
        (row,) = measure_rounds(
            {"plant": lambda b=bound, n=count: b.run(max(20, 400 // n))}, rounds=3
        )
        print_rows(f"pairs: {count}", [row])
        per_pair[count] = row.cost / count
    print("  us per pair: " + ", ".join(f"{count}: {cost:.1f}" for count, cost in per_pair.items()))
    assert per_pair[64] < 2 * per_pair[1]


def test_fifty_vehicles() -> None:
    """25 pairs in one world, as ratio to real time."""
    print_heading("50 vehicles in one world")
    six = {"motion": "6dof"}
    worlds = {
        "planar, in flight": BoundWorld(pairs(25, FLYING), speed=HOVER),
        "planar, landed": BoundWorld(pairs(25, LANDED)),
        "6 DOF in weather, in flight": BoundWorld(pairs(25, FLYING, **six), WEATHER, HOVER),
        "6 DOF in weather, landed": BoundWorld(pairs(25, ABOVE_WAVES, **six), WEATHER),
    }
    for name, bound in worlds.items():
        bound.run(250 if "landed" in name else 20)
    assert (
        sum(
            worlds["6 DOF in weather, landed"].world.get(f"uav{k}.contact.vessel")
            for k in range(25)
        )
        > 20
    )
    rows = measure_rounds({name: lambda b=bound: b.run(40) for name, bound in worlds.items()})
    print_rows("25 pairs", rows)
    for row in rows:
        print(f"  {row.name}: {STEP * 1e6 / row.cost:.1f} times real time")
