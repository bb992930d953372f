"""Files that extend another one: the merge rule, paths, locations of problems, and the expanded
JSON.
"""

import json

import pytest
from cosim_command import run_cosim
from jsonschema import Draft202012Validator
from systems import connection

import cosim
from cosim.scenario.extension import read_system_document
from cosim.scenario.extension_schema import editor_schema
from cosim.scenario.nested_systems import load_scenario
from cosim.studies.regression import has_keys

CHECK = {"kpi": "end.value", "max": 9.0}


@pytest.fixture
def base(folder):
    """A file base.json: a constant 1.0 is doubled twice."""
    kpi = {"name": "end", "python": "cosim.kpis:final", "arguments": {"signal": "b.y"}}
    components = {"a": folder.block("Gain", parameters={"u": 1.0}), "b": folder.block("Gain")}
    file = folder.scenario(
        components, [connection("a.y", "b.u")], description="Base", kpis=[kpi], checks=[CHECK]
    )
    return file.rename(folder.path / "base.json")


@pytest.fixture
def extend(folder, base):
    assert base.is_file()

    def write(name="scenario.json", extends="base.json", **keys):
        return folder.write({"extends": extends, "name": "test", **keys}, name)

    return write


def expanded(file):
    document = read_system_document(file)
    assert document.problems == []
    return document.value


def test_objects_are_merged_and_other_values_replace(folder, extend):
    file = extend(
        stop_time=2,
        components={"a": {"parameters": {"k": 3.0}}, "c": folder.block("Gain")},
        checks=[],
    )
    value = expanded(file)
    assert value["stop_time"], value["step_size"] == (2, 1)
    assert value["components"]["a"]["parameters"] == {"u": 1.0, "k": 3.0}
    assert list(value["components"]) == ["a", "b", "c"]
    assert value["checks"] == []
    assert cosim.run(file)["b.y"].tolist() == [0, 6, 6]


def test_null_removes(extend):
    value = expanded(extend(kpis=None, checks=None, components={"a": {"parameters": {"u": None}}}))
    assert "kpis" not in value
    assert value["components"]["a"]["parameters"] == {}


def test_a_removed_component_takes_its_connections_stages_and_signals(folder, extend):
    connections = [connection("a.y", "b.u"), connection("b.y", "c.u"), connection("a.y", "d.u")]
    components = {name: folder.block("Gain") for name in "abcd"}
    record = {"signals": ["a.y", "b.*", "c.y", "d.y"], "interval": 1}
    algorithm = {"kind": "staged", "stages": [["a"], ["b"], ["c", "d"]]}
    folder.scenario(components, connections, record=record, algorithm=algorithm).rename(
        folder.path / "four.json"
    )
    value = expanded(
        extend(extends="four.json", components={"b": None}, connections={"d.u": {"delay": 1}})
    )
    assert list(value["components"]) == ["a", "c", "d"]
    assert value["connections"] == [{**connection("a.y", "d.u"), "delay": 1}]
    assert value["algorithm"]["stages"] == [["a"], ["c", "d"]]
    assert value["record"] == {"signals": ["a.y", "c.y", "d.y"], "interval": 1}
    kept = expanded(
        extend(
            "own.json",
            "four.json",
            components={"b": None},
            record={"signals": ["b.y"]},
            connections=connections,
        )
    )
    assert (kept["record"]["signals"], kept["connections"]) == (["b.y"], connections)


def test_a_setting_cannot_remove_a_component(folder):
    file = folder.scenario({"a": folder.block("Gain")}, [])
    with pytest.raises(
        cosim.InputError,
        match='found null; a scenario that "extends" this one removes a component by null',
    ):
        cosim.load(file, {"/components/a": None})


def test_named_elements_of_lists_are_changed_by_an_object(extend):
    file = extend(
        connections={"b.u": {"delay": 1}, "a.u": {"from": "b.y"}},
        kpis={
            "end": {"arguments": {"signal": "a.y"}},
            "mean": {"python": "cosim.kpis:mean", "arguments": {"signal": "b.y"}},
        },
        checks={"end.value": None, "mean.value": {"min": 0}},
    )
    value = expanded(file)
    assert value["connections"] == [
        {"from": "a.y", "to": "b.u", "delay": 1},
        {"to": "a.u", "from": "b.y"},
    ]
    assert [(each["name"], each["arguments"]["signal"]) for each in value["kpis"]] == [
        ("end", "a.y"),
        ("mean", "b.y"),
    ]
    assert value["checks"] == [{"kpi": "mean.value", "min": 0}]


