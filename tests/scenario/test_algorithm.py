"""The key `algorithm` of scenarios."""

import json

import pytest

from cosim.api import load
from cosim.core.errors import InputError


def scenario(folder, probe, **algorithm):
    path = folder / "two.json"
    components = {name: {"fmu": str(probe)} for name in "ab"}
    document = {"name": "two", "stop_time": 1, "step_size": 0.1, "components": components}
    path.write_text(json.dumps(document | {"algorithm": {"stages": [["a", "b"]], **algorithm}}))
    return path


@pytest.mark.parametrize("parallel", ["auto", True, False])
def test_a_scenario_says_whether_stages_run_on_threads(tmp_path, probe, parallel):
    assembly = load(scenario(tmp_path, probe, parallel=parallel))
    assert assembly.system.parallel is parallel or assembly.system.parallel == parallel == "auto"
    assembly.free()


def test_auto_is_what_is_meant_when_nothing_is_said(tmp_path, probe):
    assembly = load(scenario(tmp_path, probe))
    assert assembly.system.parallel == "auto"
    assembly.free()


def test_a_setting_from_outside_turns_threads_off(tmp_path, probe):
    assembly = load(scenario(tmp_path, probe), {"/algorithm/parallel": False})
    assert assembly.system.parallel is False
    assembly.free()


def test_nested_systems_say_it_for_their_own_stages(tmp_path, probe):
    inner = {"components": {"a": {"fmu": str(probe)}}, "algorithm": {"stages": [["a"]], "parallel": False}}
    (tmp_path / "inner.json").write_text(json.dumps(inner))
    outer = {"name": "outer", "stop_time": 1, "step_size": 0.1, "components": {"n": {"system": "inner.json"}}}
    (tmp_path / "outer.json").write_text(json.dumps(outer))
    assembly = load(tmp_path / "outer.json")
    ((group,),) = assembly.system.stages
    assert (assembly.system.parallel, group.parallel) == ("auto", False)
    assembly.free()


def test_anything_else_is_refused_in_one_line(tmp_path, probe):
    with pytest.raises(InputError) as refusal:
        load(scenario(tmp_path, probe, parallel="sometimes"))
    (problem,) = refusal.value.problems
    assert problem.message == 'expected "auto", true or false; found "sometimes"'
    assert problem.where.endswith("$.algorithm.parallel")
