"""Test of the controller CONTROLLER in its scenario."""

from pathlib import Path

import cosim
from cosim.export.build import build_to

FOLDER = Path(__file__).parent


def test_the_controller_meets_the_checks() -> None:
    build_to(FOLDER / "modelDescription.xml", None, FOLDER / "CONTROLLER.fmu")
    result = cosim.run(FOLDER / "CONTROLLER.json")
    assert all(check.passed for check in result.checks)
