"""FMUs that change the floating-point mode: the mode is restored before another component computes,
with one warning.
"""

from __future__ import annotations

import pytest
from fault_fmu import STEP_COUNT, function_name, lag_output, scenario

USUAL_ROWS = [lag_output(n) for n in range(STEP_COUNT + 1)]
CHANGES = ["round_up", "flush_to_zero", "fp_traps"]


@pytest.fixture
def run_with_neighbour(fmus, runner, tmp_path):
    """Run the FMU with an order as component `lag`, and a second FMU, which computes after it, as
    component `next`.
    """

    def run(version, order, *options, executor="native", connections=()):
        components = {
            "lag": {"fmu": str(fmus(version, order))},
            "next": {"fmu": str(fmus(version, name="next"))},
        }
        file = scenario(tmp_path, fmus.folder, components=components, connections=list(connections))
        done = runner.cosim(
            tmp_path, "run", file, "--output-dir", "out", "--no-report", *options, executor=executor
        )
        assert done.code == 0, done.err
        return done

    return run


def warnings(done):
    return [line for line in done.err.splitlines() if "WARNING" in line]


@pytest.mark.parametrize("executor", ["python", "native"])
@pytest.mark.parametrize("when", ["DoStep 2", "DoStep 6", "GetReal 9"])
@pytest.mark.parametrize("what", CHANGES)
def test_a_change_in_a_step_does_not_reach_other_components(
    run_with_neighbour, version, what, when, executor
):
    """The native executor runs the sixth step in compact form, and the second one not."""
    done = run_with_neighbour(version, f"{when} {what}", executor=executor)
    assert [row["next.y"] for row in done.rows] == USUAL_ROWS
    (line,) = warnings(done)
    step = "one of lag, next: a step" if what == "fp_traps" else "lag: the step"
    assert f"WARNING {step} changed the floating-point mode" in line


@pytest.mark.parametrize("executor", ["python", "native"])
@pytest.mark.parametrize("what", ["round_up", "flush_to_zero"])
def test_a_change_in_every_step_is_reported_once_with_its_first_time(
    run_with_neighbour, version, what, executor
):
    done = run_with_neighbour(version, f"DoStep * {what}", executor=executor)
    assert [row["next.y"] for row in done.rows] == USUAL_ROWS
    (line,) = warnings(done)
    assert (
        "lag: the step changed the floating-point mode (rounding, flush to zero or traps) at t "
        "= 0 s"
    ) in line


@pytest.mark.parametrize("isolation", ["none", "fmu"])
@pytest.mark.parametrize("what", CHANGES)
def test_a_change_is_restored_in_other_processes_too(run_with_neighbour, version, what, isolation):
    done = run_with_neighbour(version, f"DoStep 6 {what}", "--isolation", isolation)
    assert [row["next.y"] for row in done.rows] == USUAL_ROWS
    (line,) = warnings(done)
    assert "changed the floating-point mode" in line


@pytest.mark.parametrize("executor", ["python", "native"])
@pytest.mark.parametrize("what", CHANGES)
def test_a_change_in_initialization_is_restored(run_with_neighbour, version, what, executor):
    done = run_with_neighbour(version, f"EnterInitializationMode 1 {what}", executor=executor)
    assert [row["lag.y"] for row in done.rows] == [row["next.y"] for row in done.rows] == USUAL_ROWS
    (line,) = warnings(done)
    assert (
        f"lag: {function_name(version, 'EnterInitializationMode')} changed the floating-point mode"
        in line
    )


@pytest.mark.parametrize("what", CHANGES)
def test_a_change_by_a_component_of_an_iterated_loop_is_restored(run_with_neighbour, version, what):
    ring = [{"from": "lag.y", "to": "next.u"}, {"from": "next.y", "to": "lag.u"}]
    usual = run_with_neighbour(version, "", connections=ring)
    done = run_with_neighbour(version, f"DoStep 6 {what}", connections=ring)
    assert len(done.rows) == len(usual.rows)
    (line,) = warnings(done)
    assert "changed the floating-point mode" in line


@pytest.mark.parametrize("isolation", ["none", "run", "fmu"])
@pytest.mark.parametrize(
    "order", ["load 1 flush_to_zero", "Instantiate 1 round_up", "Instantiate 1 fp_traps"]
)
def test_a_mode_that_comes_with_the_binary_is_changed_back(
    fmus, runner, tmp_path, version, order, isolation
):
    """Code compiled for fast mathematics does that; the other components and cosim itself would
    compute in this mode.
    """
    file = scenario(tmp_path, fmus(version, order))
    done = runner.cosim(
        tmp_path, "run", file, "--output-dir", "out", "--no-report", "--isolation", isolation
    )
    assert done.code == 0, done.err
    assert (
        "WARNING lag: changed the floating-point mode of the process; it was changed back"
        in done.err
    )
    assert [row["lag.y"] for row in done.rows] == USUAL_ROWS
