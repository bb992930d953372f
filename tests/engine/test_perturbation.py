"""Values that are added to inputs while an executor steps."""

import numpy as np
import pytest
from linear_blocks import block

from cosim.core.errors import InputError
from cosim.core.system import Endpoint
from cosim.engine.perturbation import PerturbationTarget, PerturbingExecutor
from cosim.engine.plan_run import PlanRun
from cosim.scenario import load

GAIN = ([], [], [[]], [[1]])


def scenario(**more):
    """Return a chain of three blocks y = u; the first one is an integrator of its input."""
    components = {"a": block([[1]], [[1]], [[1]]), "b": block(*GAIN), "c": block(*GAIN)}
    connections = [{"from": "a.y0", "to": "b.u0"}, {"from": "b.y0", "to": "c.u0", "gain": 3}]
    return {
        "name": "chain",
        "stop_time": 10,
        "step_size": 1,
        "components": components,
        "connections": connections,
        **more,
    }


def run(values, targets, content=None, active=None):
    """Return the recorded outputs and the observed values of a run with values that are added to
    one channel.
    """
    run = PlanRun(load(content or scenario()).plan, executor=PerturbingExecutor)
    try:
        run.initialize()
        run.executor.set_channels([targets], active)
        run.executor.set_values(np.array(values, float)[:, None])
        run.advance(len(values) + 1)
        columns = run.outcome().recording.columns
        return {name: columns[name].tolist() for name in columns}, run.executor.observed[
            :, 0
        ].tolist()
    finally:
        run.close()


def test_a_value_is_added_after_the_transfer_and_only_in_its_step():
    found, observed = run([0, 5, 0], [PerturbationTarget(Endpoint("c", "u0"))])
    assert found["c.y0"] == [0, 0, 5, 0, 0]
    assert found["b.y0"] == [0, 0, 0, 0, 0]
    assert observed == [0, 0, 0]


def test_an_input_without_connection_is_set_and_set_back():
    found, _ = run([2, 0, 1], [PerturbationTarget(Endpoint("a", "u0"))])
    assert found["a.y0"] == [0, 2, 2, 3, 3]
    assert found["c.y0"] == [0, 6, 6, 9, 9]


def test_the_observed_value_is_that_before_the_addition_divided_by_the_factor():
    content = scenario()
    content["components"]["a"]["arguments"]["x0"] = [4.0]
    found, observed = run([1, 1], [PerturbationTarget(Endpoint("c", "u0"), 3.0)], content)
    assert observed == [4, 4]
    assert found["c.y0"][1:] == [15, 15, 12]


def test_components_that_are_not_active_hold_their_outputs():
    content = scenario()
    content["components"]["a"]["arguments"]["x0"] = [4.0]
    found, _ = run([1, 1], [PerturbationTarget(Endpoint("a", "u0"))], content, active={"b"})
    assert found["a.y0"] == [4, 4, 4, 4]


def test_inputs_of_iterated_components_are_refused():
    algorithm = {
        "kind": "staged",
        "stages": [["a"], ["b", "c"]],
        "iteration": {"tolerance": 1e-9, "limit": 20},
    }
    content = scenario(algorithm=algorithm)
    with pytest.raises(InputError, match=r"c\.u0 belongs to components that are iterated"):
        run([1], [PerturbationTarget(Endpoint("c", "u0"))], content)
