"""The world as an FMU gives the same results as the world, to the last bit."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
from plant_validation import MeasurementCheck
from world_harness import WorldHarness

import cosim
from cosim.export.build import build_to

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]
DEMO = ROOT / "scenarios/demo1_box.json"
ARGUMENTS = json.loads((ROOT / "plant_src/world_fmu.json").read_text())
AGAIN = "30 steps from platform, flight, touchdown and rest, repeated"
HOVER = 363.5
#: take-off from the platform, flight, motors off, touchdown, rest: (steps, rotor speed)
FLIGHT = ((10, 0.0), (40, 1.1 * HOVER), (30, HOVER), (100, 0.9 * HOVER), (60, 0.0))


@pytest.fixture(scope="module")
def fmu(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_to(
        ROOT / "plant_src/world_fmu.py", None, tmp_path_factory.mktemp("world") / "world.fmu"
    )


class Importer:
    """The FMU in FMPy, set by names and read as a whole."""

    def __init__(self, file: Path, folder: Path):
        description = read_model_description(file)
        self.references = {v.name: v.valueReference for v in description.modelVariables}
        outputs = [v for v in description.modelVariables if v.causality == "output"]
        self.names = [v.name for v in outputs if v.type == "Real"]
        self.flags = [v.name for v in outputs if v.type == "Boolean"]
        self.slave = FMU2Slave(
            guid=description.guid,
            unzipDirectory=extract(file, folder),
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName="plant",
        )
        self.slave.instantiate()
        self.slave.setupExperiment(startTime=0.0)
        self.slave.enterInitializationMode()
        self.slave.exitInitializationMode()
        self.steps = 0

    def step(self, speed: float) -> list[Any]:
        self.slave.setReal(
            [self.references[f"uav.rotor_speed[{k}]"] for k in (1, 2, 3, 4)], [speed] * 4
        )
        self.slave.setReal([self.references["usv.thrust"]], [1.0])
        self.slave.doStep(self.steps * 0.01, 0.01)
        self.steps += 1
        return self.values()

    def values(self) -> list[Any]:
        reals = self.slave.getReal([self.references[name] for name in self.names])
        flags = self.slave.getBoolean([self.references[name] for name in self.flags])
        return reals + [bool(value) for value in flags]


@pytest.fixture
def importer(fmu: Path, tmp_path: Path) -> Iterator[Importer]:
    made = Importer(fmu, tmp_path)
    yield made
    made.slave.terminate()
    made.slave.freeInstance()


def speeds() -> list[float]:
    return [speed for count, speed in FLIGHT for _ in range(count)]


def in_process(names: list[str]) -> Iterator[list[Any]]:
    """Return the outputs of the world itself on the same flight, initial values first."""
    trial = WorldHarness(**ARGUMENTS)
    trial["usv.thrust"] = 1.0
    yield [trial[name] for name in names]
    for speed in speeds():
        trial["uav.rotor_speed"] = [speed] * 4
        trial.step()
        yield [trial[name] for name in names]


def test_the_fmu_computes_what_the_world_does(
    importer: Importer, measured: MeasurementCheck
) -> None:
    names = importer.names + importer.flags
    expected = list(in_process(names))
    assert importer.values() == expected[0]
    differing = sum(
        importer.step(speed) != row for speed, row in zip(speeds(), expected[1:], strict=True)
    )
    measured(
        "World and plant FMUs",
        "differing steps of 240, world FMU in FMPy",
        differing,
        0,
        "1",
        "world in process",
    )
    height = np.array([row[names.index("uav.position.z")] for row in expected])
    touching = np.array([row[names.index("uav.contact.force")] for row in expected])
    assert height.max() > 1.0
    assert touching[-1] > 0
    assert (touching == 0).sum() > 100


@pytest.mark.parametrize("begun", [0, 60, 140, 152, 230])
def test_states_are_restored_bit_for_bit(
    importer: Importer, begun: int, measured: MeasurementCheck
) -> None:
    """On the platform, in flight, about touchdown, at rest."""
    plan = speeds()
    for speed in plan[:begun]:
        importer.step(speed)
    state, before = importer.slave.getFMUstate(), importer.values()
    expected = [importer.step(speed) for speed in plan[begun : begun + 30]]
    for _ in range(2):
        importer.slave.setFMUstate(state)
        importer.steps = begun
        assert importer.values() == before
        differing = sum(
            importer.step(speed) != row for speed, row in zip(plan[begun:], expected, strict=False)
        )
        measured(
            "World and plant FMUs",
            "steps that differ after a return, world FMU",
            differing,
            0,
            "1",
            AGAIN,
        )
    importer.slave.freeFMUstate(state)


def test_it_is_the_plant_of_demo1() -> None:
    assert json.loads(DEMO.read_text())["components"]["plant"]["arguments"] == ARGUMENTS


def test_demo1_lands_with_it(fmu: Path, tmp_path: Path) -> None:
    text = (
        DEMO.read_text()
        .replace('"../', f'"{ROOT}/')
        .replace('"systems/', f'"{ROOT}/scenarios/systems/')
    )
    demo = json.loads(text)
    for key in ("reference", "figures", "checks", "kpis", "seeds"):
        demo.pop(key)
    demo["components"]["plant"] = {"fmu": str(fmu)}
    (tmp_path / "demo.json").write_text(json.dumps(demo))
    ours, theirs = cosim.run(DEMO, stop_time=16), cosim.run(tmp_path / "demo.json", stop_time=16)
    assert ours["plant.uav.contact.vessel"][-1]
    for name in ours.signals("*"):
        assert np.array_equal(ours[name], theirs[name]), name


def test_another_world_can_be_chosen(tmp_path: Path) -> None:
    """The JSON file beside the source determines the variables."""
    shutil.copytree(
        ROOT / "plant_src", tmp_path / "plant_src", ignore=shutil.ignore_patterns("__pycache__")
    )
    other = {
        "vehicles": {"boat": {"model": "strider", "position": [0, 0]}},
        "environment": {"wind": {"speed": 2.0}},
    }
    (tmp_path / "plant_src/world_fmu.json").write_text(json.dumps(other))
    target = build_to(tmp_path / "plant_src/world_fmu.py", None, tmp_path / "boat.fmu")
    names = {v.name: v for v in read_model_description(target).modelVariables}
    assert float(names["environment.wind.x"].start) == 2.0
    assert names["boat.thrust"].unit == "N"
    assert "uav.rotor_speed[1]" not in names
