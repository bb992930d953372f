"""A file for another command is refused in one line that names this command."""

from __future__ import annotations

import pytest

from cosim.core import resources
from cosim.core.errors import InputError
from cosim.scenario.nested_systems import load_scenario


@pytest.mark.parametrize(
    ("name", "command"),
    [
        ("demo1_landing", "sweep"),
        ("strider_heading_gains", "tune"),
        ("landing_worst_case", "tune --worst"),
    ],
)
def test_a_study_is_no_scenario(name: str, command: str) -> None:
    with pytest.raises(
        InputError, match=rf"scenario: expected a scenario, found a file for `cosim {command}`"
    ) as caught:
        load_scenario(resources.root() / f"scenarios/sweeps/{name}.json")
    assert len(caught.value.problems) == 1