def test_a_source_of_another_kind_replaces_the_component(extend):
    base = {"a": {"period": 1}, "b": {"parameters": {"k": 3.0}, "period": 1}}
    middle = extend("middle.json", components=base)
    other = expanded(
        extend(
            extends=middle.name,
            components={"a": {"fmu": "a.fmu"}, "b": {"fmu": "b.fmu", "tolerance": 1e-3}},
        )
    )
    assert other["components"] == {
        "a": {"period": 1, "fmu": "a.fmu"},
        "b": {"period": 1, "fmu": "b.fmu", "tolerance": 1e-3},
    }
    same = expanded(extend(extends=middle.name, components={"b": {"python": "b.py:B"}}))
    assert same["components"]["b"] == {"python": "b.py:B", "parameters": {"k": 3.0}, "period": 1}


def test_what_describes_the_base_is_not_inherited(folder, base, extend):
    folder.write(
        {**json.loads(base.read_text()), "reference": {"file": "x.csv", "tolerances": {}}},
        "base.json",
    )
    assert {"description", "reference", "extends"}.isdisjoint(expanded(extend()))
    file = folder.write({"extends": "base.json"})
    assert folder.problems_of(file) == ['scenario.json:1:1: $.name: the key "name" is missing']


@pytest.mark.usefixtures("base")
def test_paths_stay_relative_to_the_file_that_contains_them(folder):
    (folder.path / "plain.csv").write_text("time,u\n0,2\n3,2\n")
    (folder.path / "deep" / "er").mkdir(parents=True)
    folder.write(
        {
            "components": {"g": folder.block("Gain")},
            "ports": {"inputs": {"u": "g.u"}, "outputs": {"y": "g.y"}},
        },
        "n.json",
    )
    profile = {"inputs": [{"file": "../plain.csv", "to": {"u": "n.u"}}]}
    middle = {
        "extends": "../base.json",
        "name": "m",
        "components": {"n": {"system": "../n.json"}},
        **profile,
    }
    folder.write(middle, "deep/middle.json")
    file = folder.write(
        {"extends": "../middle", "name": "top", "kpis": None, "checks": None}, "deep/er/top.json"
    )
    result = cosim.run(file)
    assert result["n.y"].tolist() == [0, 4, 4, 4]
    hashed = set(result.metadata["sha256"])
    assert {
        "top.json",
        "../middle.json",
        "../../base.json",
        "../../n.json",
        "../../plain.csv",
    } <= hashed


@pytest.mark.parametrize(
    ("extends", "problem"),
    [
        ("other.json", 'cannot read "'),
        (
            "demo1_bax",
            'no scenario file and no shipped scenario "demo1_bax"; did you mean "demo1_box"?',
        ),
        (".", ". is a folder, expected a scenario file"),
        ("a" * 5000, 'no scenario file and no shipped scenario "aaa'),
        ("scenario.json", '"scenario.json" extends itself'),
        ("loop.json", '"scenario.json" extends itself'),
        (3, "expected the path of a file or the name of a shipped scenario"),
    ],
)
def test_a_wrong_base_is_refused(folder, extend, extends, problem):
    folder.write({"extends": "scenario.json"}, "loop.json")
    (found,) = folder.problems_of(extend(extends=extends))
    assert problem in found
    assert ".json:1:" in found
    assert "$.extends" in found


def test_problems_name_the_file_that_contains_the_value(folder, base, extend):
    base.write_text(
        json.dumps({**json.loads(base.read_text()), "step_size": 1000, "colour": "red"}, indent=0)
    )
    own, inherited, unknown = sorted(
        folder.problems_of(extend(components={"b": {"parameters": {"q": 1}}})), reverse=True
    )
    assert own.startswith("scenario.json:1:")
    assert '$.components.b.parameters.q: component "b" has no variable "q"' in own
    assert inherited.startswith("base.json:")
    assert "$.stop_time" in inherited
    assert unknown == "base.json:38:1: $.colour: unknown key"


def test_a_removed_component_is_not_mistaken_for_another(folder, extend):
    """The file itself connects a.y; the remaining component has a similar name."""
    file = extend(
        components={"a": None, "aa": folder.block("Gain")}, connections=[connection("a.y", "b.u")]
    )
    (problem,) = folder.problems_of(file)
    assert problem.endswith('$.connections[0].from: unknown component "a", which was removed')


