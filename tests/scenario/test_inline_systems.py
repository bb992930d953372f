"""A nested system may be written inline, with everything that its file can have."""

import json
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from systems import connection

import cosim
from cosim.components.python_import import load_object
from cosim.core import resources
from cosim.scenario import find_scenario, load_scenario
from cosim.scenario.component_schema import change_paths
from cosim.scenario.extension_schema import editor_schema
from cosim.scenario.file_paths import relocating
from cosim.studies.execution.bundle import collect_bundle

SHIPPED = resources.root() / "scenarios"


def inlined(system, folder):
    """Return a system in which the contents of files replace the paths of nested systems."""
    system = change_paths(system, relocating(folder, None))
    for component in system["components"].values():
        if "system" in component:
            file = Path(component["system"])
            component["system"] = inlined(json.loads(file.read_text("utf-8")), file.parent)
    return system


@pytest.fixture
def inner(folder):
    """A nested system of one gain with ports."""
    return {
        "components": {"g": folder.block("Gain")},
        "ports": {
            "inputs": {"command": "g.u"},
            "outputs": {"y": "g.y"},
            "parameters": {"gain": "g.k"},
        },
    }


@pytest.mark.parametrize("name", ["demo1_box", "path_in_current", "performance_5"])
def test_a_shipped_scenario_with_inline_systems_gives_the_same_bytes(name, tmp_path):
    file = find_scenario(name)
    content = inlined(load_scenario(name).root.document.value, file.parent)
    assert all(isinstance(each.get("system", {}), dict) for each in content["components"].values())
    own = tmp_path / f"{name}.json"
    own.write_text(json.dumps(content))
    texts = []
    for scenario in (name, own):
        result = cosim.run(scenario, stop_time=1)
        result.to_csv(tmp_path / "result.csv")
        texts.append((tmp_path / "result.csv").read_bytes())
        assert result.kpis
    assert texts[0] == texts[1]


@pytest.mark.parametrize(
    ("change", "place", "text"),
    [
        ({"stop_time": 3}, "$.stop_time", "unknown key"),
        ({"components": {}}, "$.components", "expected at least one component"),
        ({"components": {"g": {"fmu": "none.fmu"}}}, "$.components.g", "none.fmu"),
        ({"components": {"g": {"fmuu": "a.fmu"}}}, "$.components.g.fmuu", 'did you mean "fmu"?'),
        ({"components": {"g": {"parameters": {}}}}, "$.components.g", "expected exactly one of"),
        (
            {"components": {"g": {"system": {}}}},
            "$.components.g.system.components",
            '"components" is missing',
        ),
        ({"connections": [{"from": "h.y", "to": "g.u"}]}, "$.connections[0].from", '"h"'),
        ({"ports": {"outputs": {"y": "h.y"}}}, "$.ports.outputs.y", 'unknown component "h"'),
        ({"algorithm": {"stages": "g"}}, "$.algorithm.stages", "list"),
        ({"algorithm": {"kind": "jacobi"}}, "$.algorithm.kind", "staged"),
        ({"extends": "none.json"}, "$.extends", "none.json"),
        ({"connections": {"g.u": None}}, "$.connections", "expected"),
    ],
)
def test_a_problem_names_its_place_in_the_outer_file(folder, inner, change, place, text):
    (line,) = folder.problems({"uav": {"system": {"components": inner["components"], **change}}})
    where = f"$.components.uav.system{place.removeprefix('$')}: "
    assert where in line
    assert text in line.partition(where)[2]
    file, number, column, _ = line.split(":", 3)
    assert file == "scenario.json"
    source = (folder.path / "scenario.json").read_text().splitlines()[int(number) - 1]
    last = place.rpartition(".")[2].partition("[")[0]
    assert source[int(column) - 1 :].startswith(
        (f'"{last}"', '"h.y"', '"algorithm"', '"system"', '"from"', "{")
    )


def test_a_repeated_key_of_an_inline_system_is_one_problem(folder):
    block = json.dumps(folder.block("Gain"))
    file = folder.write(
        '{"name": "n", "stop_time": 1, "step_size": 1, "components": {"a": {"system": '
        f'{{"components": {{"g": {block}, "g": {block}}}}}}}}}}}'
    )
    (line,) = folder.problems_of(file)
    assert "$.components.a.system.components.g: duplicate key" in line


