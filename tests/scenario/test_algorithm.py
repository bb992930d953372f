"""The key `algorithm` of scenarios."""

import json

import pytest
from systems import connection

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
    inner = {
        "components": {"a": {"fmu": str(probe)}},
        "algorithm": {"stages": [["a"]], "parallel": False},
    }
    (tmp_path / "inner.json").write_text(json.dumps(inner))
    outer = {
        "name": "outer",
        "stop_time": 1,
        "step_size": 0.1,
        "components": {"n": {"system": "inner.json"}},
    }
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


def stage_order(folder, components, connections=(), **more):
    prepared = load(folder.scenario(components, list(connections), **more))
    prepared.free()
    return prepared.system.stages


CLASS = """
from cosim.core.component import Component, Variable


class {name}(Component):
    binds_everything, has_state = False, False

    def __init__(self, instance_name):
        self.variables = [
            Variable("u", causality="input", start=0.0),
            Variable("y", causality="output"),
        ]
        self.dependencies = {{"y": frozenset({direct})}}

    def bind(self, inputs, outputs): ...
    def set(self, name, value): ...
    def get(self, name): return 0.0
    def set_inputs(self): ...
    def get_outputs(self): ...
    def do_step(self, time, step_size): ...
"""


@pytest.fixture
def loop(folder):
    """A component without direct feed-through, and one with it."""
    for name, direct in (("Plant", []), ("Controller", ["u"])):
        (folder.path / f"{name}.py").write_text(CLASS.format(name=name, direct=direct))
    return {name.lower(): {"python": f"{name}.py:{name}"} for name in ("Controller", "Plant")}


def test_without_stages_components_step_after_those_that_feed_them(folder):
    gains = {name: folder.block("Gain") for name in "cba"}
    chain = [connection("a.y", "b.u"), connection("b.y", "c.u")]
    assert stage_order(folder, gains, chain) == (("a",), ("b",), ("c",))
    assert stage_order(folder, gains, [connection("a.y", "b.u", delay=1)]) == (
        ("c",),
        ("b",),
        ("a",),
    )
    assert stage_order(folder, gains, [*chain, connection("c.y", "a.u")]) == (
        ("c",),
        ("b",),
        ("a",),
    )  # unknown dependencies


def test_in_a_loop_the_component_with_direct_feedthrough_steps_last(folder, loop):
    wires = [connection("controller.y", "plant.u"), connection("plant.y", "controller.u")]
    assert stage_order(folder, loop, wires) == (("plant",), ("controller",))
    ((group,),) = stage_order(
        folder, {name: folder.block("Gain") for name in "ab"}, algorithm={"iteration": {}}
    )
    assert group.stages == (("a",), ("b",))