def test_changes_of_nothing_are_refused(folder, extend):
    file = extend(
        components={"z": None},
        checks={"end.walue": None},
        connections={"b.u": 3},
        kpis={"end": {"arguments": {"target": None}}},
    )
    texts = [problem.partition(": $")[2] for problem in folder.problems_of(file)]
    assert [text for text in texts if "remove" in text] == [
        ".components.z: nothing to remove; valid: a, b",
        '.connections["b.u"]: expected an object, or null to remove the element',
        ".kpis.end.arguments.target: nothing to remove; valid: signal",
        '.checks["end.walue"]: nothing to remove; did you mean "end.value"?',
    ]


def test_an_ambiguous_name_is_refused(folder, base, extend):
    folder.write(
        {**json.loads(base.read_text()), "checks": [CHECK, {"kpi": "end.value", "min": 1.0}]},
        "base.json",
    )
    (problem,) = folder.problems_of(extend(checks={"end.value": {"max": 5.0}}))
    assert problem.endswith("the base has 2 elements with this name; a list replaces all elements")


def test_settings_act_on_the_expanded_scenario(extend):
    result = cosim.run(
        extend(),
        parameters={"/checks/0/max": 3.0, "a.u": 2.0, "/components/b/parameters": {"k": 1.0}},
    )
    assert result.kpis["end.value"] == 4.0
    assert [check.passed for check in result.checks] == [False]


def test_a_setting_replaces_a_component_by_a_source_of_another_kind(folder, extend):
    nested = {
        "components": {"g": folder.block("Gain")},
        "ports": {"inputs": {"u": "g.u"}, "outputs": {"y": "g.y"}},
    }
    folder.write({**nested, "name": "gain"}, "mine.json")
    file = extend(components={"b": {"parameters": {"not_of_the_nested_system": 3.0}}})
    source = {"/components/b/system": str(folder.path / "mine.json")}
    assert cosim.run(file, parameters=source)["b.y"].tolist() == [0, 4, 4, 4]
    (problem,) = folder.problems_of(file, parameters={"/components/b/parameters/v": 1.0, **source})
    assert problem.startswith(
        'setting "/components/b/parameters/v": nested system "b" has no parameter port "v"'
    )


def test_a_problem_of_a_setting_is_located_at_the_setting(folder, extend):
    file = extend()
    cases = {
        "/components/b/python": (
            "my.py:Class",
            'setting "/components/b/python": file "my.py" does not exist',
        ),
        "/components/b/fmu": ("my.fmu", 'setting "/components/b/fmu": FMU "my.fmu" does not exist'),
        "/components/b": (
            {"fmu": "my.fmu", "perod": 1},
            'setting "/components/b": $.components.b.perod: unknown key',
        ),
        "/checks/0/max": ("high", 'setting "/checks/0/max": expected a valid number; found "high"'),
    }
    for pointer, (value, problem) in cases.items():
        value = (
            str(folder.path / value) if isinstance(value, str) and value.startswith("my") else value
        )
        assert folder.problems_of(file, parameters={pointer: value})[0].startswith(problem)


def test_a_setting_creates_missing_parameters(folder, extend):
    assert (
        cosim.run(extend(), parameters={"/components/b/parameters/k": 5.0}).kpis["end.value"]
        == 10.0
    )
    place = "/components/b/parametres"
    (problem,) = folder.problems_of(extend(), parameters={f"{place}/k": 5.0})
    assert (
        problem == f'setting "{place}/k": the scenario has no "{place}"; did you mean "parameters"?'
    )


def test_inherited_checks_make_a_regression_test(extend):
    assert has_keys(extend(), ("components",), ("checks",))
    assert not has_keys(extend(checks=None), ("components",), ("checks",))


def test_the_expanded_json_runs_anywhere(extend, tmp_path):
    file = extend(components={"b": {"parameters": {"k": 5.0}}})
    done = run_cosim(
        "check",
        str(file),
        "--expanded",
        "--set",
        "a.u=3.0",
        "--set",
        "/checks/0/max=30",
        cwd=tmp_path,
    )
    assert done.returncode == 0, done.stderr
    (tmp_path / "elsewhere").mkdir()
    copy = tmp_path / "elsewhere" / "copy.json"
    copy.write_text(done.stdout)
    result = cosim.run(copy)
    assert result.kpis["end.value"] == 30.0
    assert all(check.passed for check in result.checks)