def test_three_levels_are_connected_through_their_ports(folder, inner):
    for name in ("inner", "middle"):
        ports = {
            "inputs": {"command": f"{name}.command"},
            "outputs": {"y": f"{name}.y"},
            "parameters": {"gain": f"{name}.gain"},
        }
        inner = {"components": {name: {"system": inner}}, "ports": ports}
    components = {"a": {"system": inner, "parameters": {"gain": 3.0}}, "b": folder.block("Gain")}
    file = folder.scenario(components, [connection("b.y", "a.command")])
    result = cosim.run(file, {"b.u": 2.0, "/components/b/parameters": {"k": 5.0}})
    assert "a.middle.inner.g.y" in result
    assert result["a.y"][-1] == result["a.middle.inner.g.y"][-1] == 30.0
    pointer = "/components/a/system/components/middle/system/components/inner/system"
    with pytest.raises(cosim.InputError) as refusal:
        cosim.load(file, {f"{pointer}/components/g/perod": 1})
    assert f'setting "{pointer}/components/g/perod"' in str(refusal.value)


def test_a_pointer_sets_a_value_and_a_source(folder, inner):
    file = folder.scenario({"a": {"system": inner}})
    pointer = "/components/a/system/components/g"
    assert cosim.run(file, {f"{pointer}/parameters/k": 7.0, "a.command": 2.0})["a.y"][-1] == 14.0
    with pytest.raises(cosim.InputError, match=r"none\.fmu"):
        cosim.load(file, {f"{pointer}/fmu": "none.fmu"})


def test_a_setting_replaces_a_file_by_an_inline_system_that_extends_it(folder, inner):
    folder.write(inner, "inner.json")
    file = folder.scenario({"a": {"system": "inner.json"}})
    changed = {
        "extends": str(folder.path / "inner.json"),
        "components": {"g": {"parameters": {"k": 4}}},
    }
    assert cosim.run(file, {"/components/a/system": changed, "a.command": 2.0})["a.y"][-1] == 8.0


def test_paths_start_from_the_folder_of_the_file_that_contains_the_system(folder, inner):
    (folder.path / "systems").mkdir()
    folder.write(inner, "systems/base.json")
    extended = {"extends": "base.json", "components": {"g": {"parameters": {"k": 4}}}}
    base = {
        "name": "base",
        "stop_time": 1,
        "step_size": 1,
        "components": {"a": {"system": extended}},
    }
    folder.write(base, "systems/scenario.json")
    assert cosim.run(folder.path / "systems/scenario.json", {"a.command": 2.0})["a.y"][-1] == 8.0
    change = {"a": {"system": {"components": {"g": {"parameters": {"k": 5}}}}}}
    outer = folder.write({"extends": "systems/scenario", "name": "outer", "components": change})
    with cosim.load(outer, {"a.command": 2.0}) as simulation:
        assert simulation.run()["a.y"][-1] == 10.0
        about = simulation.result.metadata
    assert {"systems/base.json", "systems/scenario.json"} <= about["sha256"].keys()
    system = about["scenario"]["components"]["a"]["system"]
    assert system["components"]["g"]["parameters"] == {"k": 5}
    assert "extends" not in system
    bundle = collect_bundle(outer)
    bundled = {bundle.root / file for file in bundle.files}
    assert {folder.path / "systems/base.json", folder.path / "systems/scenario.json"} <= bundled


