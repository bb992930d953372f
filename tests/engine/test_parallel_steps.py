"""Stages on threads: the decision for threads, and unchanged results."""

from fractions import Fraction

import pytest
from slow_fmus import slow_fmu
from systems import endpoint, make_system

from cosim.components.fmi import FmuFile, create_component
from cosim.core.errors import ComponentError
from cosim.core.time_grid import exact_fraction
from cosim.engine.plan_run import simulate
from cosim.engine.settings import Event, Settings

pytestmark = pytest.mark.usefixtures("executor")


@pytest.fixture(scope="module")
def long(tmp_path_factory):
    """Two FMU files whose steps take 0.3 ms."""
    folder = tmp_path_factory.mktemp("busy")
    return [slow_fmu(folder, name, 3e-4, wait=True) for name in ("a", "b")]


@pytest.fixture(autouse=True)
def two_processors(monkeypatch):
    monkeypatch.setattr("cosim.engine.parallel.available_processors", lambda: 2)


def simulate_files(files, parallel, wires="", stop="0.3", events=(), start_values=None):
    """Simulate one component per file (c0, c1, ...) in one stage."""
    loaded = {path: FmuFile(path) for path in files}
    components = {f"c{i}": create_component(loaded[path], f"c{i}") for i, path in enumerate(files)}
    columns = {
        f"{name}.{output}": endpoint(f"{name}.{output}")
        for name in components
        for output in ("y", "i_out", "e_out")
    }
    built = make_system(components, wires, parallel=parallel, start_values=start_values or {})
    return simulate(
        built,
        Settings(Fraction(0), exact_fraction(stop), exact_fraction("0.01"), columns, events=events),
    )


def on_threads(run):
    """Return the components that stepped on another thread than the first one."""
    return {
        name.partition(".")[0]
        for name, values in run.recording.columns.items()
        if name.endswith("e_out") and values[-1]
    }


RING = "c0.y > c1.u, c1.y > c2.u, c2.y >2 c0.u"


def test_long_steps_of_two_files_run_at_the_same_time(long):
    assert len(on_threads(simulate_files(long, "auto"))) == 1
    assert on_threads(simulate_files(long, False)) == set()


def test_short_steps_run_on_one_thread(tmp_path):
    quick = [slow_fmu(tmp_path, name, 0.0) for name in ("a", "b")]
    assert on_threads(simulate_files(quick, "auto")) == set()
    assert len(on_threads(simulate_files(quick, True))) == 1


def test_one_file_steps_one_instance_at_a_time_unless_the_scenario_says_so(long):
    one, other = long
    run = simulate_files([one, one, other, other], "auto")
    assert {run.recording.columns[f"c{i}.i_out"][-1] for i in range(4)} == {1}
    assert on_threads(run) in ({"c0", "c1"}, {"c2", "c3"})
    assert simulate_files([one, one], True).recording.columns["c0.i_out"][-1] == 2


def test_results_are_those_of_one_thread(long):
    events = [
        Event(exact_fraction("0.1"), {"c1": {"fail_time": 1e6}}),
        Event(exact_fraction("0.02"), {"c2": {"i_in": 3}}),
    ]
    starts = {"c0": {"y_start": 0.5}}
    serial, parallel = (
        simulate_files([*long, long[0]], way, RING, events=events, start_values=starts)
        for way in (False, True)
    )
    assert serial.failure is None
    assert parallel.failure is None
    for name in ("c0.y", "c1.y", "c2.y"):
        assert (
            parallel.recording.columns[name].tobytes() == serial.recording.columns[name].tobytes()
        )


def test_a_failure_on_a_thread_names_component_function_and_time(long):
    starts = {name: {"fail_time": 0.1} for name in ("c0", "c1")}
    serial, parallel = (simulate_files(long, way, start_values=starts) for way in (False, True))
    assert isinstance(parallel.failure, ComponentError)
    assert str(parallel.failure) == str(serial.failure)
    assert len(parallel.recording.time) == len(serial.recording.time)
