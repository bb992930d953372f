"""A session in Python: step, read, set, save, restore and reset a scenario."""

import asyncio
import gc
import math
import os
import subprocess
import sys
from pathlib import Path
from threading import Thread

import numpy as np
import pytest
from python_blocks import Gain, Stateless, scenario

import cosim

ROOT = Path(cosim.__file__).parents[1]


@pytest.fixture
def simulation():
    with cosim.load(scenario()) as loaded:
        yield loaded


@pytest.fixture
def demo():
    with cosim.load("demo1_box", stop_time=2) as loaded:
        yield loaded


def refusal(action, *arguments, **named):
    with pytest.raises(cosim.InputError) as error:
        action(*arguments, **named)
    return str(error.value)


def component(simulation):
    return simulation.prepared.system.components["g"]


def test_steps_give_the_bytes_of_a_run(demo):
    while demo.step():
        assert demo.get("plant.uav.position.z") == demo.result["plant.uav.position.z"][-1]
    whole = cosim.run("demo1_box", stop_time=2)
    assert all(demo.result[name].tobytes() == whole[name].tobytes() for name in whole)
    assert demo.result.kpis == whole.kpis


def test_a_run_may_begin_with_steps(demo):
    assert demo.step(50)
    assert demo.time == 0.5
    assert len(demo.result.time) == 51
    assert len(demo.run().time) == 201
    assert demo.is_finished
    assert "reached its end at t = 2 s" in refusal(demo.step)


def test_events_act_at_their_points():
    events = [{"time": 0, "set": {"g.u": 1.0}}, {"time": 0.3, "set": {"g.u": 0.0}}]
    whole = cosim.run(scenario(events=events))
    with cosim.load(scenario(events=events)) as stepped:
        assert stepped.get("g.u") == 1.0
        while stepped.step():
            pass
        assert stepped.result["g.y"].tolist() == whole["g.y"].tolist()
    assert whole["g.y"][-1] == 6.0


def test_what_is_set_acts_in_the_next_step(simulation):
    simulation.set("g.u", np.float32(3))
    assert (simulation.get("g.u"), simulation.get("g.y")) == (3.0, 0.0)
    simulation.step()
    simulation.set("g.k", 10)
    simulation.step()
    assert simulation.get("g.y") == 36.0


@pytest.mark.parametrize("name", ["a.rotor_speed", "a.external_force"])
def test_lists_of_numbers_are_checked_each_time_that_they_are_set(name):
    system = {"a": {"fmu": "cosim:fmus/ar_drone.fmu"}}
    with cosim.load(
        {"name": "x", "stop_time": 1, "step_size": 0.01, "components": system}
    ) as drone:
        size = len(drone.get(name))
        for factor in (1.0, 2.0):
            values = [factor * i for i in range(1, size + 1)]
            drone.set(name, values)
            values[0] = 7.0  # the caller's list is not kept
            assert drone.get(name) == [factor * i for i in range(1, size + 1)]
        for wrong in ([math.nan] * size, [1.0] * (size + 1), ["1"] * size, 1.0, [1e400] * size):
            assert f'set("{name}")' in refusal(drone.set, name, wrong)
        drone.set(name, np.ones(size, np.float32))
        assert drone.get(name) == [1.0] * size


def test_elements_of_an_array_that_are_set_one_after_the_other_are_all_kept():
    system = {"a": {"fmu": "cosim:fmus/fmi3/ar_drone.fmu"}}
    with cosim.load(
        {"name": "x", "stop_time": 1, "step_size": 0.01, "components": system}
    ) as drone:
        for i in (1, 2, 4):
            drone.set(f"a.rotor_speed[{i}]", 100.0 * i)
        assert drone.get("a.rotor_speed") == [100.0, 200.0, drone.get("a.rotor_speed[3]"), 400.0]