def test_an_extending_file_changes_lists_and_removes_components_of_an_inline_system(folder, inner):
    inner["components"]["h"] = folder.block("Gain")
    inner["connections"] = [connection("g.y", "h.u")]
    folder.write({**json.loads(folder.scenario({"a": {"system": inner}}).read_text())}, "base.json")
    gain = {"connections": {"h.u": {"gain": 3.0}}}
    outer = folder.write(
        {"extends": "base", "name": "n", "components": {"a": {"system": gain}}}, "gain.json"
    )
    assert cosim.run(outer, {"a.command": 2.0, "a.gain": 1.0})["a.h.y"][-1] % 6.0 == 0.0
    without = {"components": {"h": None}}
    outer = folder.write(
        {"extends": "base", "name": "n", "components": {"a": {"system": without}}}, "without.json"
    )
    assert not any(name.startswith("a.h.") for name in cosim.run(outer))
    wrong = {"components": {"k": {"parameters": {"k": 1}}}}
    outer = folder.write(
        {"extends": "base", "name": "n", "components": {"a": {"system": wrong}}}, "wrong.json"
    )
    (line,) = folder.problems_of(outer)
    assert "wrong.json:1:" in line
    assert '$.components.a.system.components.k: the base "base" has no component "k"' in line


def test_an_inline_system_with_a_base_of_its_own_replaces_that_of_the_base(folder, inner):
    folder.write(inner, "inner.json")
    other = {"components": {"x": folder.block("Gain")}}
    folder.write(json.loads(folder.scenario({"a": {"system": other}}).read_text()), "base.json")
    change = {"a": {"system": {"extends": "inner.json"}}}
    outer = folder.write({"extends": "base", "name": "n", "components": change}, "outer.json")
    result = cosim.run(outer)
    assert "a.g.y" in result
    assert "a.x.y" not in result


def test_a_system_that_extends_the_file_that_contains_it_is_refused(folder):
    (line,) = folder.problems({"a": {"system": {"extends": "scenario.json"}}})
    assert '"scenario.json" extends itself' in line


def test_a_dict_has_python_objects_in_inline_systems(folder):
    target = load_object(folder.block("Gain")["python"], Path())
    system = {"components": {"g": {"python": target}}}
    scenario = {
        "name": "n",
        "stop_time": 1,
        "step_size": 1,
        "components": {"a": {"system": system}},
    }
    result = cosim.run(scenario, {"a.g.u": 2.0, "a.g.k": 3.0})
    assert result["a.g.y"][-1] == 6.0
    with pytest.raises(cosim.InputError, match="found a Python class") as refusal:
        cosim.run(scenario, isolation="fmu")
    assert "$.components.a.system.components.g.python" in str(refusal.value)
    setting = {"/components/a/system/components/g": {"python": target, "parameters": {"k": 5.0}}}
    assert cosim.run(scenario, {**setting, "a.g.u": 2.0})["a.g.y"][-1] == 10.0


def test_files_of_arguments_are_included(folder):
    folder.write({"k": 1}, "values.json")
    component = folder.block("Gain", arguments={"options": "values.json"})
    loaded = load_scenario(folder.scenario({"a": {"system": {"components": {"g": component}}}}))
    (child,) = loaded.root.children.values()
    assert child.spec.components["g"].arguments == {"options": {"k": 1}}
    assert folder.path / "values.json" in loaded.files()


@pytest.mark.parametrize(
    ("system", "is_valid"),
    [
        ({"components": {"g": {"fmu": "a.fmu"}}}, True),
        ({"extends": "inner.json"}, True),
        ({"extends": "inner.json", "components": {"g": None}}, True),
        ({"components": {"g": {"fmu": 1}}}, False),
        ({"stop_time": 1, "components": {"g": {"fmu": "a.fmu"}}}, False),
        ({}, False),
        ("inner.json", True),
    ],
)
def test_the_schema_for_editors_knows_inline_systems(system, is_valid):
    scenario = {
        "name": "n",
        "stop_time": 1,
        "step_size": 1,
        "components": {"a": {"system": system}},
    }
    assert Draft202012Validator(editor_schema()).is_valid(scenario) == is_valid
    nested = {"components": {"a": {"system": system}}}
    assert Draft202012Validator(editor_schema(nested=True)).is_valid(nested) == is_valid


def test_a_run_with_an_inline_system_is_compared(folder):
    system = {"components": {"g": folder.block("Gain", parameters={"k": 2.0})}}
    scenario = folder.scenario({"a": {"system": system}})
    cosim.run(scenario).write(folder.path / "run")
    assert cosim.compare(folder.path / "run", folder.path / "run").passed
