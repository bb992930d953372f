"""The shipped roles, and scenarios with controllers in other controllers' places."""

import json

import pytest

from cosim import resources
from cosim.bench.candidate import interface, problems, source
from cosim.bench.role import read_role, roles
from cosim.bench.score import Scores, rows, senses, verdict
from cosim.bench.transplant import Transplant
from cosim.scenario import assemble

ROOT = resources.root()
SCENARIOS = {"uav_inverse_kinematics": "demo3_inverse_kinematics"}
BARE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Bare(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        for i in range(1, 5):
            self.register_variable(Real(f"rotor_speed[{i}]", causality=Fmi2Causality.output, getter=lambda: 0.0))

    def do_step(self, current_time, step_size):
        return True
"""


@pytest.mark.parametrize("name", roles())
def test_every_shipped_controller_of_a_role_fits_it(name):
    role = read_role(name)
    assert role.controllers
    for path in role.controllers:
        assert problems(role, interface(source(str(path)))) == [], path


@pytest.mark.parametrize("name", roles())
def test_it_can_be_put_back_into_a_scenario(name, tmp_path):
    """performance_5 holds its controllers inside a system inside a system."""
    role = read_role(name)
    candidate = source(str(min(role.controllers)))
    transplant = Transplant(role, candidate, interface(candidate), tmp_path)
    path = transplant.scenario(ROOT / f"scenarios/{SCENARIOS.get(name, 'performance_5')}.json")
    assert path and len(transplant.places) == 1
    assembly = assemble(path)
    try:
        place = transplant.places[0]
        assert any(component == place or component.startswith(f"{place}.") for component in assembly.system.components)
        assert str(min(role.controllers)) in {str(file) for file in assembly.files().values()}
    finally:
        assembly.free()


def test_a_scenario_without_the_role_is_left_alone(tmp_path):
    role = read_role("usv_autopilot")
    candidate = source(str(min(role.controllers)))
    transplant = Transplant(role, candidate, interface(candidate), tmp_path)
    assert transplant.scenario(ROOT / "scenarios/demo3_inverse_kinematics.json") is None
    assert list(tmp_path.iterdir()) == []


def test_ports_that_lead_nowhere_disappear_with_what_sets_them(tmp_path):
    """The cascade as one FMU shows no port `landing_time`: it is a parameter of the nested system around it."""
    keeper = tmp_path / "bare.py"
    keeper.write_text(BARE)
    candidate = source(f"{keeper}:Bare")
    transplant = Transplant(read_role("uav_controller"), candidate, interface(candidate), tmp_path / "out")
    path = transplant.scenario(ROOT / "scenarios/performance_5.json")
    assert path is not None
    written = json.loads(path.read_text())
    assert written["components"]["demo1"]["parameters"] == {}
    nested = json.loads((tmp_path / "out/systems/demo1.json").read_text())
    assert nested["ports"] == {"parameters": {}}
    assert nested["components"]["uav"]["python"] == f"{keeper}:Bare"
    assert {each["to"].split(".")[0] for each in nested["connections"]} == {"plant", "usv"}
    assemble(path).free()


@pytest.mark.parametrize(
    ("value", "other", "sense", "expected"),
    [
        (1.0, 2.0, "lower", "better"),
        (1.0, 2.0, "higher", "worse"),
        (2.0, 1.0, "lower", "worse"),
        (1.0, 1.009, "lower", ""),
        (-1.0, 1.0, "lower", "better"),
        (True, False, "higher", "better"),
        (float("nan"), 1.0, "lower", "worse"),
        (1.0, float("nan"), "higher", "better"),
        (float("nan"), float("nan"), "lower", ""),
        (1.0, 2.0, None, ""),
        (1.0, None, "lower", ""),
        (0.0, 0.0, "lower", ""),
    ],
)
def test_verdicts(value, other, sense, expected):
    assert verdict(value, other, sense) == expected


def test_checks_say_what_is_better_where_the_function_does_not():
    checks = [
        {"kpi": "a.v", "max": 1},
        {"kpi": "b.v", "min": 1},
        {"kpi": "c.v", "min": 0, "max": 1},
        {"kpi": "d.v", "equals": True},
    ]
    assert senses({"b.v": "lower"}, checks) == {"a.v": "lower", "b.v": "lower", "d.v": "higher"}


def test_kpis_that_others_lack_are_shown_without_a_verdict():
    candidate = Scores({"a.v": 1.0, "b.v": 2.0}, {"a.v": "m"}, {"a.v": "lower", "b.v": "lower"})
    first, second = rows(candidate, Scores({"a.v": 0.5}, {}, {}), None, [])
    assert (first.unit, first.shipped, first.against_shipped, first.last) == ("m", 0.5, "worse", None)
    assert (second.shipped, second.against_shipped) == (None, "")
