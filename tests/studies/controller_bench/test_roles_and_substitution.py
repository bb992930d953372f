"""Shipped roles, and scenarios in which a candidate replaces a controller."""

import json
from contextlib import nullcontext
from hashlib import sha256
from itertools import product

import pytest

from cosim import __version__
from cosim.core import resources
from cosim.core.component import Variable
from cosim.core.errors import InputError
from cosim.scenario import PreparedRun, load
from cosim.studies.controller_bench import candidate
from cosim.studies.controller_bench.candidate import (
    CandidateInterface,
    interface_problems,
    parse_source,
    read_interface,
)
from cosim.studies.controller_bench.ranking import (
    RunKpis,
    ScenarioKpis,
    compare_kpis,
    compare_values,
    is_current,
    merge_senses,
    rank,
)
from cosim.studies.controller_bench.role import read_role, read_role_file, role_names
from cosim.studies.controller_bench.substitution import ControllerSubstitution

ROOT = resources.root()
SCENARIOS = {
    "uav_inverse_kinematics": "demo3_inverse_kinematics",
    "usv_station_keeping": "station_keeping",
}
BARE = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Bare(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        for i in range(1, 5):
            name = f"rotor_speed[{i}]"
            rotor = Real(name, causality=Fmi2Causality.output, getter=lambda: 0.0)
            self.register_variable(rotor)

    def do_step(self, current_time, step_size):
        return True
"""


@pytest.mark.parametrize("name", role_names())
def test_every_shipped_controller_of_a_role_fits_it(name):
    role = read_role(name)
    assert role.controllers
    for path in role.controllers:
        assert interface_problems(role, read_interface(parse_source(str(path)))) == [], path


def write(substitution, folder):
    """Write the changed scenario and its nested systems; return the path of the scenario."""
    path = substitution.substitute(folder)
    substitution.write_files()
    return path


@pytest.mark.parametrize("name", role_names())
def test_a_shipped_controller_can_replace_itself_in_a_scenario(name, tmp_path):
    """The controllers of performance_5 are in nested systems of two levels."""
    role = read_role(name)
    candidate = parse_source(str(min(role.controllers)))
    scenario = ROOT / f"scenarios/{SCENARIOS.get(name, 'performance_5')}.json"
    substitution = ControllerSubstitution(role, candidate, read_interface(candidate), scenario)
    path = write(substitution, tmp_path)
    assert path
    assert len(substitution.replaced_components) == 1
    prepared = load(path)
    try:
        place = next(iter(substitution.replaced_components))
        assert any(
            component == place or component.startswith(f"{place}.")
            for component in prepared.system.components
        )
        assert str(min(role.controllers)) in {str(file) for file in prepared.files().values()}
    finally:
        prepared.free()


def test_a_controller_with_only_the_variables_of_the_role_is_accepted_for_a_fleet(tmp_path):
    (tmp_path / "bare.py").write_text(BARE)
    candidate = parse_source(f"{tmp_path / 'bare.py'}:Bare")
    scenario = ROOT / "scenarios/fleet_survey.json"
    path = write(
        ControllerSubstitution(
            read_role("uav_controller"), candidate, read_interface(candidate), scenario
        ),
        tmp_path / "new",
    )
    load(path).free()


def test_a_scenario_without_the_role_is_not_written(tmp_path):
    role = read_role("vessel_autopilot")
    candidate = parse_source(str(min(role.controllers)))
    scenario = ROOT / "scenarios/demo3_inverse_kinematics.json"
    assert (
        write(
            ControllerSubstitution(role, candidate, read_interface(candidate), scenario), tmp_path
        )
        is None
    )
    assert list(tmp_path.iterdir()) == []


def test_other_json_is_skipped_and_an_invalid_scenario_is_refused(tmp_path):
    role = read_role("vessel_autopilot")
    candidate = parse_source(str(min(role.controllers)))
    shape = read_interface(candidate)
    (tmp_path / "data.json").write_text('{"checks": []}')
    assert (
        write(
            ControllerSubstitution(role, candidate, shape, tmp_path / "data.json"), tmp_path / "out"
        )
        is None
    )
    (tmp_path / "bad.json").write_text('{"name": "bad", "components": {"a": {"fmu": 5}}}')
    with pytest.raises(InputError, match=r"bad.json:1:.*components.a.fmu"):
        write(
            ControllerSubstitution(role, candidate, shape, tmp_path / "bad.json"), tmp_path / "out"
        )


def test_settings_are_listed_with_the_names_of_the_candidate(tmp_path):
    """The scenario sets the port `landing_time` of a nested system; the candidate declares it
    without the prefix of the role.
    """
    declared = (
        'Real("landing_time", causality=Fmi2Causality.parameter, variability="tunable", start=8.0)'
    )
    lander = BARE.replace(
        "        for i in",
        (
            f"        self.landing_time = 8.0\n        self.register_variable({declared})\n        "
            "for i in"
        ),
    )
    (tmp_path / "bare.py").write_text(
        lander.replace('variability="tunable"', "variability=Fmi2Variability.tunable").replace(
            "Slave,", "Slave, Fmi2Variability,"
        )
    )
    candidate = parse_source(f"{tmp_path / 'bare.py'}:Bare")
    scenario = ROOT / "scenarios/performance_5.json"
    substitution = ControllerSubstitution(
        read_role("uav_controller"), candidate, read_interface(candidate), scenario
    )
    path = write(substitution, tmp_path / "out")
    assert path is not None
    given = json.loads(scenario.read_text())["components"]["demo1"]["parameters"]["landing_time"]
    (settings,) = substitution.applied_settings.values()
    assert settings["landing_time"] == given


def test_ports_without_a_target_are_removed_with_their_settings(tmp_path):
    """The candidate has no parameter `landing_time`, which is a port of the nested system around
    it.
    """
    keeper = tmp_path / "bare.py"
    keeper.write_text(BARE)
    candidate = parse_source(f"{keeper}:Bare")
    scenario = ROOT / "scenarios/performance_5.json"
    substitution = ControllerSubstitution(
        read_role("uav_controller"), candidate, read_interface(candidate), scenario
    )
    path = write(substitution, tmp_path / "out")
    assert path is not None
    assert ("demo1.landing_time", "vtol.landing_time") in {
        (each.variable, each.lacking) for each in substitution.omissions
    }
    written = json.loads(path.read_text())
    assert written["components"]["demo1"]["parameters"] == {}
    nested = json.loads((tmp_path / "out/systems/performance_5.demo1.json").read_text())
    assert nested["ports"] == {"parameters": {}}
    assert nested["components"]["uav"]["python"] == f"{keeper}:Bare"
    assert {each["to"].split(".")[0] for each in nested["connections"]} == {"plant", "usv"}
    load(path).free()


def test_a_parameter_of_the_role_may_be_declared_without_its_prefix(tmp_path):
    """A scenario sets it in the controller, through a port of its system, or not at all."""
    role, candidate = (
        read_role("uav_controller"),
        parse_source(str(min(read_role("uav_controller").controllers))),
    )
    shape = candidate_of(outputs=role.outputs, parameters=["landing_time"])
    demo1, performance_5 = (
        write(
            ControllerSubstitution(role, candidate, shape, ROOT / f"scenarios/{name}.json"),
            tmp_path / name,
        )
        for name in ("demo1_box", "performance_5")
    )
    assert json.loads(demo1.read_text())["components"]["uav"]["parameters"] == {"landing_time": 5.0}
    assert json.loads(performance_5.read_text())["components"]["demo1"]["parameters"] == {
        "landing_time": 5.0
    }
    nested = json.loads((tmp_path / "performance_5/systems/performance_5.demo1.json").read_text())
    assert nested["ports"] == {"parameters": {"landing_time": "uav.landing_time"}}


@pytest.mark.parametrize(
    "name", ["uav_controller", "uav_path_command", "usv_guidance", "vessel_autopilot"]
)
def test_start_values_units_and_types_of_a_roles_parameters_are_those_of_a_shipped_controller(name):
    role = read_role_file(name)[1]
    shipped = [
        read_interface(parse_source(str(path))).parameters
        for path in read_role(name).different_controllers
    ]
    types = {"Float64": "Real", "Int32": "Integer", "Boolean": "Boolean"}
    for parameter, spec in role.parameters.items():
        keys = product(shipped, (parameter, f"{parameter}[1]"))
        found = next(each[key] for each, key in keys if key in each)
        assert (types[found.type], found.start, found.unit.name if found.unit else "") == (
            spec.type,
            spec.start,
            spec.unit,
        )


def test_changed_systems_of_different_scenarios_are_separate_files(tmp_path):
    """Both have a position controller in a nested system `uav`, with different parameters."""
    candidate = parse_source(str(ROOT / "fmus/python/position_controller.fmu"))
    shape, role = read_interface(candidate), read_role("uav_position")
    systems = []
    for name in ("demo1_box", "demo2_sweep"):
        path = write(
            ControllerSubstitution(role, candidate, shape, ROOT / f"scenarios/{name}.json"),
            tmp_path,
        )
        assert path is not None
        systems.append(json.loads(path.read_text())["components"]["uav"]["system"])
    assert systems[0] != systems[1]


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
def test_a_value_is_better_worse_or_equal(value, other, sense, expected):
    assert compare_values(value, other, sense) == expected


def test_checks_define_the_sense_of_a_kpi_that_its_function_does_not_declare():
    checks = [
        {"kpi": "a.v", "max": 1},
        {"kpi": "b.v", "min": 1},
        {"kpi": "c.v", "min": 0, "max": 1},
        {"kpi": "d.v", "equals": True},
    ]
    assert merge_senses({"b.v": "lower"}, checks) == {
        "a.v": "lower",
        "b.v": "lower",
        "d.v": "higher",
    }


def test_a_kpi_that_other_runs_lack_has_no_verdict():
    candidate = RunKpis({"a.v": 1.0, "b.v": 2.0}, {"a.v": "m"}, {"a.v": "lower", "b.v": "lower"})
    first, second = compare_kpis(candidate, RunKpis({"a.v": 0.5}, {}, {}), None, [])
    assert (first.unit, first.shipped, first.against_shipped, first.last) == (
        "m",
        0.5,
        "worse",
        None,
    )
    assert (second.shipped, second.against_shipped) == (None, "")


@pytest.mark.parametrize(
    ("time", "other", "verdict"), [(8.0, 9.0, "above"), (9.0, 9.0, "equal"), (9.0, 8.0, "below")]
)
def test_a_single_goal_decides_between_controllers_that_meet_the_same_checks(time, other, verdict):
    candidate, shipped = (
        RunKpis({"landing.time": value, "landing.error": 0.1}, {}, {"landing.time": "lower"})
        for value in (time, other)
    )
    checks = [{"kpi": "landing.error", "max": 0.2}]
    ranking = rank([ScenarioKpis(candidate, shipped, checks)], ["landing.*"])
    assert ranking.verdict == verdict


def test_a_run_is_current_until_a_file_of_it_changes(tmp_path):
    scenario, part = tmp_path / "sail.json", tmp_path / "part.json"
    for file in (scenario, part):
        file.write_text(file.name)
    digests = {file.name: sha256(file.read_bytes()).hexdigest() for file in (scenario, part)}
    (tmp_path / "run.json").write_text(
        json.dumps({"sha256": digests, "versions": {"cosim": __version__}})
    )
    assert is_current(tmp_path, scenario)
    part.write_text("changed")
    assert not is_current(tmp_path, scenario)
    assert not is_current(tmp_path / "nowhere", scenario)


def candidate_of(inputs=(), outputs=(), parameters=()):
    def named(names):
        return {name: Variable(name) for name in names}

    return CandidateInterface(named(inputs), named(outputs), named(parameters))


@pytest.mark.parametrize(
    ("found", "message"),
    [
        (
            candidate_of(outputs=["thrust"], inputs=["rudder_angle"]),
            '"rudder_angle" is an input, expected an output',
        ),
        (
            candidate_of(outputs=["thrust"], parameters=["rudder_angle"]),
            '"rudder_angle" is a parameter, expected an output',
        ),
        (
            candidate_of(outputs=["thrust", "rudder"]),
            'the output "rudder_angle" (rad) is missing; did you mean "rudder"?',
        ),
        (
            candidate_of(outputs=["thrust", "rudder_angle"], inputs=["vehicle.yaw"]),
            'the role has no signal for the input "vehicle.yaw"',
        ),
    ],
)
def test_an_unsuitable_interface_is_refused(found, message):
    assert message in interface_problems(read_role("vessel_autopilot"), found)[0].message


def test_an_unknown_parameter_is_refused():
    found = candidate_of(
        outputs=["thrust", "rudder_angle"], parameters=["heading_P", "waypoint_x[1]"]
    )
    (problem,) = interface_problems(
        read_role("vessel_autopilot"), found, ["heading_p", "waypoint_x", "heading_P"]
    )
    assert (
        problem.message == 'the controller has no variable "heading_p"; did you mean "heading_P"?'
    )


@pytest.mark.parametrize(
    ("function", "text", "message"),
    [
        (
            read_role,
            "vessel_autopilo",
            'there is no role "vessel_autopilo"; did you mean "vessel_autopilot"?',
        ),
        (read_role, "captain", 'there is no role "captain"; valid: uav_altitude, '),
        (parse_source, "none.fmu", 'there is no file "none.fmu"'),
        (
            parse_source,
            "lazy.json:Pilot",
            "expected my.fmu, my.py:Class, my.mo:Model or a nested system my.json",
        ),
        (
            parse_source,
            "lazy.py",
            "expected my.fmu, my.py:Class, my.mo:Model or a nested system my.json",
        ),
    ],
)
def test_unknown_roles_and_sources_are_refused(function, text, message):
    with pytest.raises(InputError) as refusal:
        function(text)
    assert str(refusal.value).startswith(message)


def test_a_users_role_file_is_validated(tmp_path):
    (tmp_path / "bad.json").write_text(
        '{"description": 5, "controllers": [], "inputs": {"u": 1}, "output": {}}'
    )
    with pytest.raises(InputError) as refusal:
        read_role(str(tmp_path / "bad.json"))
    found = [
        str(problem).partition("bad.json:")[2].partition(" ")[0]
        for problem in refusal.value.problems
    ]
    assert len(found) >= 4
    assert {"1:2:", "1:50:", "1:59:"} <= set(found)


@pytest.mark.parametrize("fails", [False, True])
def test_the_components_of_a_candidate_are_freed(monkeypatch, fails):
    freed = []
    monkeypatch.setattr(PreparedRun, "free", lambda run: freed.extend(run.system.components))
    if fails:
        monkeypatch.setattr(candidate, "_component_interface", raise_input_error)
    source = parse_source(str(ROOT / "fmus/heading_controller.fmu"))
    with pytest.raises(InputError) if fails else nullcontext():
        read_interface(source)
    assert freed == ["candidate"]


def raise_input_error(_component):
    raise InputError("refused")
