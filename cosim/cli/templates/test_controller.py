"""Test of the controller CONTROLLER in its scenario."""

from pathlib import Path

import cosim


def test_the_controller_meets_the_checks() -> None:
    result = cosim.run(Path(__file__).with_name("CONTROLLER.json"))
    assert all(check.passed for check in result.checks)