def test_the_expanded_json_has_all_keys_of_both_files(extend):
    file = extend(stop_time=2, start_time=1, events=[{"time": 1, "set": {"a.k": 4.0}}])
    printed = load_scenario(file, {"b.k": 5.0}).expanded()
    value = expanded(file)
    assert list(printed) == list(value)
    components = printed.pop("components")
    assert components["b"].pop("parameters") == {"k": 5.0}
    assert components["a"]["parameters"] == {"u": 1.0}
    assert printed == {key: each for key, each in value.items() if key != "components"}


def test_the_editor_schema_accepts_extending_files(extend):
    validator = Draft202012Validator(editor_schema())
    Draft202012Validator.check_schema(editor_schema())
    good = {
        "components": {"a": {"parameters": {"u": None}, "period": 0.1}, "b": None},
        "checks": {"end.value": {"max": 2}},
    }
    assert validator.is_valid(
        json.loads(extend(**good, events=None, record={"interval": 1}).read_text())
    )
    for wrong in (
        {"colour": 1},
        {"components": {"a": {"fmu": 3}}},
        {"checks": {"end.value": {"most": 2}}},
        {"stop_time": "x"},
    ):
        assert not validator.is_valid(json.loads(extend(**wrong).read_text()))
    assert not validator.is_valid({"extends": "base.json"})


def test_paths_in_settings_start_from_the_working_directory(folder, extend, monkeypatch):
    (folder.path / "here").mkdir()
    nested = {
        "components": {"g": folder.block("Gain")},
        "ports": {"inputs": {"u": "g.u"}, "outputs": {"y": "g.y"}},
    }
    folder.write(nested, "here/mine.json")
    file = extend(checks=None)
    monkeypatch.chdir(folder.path / "here")
    result = cosim.run(file, parameters={"/components/b": {"system": "mine.json"}})
    assert result["b.y"].tolist() == [0, 4, 4, 4]
    done = run_cosim(
        "check",
        str(file),
        "--set",
        '/components/b={"system": "mine.json"}',
        cwd=folder.path / "here",
    )
    assert done.returncode == 0, done.stderr


CHANGES_OF_NOTHING = {
    "component": (
        {"components": {"B": {"period": 1}}},
        '.components.B: the base "base.json" has no component "B"',
        "b",
    ),
    "empty": (
        {"components": {"B": {}}},
        '.components.B: the base "base.json" has no component "B"',
        "b",
    ),
    "connection": (
        {"connections": {"b.uu": {"delay": 1}}},
        '.connections["b.uu"]: the base "base.json" has no connection to "b.uu"',
        "b.u",
    ),
    "KPI": (
        {"kpis": {"ned": {"arguments": {}}}},
        '.kpis.ned: the base "base.json" has no KPI "ned"',
        "end",
    ),
    "figure": (
        {"figures": {"pahts": {"optional": True}}},
        '.figures.pahts: the base "base.json" has no figure "pahts"; a new one needs python',
        "",
    ),
}


@pytest.mark.parametrize("case", CHANGES_OF_NOTHING)
def test_a_misspelt_name_is_reported_at_its_place_in_the_extending_file(folder, extend, case):
    changes, text, near = CHANGES_OF_NOTHING[case]
    (found,) = folder.problems_of(extend(**changes))
    assert found.startswith("scenario.json:1:")
    assert found.endswith(f"${text}" + (f'; did you mean "{near}"?' if near else ""))


def test_a_new_component_needs_a_source_and_a_place_in_the_stages(folder, base, extend):
    stages = {"algorithm": {"kind": "staged", "stages": [["a"], ["b"]]}}
    folder.write({**json.loads(base.read_text()), **stages}, "base.json")
    (found,) = folder.problems_of(extend(components={"pilot": {"parameters": {"k": 1.0}}}))
    assert (
        'the base "base.json" has no component "pilot"; a new one needs fmu or python or '
        "modelica or system; valid: a, b"
    ) in found
    (found,) = folder.problems_of(extend(components={"pilot": {"pyhton": "own.py:Own"}}))
    assert '$.components.pilot.pyhton: unknown key; did you mean "python"?' in found
    (found,) = folder.problems_of(extend(components={"pilot": folder.block("Gain")}))
    assert found.startswith("scenario.json:1:")
    assert (
        '$.components.pilot: component "pilot" is in no stage of "algorithm", so it would '
        "never step"
    ) in found
