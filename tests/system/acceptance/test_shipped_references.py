"""The references that are shipped: small, met by a run here, and not met by another flight."""

import json

import pytest

import cosim
from cosim.core import resources
from cosim.results import Result
from cosim.results.comparison import Tolerance, compare

FOLDER = resources.root() / "scenarios"
REFERENCES = sorted(path for path in FOLDER.glob("*.json") if "reference" in json.loads(path.read_text()))

ANOTHER_ALTITUDE = {
    "crazyflie_square": {"uav.mass": 0.03},
    "fleet_survey": {"uav1.altitude_command": 2.1},
    "rov_inspection": {"/components/plant/arguments/vehicles/rov/position/2": -0.4},
}


def compared(path, parameters=None):
    spec = json.loads(path.read_text())["reference"]
    tolerances = {pattern: Tolerance(**tolerance) for pattern, tolerance in spec["tolerances"].items()}
    return compare(cosim.run(path, parameters), Result.from_csv(FOLDER / spec["file"]), tolerances)


def test_there_are_references():
    assert {"demo1_box", "vtol_moving_deck", "free_flight"} <= {path.stem for path in REFERENCES}


@pytest.mark.parametrize("path", REFERENCES, ids=lambda path: path.stem)
def test_a_run_meets_its_reference(path):
    comparison = compared(path)
    assert comparison.passed, str(comparison)


@pytest.mark.parametrize("path", REFERENCES, ids=lambda path: path.stem)
def test_half_the_step_size_meets_it_too(path):
    """Other machines round differently: that is less than this."""
    comparison = compared(path, {"/step_size": 0.005})
    assert comparison.passed, str(comparison)


@pytest.mark.parametrize("path", REFERENCES, ids=lambda path: path.stem)
def test_another_altitude_does_not(path):
    change = ANOTHER_ALTITUDE.get(path.stem, {"uav.altitude_command": 2.1})
    failed = [verdict.signal for verdict in compared(path, change).failures]
    assert any(name.endswith("position.z") for name in failed)


@pytest.mark.parametrize("path", REFERENCES, ids=lambda path: path.stem)
def test_references_are_small_and_say_what_made_them(path):
    reference = FOLDER / json.loads(path.read_text())["reference"]["file"]
    assert reference.stat().st_size < 200_000
    made_by = json.loads(reference.with_suffix(".json").read_text())
    assert made_by["name"] == path.stem
    assert set(made_by["versions"]) >= {"cosim", "python", "numpy", "pybullet"}
    assert path.name in made_by["sha256"]