SULKING = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Sulking(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.u = 0.0
        self.register_variable(Real("u", causality=Fmi2Causality.input, start=0.0))

    def __setattr__(self, name, value):
        if name == "u" and value < 0:
            raise ValueError("u is negative")
        super().__setattr__(name, value)

    def do_step(self, current_time, step_size):
        return True
"""


def test_a_component_that_fails_to_set_a_value_fails_the_next_step(tmp_path):
    (tmp_path / "sulking.py").write_text(SULKING)
    system = {"a": {"python": f"{tmp_path}/sulking.py:Sulking"}}
    with cosim.load({"name": "x", "stop_time": 1, "step_size": 0.1, "components": system}) as run:
        run.set("a.u", 1.0)
        run.step()
        run.set("a.u", -1.0)
        with pytest.raises(
            cosim.ComponentError, match=r"a: set failed at .*ValueError: u is negative"
        ):
            run.step()


def test_arrays_and_ports_are_read_by_their_names(demo):
    assert len(demo.get("plant.uav.rotor_speed")) == 4
    assert demo.get("uav.rotor_speed") == [
        demo.get(f"uav.mixer.rotor_speed[{i}]") for i in range(1, 5)
    ]
    assert demo.get("usv.waypoint_x")[:2] == [pytest.approx(10 / 3)] * 2
    assert demo.get("plant.uav.contact.touching") is False


def test_vectors_are_read_and_set_by_their_names(demo):
    assert demo.get("plant.uav.position") == [
        demo.get(f"plant.uav.position.{axis}") for axis in "xyz"
    ]
    demo.set("plant.uav.external_force", np.array([0.5, 0.0, 0.25]))
    assert demo.get("plant.uav.external_force") == [0.5, 0.0, 0.25]
    assert 'has no variable "uav.deck"' in refusal(demo.get, "plant.uav.deck")
    assert '"uav.external_force" takes 3 values, found 2' in refusal(
        demo.set, "plant.uav.external_force", [1.0, 2.0]
    )


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        (
            "plant.uav.rotor_speed",
            [1, 2, 3, 4],
            "is fed by a connection, it cannot be set during the simulation",
        ),
        ("plant.usv.external_force.y", "a", 'is of type Float64, found "a"'),
        ("plant.usv.external_force.w", 1.0, 'has no variable "usv.external_force.w"; did you mean'),
        ("plant.uav.position.z", 1.0, "is of causality output and cannot be set"),
        ("uva.vtol.landing_time", 1.0, 'unknown component "uva"; did you mean "uav"?'),
        (3, 1.0, "name: expected the name of a variable; found 3 (int)"),
    ],
)
def test_what_cannot_be_set_is_refused_with_the_reason(demo, name, value, reason):
    assert reason in refusal(demo.set, name, value)


def test_an_element_of_an_array_is_set_alone():
    route = {
        "name": "route",
        "stop_time": 1,
        "step_size": 0.1,
        "components": {
            "a": {
                "fmu": f"{ROOT}/fmus/fmi3/strider_autopilot.fmu",
                "parameters": {"waypoint_x[2]": 7.0},
            }
        },
    }
    with cosim.load(route, {"a.waypoint_x[3]": 8.0}) as simulation:
        assert simulation.get("a.waypoint_x")[:4] == [0.0, 7.0, 8.0, 0.0]
        simulation.set("a.waypoint_x[1]", 5.0)
        assert simulation.get("a.waypoint_x")[:4] == [5.0, 7.0, 8.0, 0.0]
        assert "expected" not in refusal(simulation.set, "a.waypoint_x[33]", 1.0)
        assert "Float64" in refusal(simulation.set, "a.waypoint_x[1]", "far")
    event = {"time": 0.5, "set": {"a.waypoint_x[1]": 1.0}}
    assert 'an event sets the whole array: expected a list for "waypoint_x"' in refusal(
        cosim.load, {**route, "events": [event]}
    )


def test_fixed_parameters_belong_to_load_and_reset(simulation):
    line = refusal(simulation.set, "g.mass", 2.0)
    assert "g.mass is neither a tunable parameter nor an input" in line
    assert "load() and reset() take start values as `parameters`" in line
    simulation.reset(parameters={"g.mass": 2.0})
    assert simulation.get("g.mass") == 2.0


def test_an_unknown_signal_names_the_nearest_one(demo):
    assert 'did you mean "uav.position.z"?' in refusal(demo.get, "plant.uav.positon.z")


def test_a_saved_state_is_restored_as_often_as_needed(demo):
    demo.step(120)
    state, ends = demo.save(), []
    for _ in range(2):
        demo.step(30)
        ends.append([values.tobytes() for values in demo.result.recording.columns.values()])
        demo.restore(state)
        assert (demo.time, len(demo.result.time)) == (1.2, 121)
    assert ends[0] == ends[1]
    assert demo.run().time[-1] == 2.0
    demo.restore(state)
    assert not demo.is_finished


def test_delays_belong_to_the_state():
    connection = {"from": "a.y", "to": "b.u", "delay": 3}
    document = scenario(
        components={"a": {"python": Gain}, "b": {"python": Gain}}, connections=[connection]
    )
    with cosim.load(document) as simulation:
        simulation.set("a.u", 1.0)
        simulation.step(5)
        state = simulation.save()
        whole = simulation.run()
        simulation.restore(state)
        assert simulation.run()["b.y"].tolist() == whole["b.y"].tolist()


def test_states_are_refused_with_the_reason(simulation):
    state = simulation.save()
    simulation.reset()
    assert "before it was reset" in refusal(simulation.restore, state)
    assert "expected a state that save() returned; found 3 (int)" in refusal(simulation.restore, 3)
    with cosim.load(scenario(Stateless)) as stateless:
        assert "cannot be saved: g cannot return to a state" in refusal(stateless.save)


def test_a_reset_sets_the_seeds_of_the_scenario():
    seeds = ["/components/g/arguments/k"]
    document = scenario(components={"g": {"python": Gain, "arguments": {"k": 1.0}}}, seeds=seeds)
    with cosim.load(document) as simulation:
        simulation.reset(seed=5, parameters={"g.u": 2.0})
        simulation.step()
        assert simulation.get("g.y") == 10.0
        simulation.reset()
        assert (simulation.time, simulation.get("g.k"), simulation.get("g.u")) == (0.0, 1.0, 0.0)
    with cosim.load(scenario()) as simulation:
        assert 'the scenario has no key "seeds"' in refusal(simulation.reset, seed=1)


def test_seeds_that_nothing_can_be_set_at_are_refused():
    line = refusal(cosim.load, scenario(seeds=["/components/h/arguments/k"]))
    assert line == 'scenario: $.seeds[0]: the scenario has no "/components/h"; "components" has: g'


def test_the_process_stays_as_the_caller_left_it(simulation, caplog, tmp_path, monkeypatch):
    simulation.set("g.k", -1.0)
    before = Path.cwd()
    simulation.step()
    assert Path.cwd() == before
    monkeypatch.chdir(tmp_path)
    simulation.step()
    assert Path.cwd() == tmp_path
    assert (
        caplog.text.count("g: changed the working directory of the process; it was changed back")
        == 2
    )


def test_after_a_failure_only_the_rows_are_left(simulation):
    simulation.step(3)
    simulation.set("g.k", -2.0)
    with pytest.raises(cosim.ComponentError, match="ValueError: k is -2") as error:
        simulation.step()
    assert len(error.value.result.time) == len(simulation.result.time) == 4
    assert "the simulation failed: g: do_step failed at t = 0.3 s" in refusal(simulation.step)
    simulation.reset()
    assert simulation.step()


def test_an_interrupt_in_a_step_ends_the_simulation_but_not_between_steps(simulation):
    simulation.step()
    simulation.set("g.k", -3.0)
    with pytest.raises(KeyboardInterrupt):
        simulation.step()
    assert "the simulation failed: interrupted" in refusal(simulation.step)
    simulation.reset()
    with pytest.raises(KeyboardInterrupt):
        raise KeyboardInterrupt
    assert simulation.step()


def test_a_closed_simulation_keeps_its_result(simulation):
    simulation.run()
    simulation.close()
    simulation.close()
    assert len(simulation.result.time) == 11
    assert component(simulation).freed == 1
    assert "is closed; reset() opens it again" in refusal(simulation.step)


def test_components_of_a_forgotten_simulation_are_freed():
    forgotten = cosim.load(scenario())
    forgotten.step()
    owned = component(forgotten)
    del forgotten
    gc.collect()
    assert owned.freed == 1


def test_an_observer_cannot_step(simulation):
    lines = []
    simulation.run([lambda *_: lines.append(refusal(simulation.step))])
    assert set(lines) == {
        "the simulation is stepping; a component or an observer cannot step or change it meanwhile"
    }


def test_several_simulations_in_several_threads_do_not_disturb_each_other():
    simulations = [cosim.load("demo1_box", stop_time=1) for _ in range(3)]

    def step(simulation):
        while simulation.step():
            pass

    threads = [Thread(target=step, args=(simulation,)) for simulation in simulations]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    first, *others = (
        simulation.result["plant.uav.position.z"].tobytes() for simulation in simulations
    )
    assert all(other == first for other in others)
    for simulation in simulations:
        simulation.close()


def test_a_simulation_in_an_event_loop(simulation):
    async def run():
        return await asyncio.to_thread(simulation.run)

    assert len(asyncio.run(run()).time) == 11


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs fork")
def test_a_fork_leaves_the_simulation_to_its_parent(tmp_path):
    program = (
        "import os, sys, cosim\n"
        "simulation = cosim.load('free_flight', stop_time=1, isolation='fmu'); simulation.step()\n"
        "if os.fork() == 0:\n    del simulation; sys.exit(0)\n"
        "os.wait(); print(len(simulation.run().time)); simulation.close()\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.stdout.strip(), done.returncode) == ("101", 0), done.stderr


def test_a_prefix_is_named_as_such(demo):
    assert '"plant.uav" is a prefix, expected a variable such as "plant.uav.' in refusal(
        demo.get, "plant.uav"
    )
