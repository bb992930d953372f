"""Guidance, speed and heading control of the vessel: one FMU, three wired ones, or any one of the
three replaced alone.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cosim
from cosim.core import resources

ROOT = resources.root()
SYSTEM = ROOT / "scenarios/systems/strider_autopilot.json"
BLOCKS = {
    "guidance": "WaypointGuidance",
    "speed": "SpeedController",
    "heading": "HeadingController",
}

#: a heading controller of somebody else: proportional, damped by the measured yaw rate
RATE_DAMPED = """
from math import atan2, cos, pi, sin
from types import SimpleNamespace

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class RateDamped(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.vehicle = SimpleNamespace(
            attitude=SimpleNamespace(yaw=0.0), rates=SimpleNamespace(r=0.0)
        )
        self.heading_reference = self.rudder_angle = 0.0
        for name in ("vehicle.attitude.yaw", "vehicle.rates.r", "heading_reference"):
            self.register_variable(Real(name, causality=Fmi2Causality.input))
        self.register_variable(Real("rudder_angle", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        error = self.vehicle.attitude.yaw - self.heading_reference
        turn = error if abs(error) <= pi else atan2(sin(error), cos(error))
        rudder = 1.5 * turn + 0.8 * self.vehicle.rates.r
        self.rudder_angle = max(-0.6, min(0.6, rudder))
        return True
"""


#: a guidance of somebody else: a course and a speed, no waypoints
COURSE = """
from types import SimpleNamespace

from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Course(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.vehicle = SimpleNamespace(position=SimpleNamespace(x=0.0))
        self.heading_reference, self.speed_reference = 0.0, 0.6
        self.register_variable(Real("vehicle.position.x", causality=Fmi2Causality.input))
        for name in ("heading_reference", "speed_reference"):
            self.register_variable(Real(name, causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.heading_reference = 0.8 if self.vehicle.position.x > 3.0 else 0.0
        return True
"""


def nested(scenario: str, system: Path = SYSTEM) -> dict[str, Any]:
    """The vessel's component with the FMU exchanged for a nested system, and nothing else."""
    usv = json.loads((ROOT / f"scenarios/{scenario}.json").read_text())["components"]["usv"]
    assert usv.pop("fmu") == "../fmus/strider_autopilot.fmu"
    return {"/components/usv": {"system": str(system)} | usv}


def with_block(tmp_path: Path, block: str, source: dict[str, str]) -> Path:
    """The shipped system with one block from another source."""
    system = json.loads(SYSTEM.read_text())
    for component in system["components"].values():
        component["fmu"] = str((SYSTEM.parent / component["fmu"]).resolve())
    del system["components"][block]["fmu"]
    system["components"][block] |= source
    (tmp_path / "system.json").write_text(json.dumps(system))
    return tmp_path / "system.json"


def assert_same(found: Any, expected: Any) -> None:
    for name in expected:
        assert np.array_equal(found[name], expected[name], equal_nan=True), name


def test_demo1_flies_the_same_with_three_blocks() -> None:
    assert_same(cosim.run("demo1_box", nested("demo1_box")), cosim.run("demo1_box"))


@pytest.mark.parametrize("end_policy", [1, 2, 3])
def test_every_parameter_reaches_its_block(end_policy: int) -> None:
    parameters = {
        "usv.end_policy": end_policy,
        "usv.waypoint_count": 2,
        "usv.waypoint_x": [3.0, 8.0],
        "usv.waypoint_y": [-1.0, 1.5],
        "usv.acceptance_radius": 0.8,
        "usv.speed_command": 0.7,
        "usv.speed_P": 20.0,
        "usv.thrust_limit": 2.0,
        "usv.heading_P": 1.2,
        "usv.heading_D": 0.5,
        "usv.heading_N": 15.0,
        "usv.rudder_limit": 0.3,
    }
    one = cosim.run("free_flight", parameters)
    three = cosim.run("free_flight", nested("free_flight") | parameters)
    assert one["usv.finished"].any() == (end_policy != 2)
    assert abs(one["usv.rudder_angle"]).max() == 0.3
    assert_same(three, one)


@pytest.mark.parametrize("block", BLOCKS)
def test_one_block_in_another_language_changes_nothing(tmp_path: Path, block: str) -> None:
    name = Path(json.loads(SYSTEM.read_text())["components"][block]["fmu"]).stem
    expected = cosim.run("free_flight", stop_time=20)
    for source in (
        {"python": str(ROOT / f"controllers/python/{name}.py:{BLOCKS[block]}")},
        {"fmu": str(ROOT / f"fmus/python/{name}.fmu")},
        {"fmu": str(ROOT / f"fmus/fmi3/{name}.fmu")},
    ):
        changes = nested("free_flight", with_block(tmp_path, block, source))
        assert_same(cosim.run("free_flight", changes, stop_time=20), expected)


def test_another_heading_controller_sails_demo1(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(RATE_DAMPED)
    system = with_block(tmp_path, "heading", {"python": str(tmp_path / "own.py:RateDamped")})
    result = cosim.run("demo1_box", nested("demo1_box", system))
    assert all(outcome.passed for outcome in result.checks)
    assert not np.array_equal(
        result["usv.rudder_angle"], cosim.run("demo1_box")["usv.rudder_angle"]
    )


def test_another_guidance_needs_only_two_references(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(COURSE)
    usv = {
        "system": str(with_block(tmp_path, "guidance", {"python": str(tmp_path / "own.py:Course")}))
    }
    result = cosim.run("free_flight", {"/components/usv": usv})
    assert result["vessel.position.x"][-1] > 3.0
    assert result["vessel.attitude.yaw"][-1] == pytest.approx(0.8, abs=0.01)
    assert result["vessel.velocity_body.u"][-1] == pytest.approx(0.6, abs=0.01)
