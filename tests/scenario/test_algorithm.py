"""The key `algorithm` of scenarios."""

import json

import pytest

from cosim.core.errors import InputError
from cosim.scenario import load


def scenario(folder, probe, **algorithm):
    path = folder / "two.json"
    components = {name: {"fmu": str(probe)} for name in "ab"}
    document = {"name": "two", "stop_time": 1, "step_size": 0.1, "components": components}
    path.write_text(json.dumps(document | {"algorithm": {"stages": [["a", "b"]], **algorithm}}))
    return path


@pytest.mark.parametrize("parallel", ["auto", True, False])
def test_a_scenario_selects_whether_stages_run_in_threads(tmp_path, probe, parallel):
    prepared = load(scenario(tmp_path, probe, parallel=parallel))
    assert prepared.system.parallel is parallel or prepared.system.parallel == parallel == "auto"
    prepared.free()


def test_parallel_is_auto_by_default(tmp_path, probe):
    prepared = load(scenario(tmp_path, probe))
    assert prepared.system.parallel == "auto"
    prepared.free()


def test_a_setting_of_the_caller_turns_threads_off(tmp_path, probe):
    prepared = load(scenario(tmp_path, probe), {"/algorithm/parallel": False})
    assert prepared.system.parallel is False
    prepared.free()


def test_nested_systems_have_a_parallel_setting_of_their_own(tmp_path, probe):
    inner = {"components": {"a": {"fmu": str(probe)}}, "algorithm": {"stages": [["a"]], "parallel": False}}
    (tmp_path / "inner.json").write_text(json.dumps(inner))
    outer = {"name": "outer", "stop_time": 1, "step_size": 0.1, "components": {"n": {"system": "inner.json"}}}
    (tmp_path / "outer.json").write_text(json.dumps(outer))
    prepared = load(tmp_path / "outer.json")
    ((group,),) = prepared.system.stages
    assert (prepared.system.parallel, group.parallel) == ("auto", False)
    prepared.free()


def test_any_other_value_of_parallel_is_an_error_of_one_line(tmp_path, probe):
    with pytest.raises(InputError) as refusal:
        load(scenario(tmp_path, probe, parallel="sometimes"))
    (problem,) = refusal.value.problems
    assert problem.message == 'expected "auto", true or false; found "sometimes"'
    assert problem.where.endswith("$.algorithm.parallel")
