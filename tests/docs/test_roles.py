"""Reference of the roles: variables with units and meanings, and the settings of the shipped
scenarios.
"""

import importlib
import json
import re
from pathlib import Path

import pytest

from cosim.scenario.nested_systems import load_scenario
from cosim.studies.controller_bench.role import (
    OutputsSpec,
    VariableSpec,
    read_role,
    read_role_file,
    role_names,
)

ROOT = Path(__file__).parents[2]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.json"))


@pytest.fixture
def roles(monkeypatch):
    """Module that generates the page of the roles; MkDocs imports it from its own folder."""
    monkeypatch.syspath_prepend(ROOT / "docs/generator")
    return importlib.import_module("roles")


@pytest.mark.parametrize("name", role_names())
def test_every_single_variable_of_a_role_has_a_meaning(name):
    role = read_role_file(name)[1]
    for variable, source in (role.inputs | role.outputs | role.parameters).items():
        assert isinstance(source, OutputsSpec | VariableSpec), variable
        assert isinstance(source, OutputsSpec) or len(source.description) >= 8, variable


@pytest.mark.parametrize("name", role_names())
def test_a_role_names_everything_that_shipped_scenarios_set_or_connect(roles, name):
    role = read_role(name)
    known = [*role.inputs, *role.parameters]
    used = set().union(*(roles.settings_of(name, scenario) for scenario in SCENARIOS))
    assert used
    for each in used:
        pattern = re.compile(rf"{re.escape(each)}($|[.\[])")
        assert any(map(pattern.match, known)), each


def test_the_table_counts_the_scenarios_that_set_a_parameter(roles):
    """The names are in no other place of a scenario than the parameters of the controller."""
    texts = [json.dumps(load_scenario(path).root.document.value) for path in SCENARIOS]
    lines = roles.parameter_table(
        "uav_controller", read_role_file("uav_controller")[1].parameters
    ).splitlines()
    for parameter, start in {
        "vtol.take_off_time": "0",
        "vtol.ramp_time": "0.3",
        "vtol.clearance": "0.4",
    }.items():
        count = sum(f'"{parameter}"' in text for text in texts)
        cells = next(line for line in lines if line.startswith(f"| `{parameter}` |")).split(" | ")
        assert count
        assert cells[1:5] == [
            "Real",
            "m" if parameter == "vtol.clearance" else "s",
            start,
            str(count),
        ]
    assert any(line.startswith("| `vtol.landing_enabled` | Boolean |  | true |") for line in lines)
