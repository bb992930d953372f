"""The algorithm that `cosim check` recommends."""

import pytest
from cosim_command import run_cosim
from fakes import gain
from systems import make_system

from cosim.core.system import Group, Iteration
from cosim.scenario.stages import recommend

LOOP = "a.y > b.u, b.y > a.u"


def recommended(wires, stages=(), prepare=lambda _component: None):
    components = {name: gain() for name in "abc"}
    for component in components.values():
        prepare(component)
    return recommend(make_system(components, wires, stages))


def declare(*direct):
    return lambda component: setattr(component, "dependencies", {"y": frozenset(direct)})


def test_values_that_are_late_without_a_reason_need_another_order():
    assert recommended("a.y > b.u, b.y > c.u", (("c",), ("b",), ("a",))) == [
        (
            'leave out "stages": the values of a -> b, b -> c are one step late, although nothing '
            "flows back"
        )
    ]
    (line,) = recommended("a.y > b.u, b.y > c.u", (("a",), ("b",), ("c",)))
    assert line.startswith("none: ")


def test_a_direct_loop_needs_an_iteration():
    (line,) = recommended(LOOP, (("a",), ("b",), ("c",)), declare("u"))
    assert line.startswith(
        '"iteration": {"method": "newton"} for a, b: their outputs depend directly on each other'
    )
    stages = ((Group("all", (("a",), ("b",), ("c",)), "auto", Iteration(1e-9, 9, "newton")),),)
    assert recommended(LOOP, stages, declare("u"))[0].startswith("none: ")


def test_a_direct_loop_that_cannot_be_iterated_needs_small_steps():
    def prepare(component):
        component.dependencies, component.has_state = {"y": frozenset("u")}, False

    (line,) = recommended(LOOP, (("a",), ("b",), ("c",)), prepare)
    assert line.startswith(
        "a smaller step size: outputs of a, b form an algebraic loop, and one of them is a step "
        "late"
    )
    assert line.endswith("because a, b cannot repeat a step")
    (line,) = recommended("a.y > a.u", (("a",), ("b",), ("c",)), prepare)
    assert line.startswith("a smaller step size: outputs of a form an algebraic loop")


def test_a_component_that_feeds_itself_needs_an_iteration_only_if_the_feedback_is_direct():
    stages = (("a",), ("b",), ("c",))
    assert recommended("a.y > a.u", stages, declare("u"))[0].startswith(
        '"iteration": {"method": "newton"} for a'
    )
    assert recommended("a.y > a.u", stages, declare())[0].startswith("none: ")


def test_components_that_interpolate_need_linear_inputs():
    (line,) = recommended(
        LOOP,
        (("a",), ("b",), ("c",)),
        lambda component: setattr(component, "interpolates_inputs", True),
    )
    assert line == (
        '"interpolation": "linear" for connections between a, b: b, a can interpolate, which '
        "raises the order to 2"
    )


@pytest.mark.parametrize(
    "prepare", [lambda _: None, declare()], ids=["unknown dependencies", "no direct dependencies"]
)
def test_other_loops_need_a_stage_for_each_component(prepare):
    (line,) = recommended(LOOP, (("a", "b"), ("c",)), prepare)
    assert line.startswith("one stage for each of a, b: ")
    assert recommended(LOOP, (("a",), ("b",), ("c",)), prepare)[0].startswith("none: ")


def test_the_command_prints_it(folder):
    blocks = {name: folder.block("Gain") for name in "ab"}
    wires = [{"from": "a.y", "to": "b.u"}]
    file = folder.scenario(blocks, wires, algorithm={"stages": [["b"], ["a"]]})
    assert 'leave out "stages": the values of a -> b' in run_cosim("check", str(file)).stdout
