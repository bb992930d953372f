"""Names, prefixes and ports in connections and parameters of scenarios."""

import pytest
from systems import connection

import cosim
from cosim.core.time_grid import exact_fraction
from cosim.scenario import load

WHOLE_PLANT = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Whole(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.x = 0.0
        x = Real("position.x", causality=Fmi2Causality.output, getter=lambda: self.x)
        self.register_variable(x, nested=False)

    def do_step(self, current_time, step_size):
        return True
"""

PAIR = [connection("plant.ship", "pilot.vehicle"), connection("pilot.motor", "plant.ship.motor")]


def columns(file, **more):
    result = cosim.run(file, **more)
    return {name: result[name].tolist() for name in result}


def test_prefixes_connect_the_inputs_that_the_target_declares(folder):
    pilot = folder.block("Controller", parameters={"gain": [1.0, 10.0]})
    file = folder.scenario({"pilot": pilot, "plant": folder.block("Plant")}, PAIR)
    prepared = load(file)
    pairs = [f"{c.source} > {c.target}" for c in prepared.system.connections]
    assert pairs == [
        "plant.ship.position.x > pilot.vehicle.position.x",
        "pilot.motor[1] > plant.ship.motor[1]",
        "pilot.motor[2] > plant.ship.motor[2]",
    ]
    prepared.free()
    assert columns(file)["plant.ship.position.x"] == [0, 1, 2, 3]
    assert columns(file)["plant.ship.position.y"] == [1, 11, 21, 31]


def test_components_step_in_the_listed_order_by_default(folder):
    gains = {"a": folder.block("Gain", parameters={"u": 1.0}), "b": folder.block("Gain")}
    listed = folder.scenario(gains, [connection("a.y", "b.u")], stop_time=1)
    assert columns(listed)["b.y"] == [0, 4]
    together = folder.scenario(
        gains,
        [connection("a.y", "b.u")],
        stop_time=1,
        algorithm={"kind": "staged", "stages": [["a", "b"]]},
    )
    assert columns(together)["b.y"] == [0, 0]


def test_a_connection_of_single_variables_overrides_a_prefix(folder):
    components = {
        "pilot": folder.block("Controller"),
        "gain": folder.block("Gain"),
        "plant": folder.block("Plant"),
    }
    file = folder.scenario(components, [*PAIR, connection("gain.y", "plant.ship.motor[2]")])
    prepared = load(file)
    fed = {str(c.target): str(c.source) for c in prepared.system.connections}
    prepared.free()
    assert fed["plant.ship.motor[1]"] == "pilot.motor[1]"
    assert fed["plant.ship.motor[2]"] == "gain.y"


def test_an_input_below_a_prefix_without_output_may_be_set_by_a_parameter(folder):
    plant = folder.block("Plant", parameters={"ship.motor[2]": 5.0})
    file = folder.scenario(
        {"gain": folder.block("Gain"), "plant": plant},
        [connection("gain.y", "plant.ship.motor[1]")],
    )
    assert columns(file)["plant.ship.position.y"] == [1, 6, 11, 16]


def test_a_component_alone_is_a_prefix_too(folder):
    folder.write(
        {
            "components": {"head": folder.block("Controller")},
            "ports": {"inputs": {"vehicle": "head.vehicle"}},
        },
        "n.json",
    )
    (folder.path / "plant.py").write_text(WHOLE_PLANT)
    components = {"plant": {"python": "plant.py:Whole"}, "pilot": {"system": "n.json"}}
    prepared = load(folder.scenario(components, [connection("plant", "pilot.vehicle")]))
    prepared.free()
    assert [f"{c.source} > {c.target}" for c in prepared.system.connections] == [
        "plant.position.x > pilot.head.vehicle.position.x"
    ]


def test_a_port_may_name_variables_that_only_some_inner_components_have(folder):
    components = {"head": folder.block("Controller"), "tail": folder.block("Controller")}
    folder.write(
        {
            "components": components,
            "ports": {"inputs": {"vehicle": ["head.vehicle", "tail.gains"]}},
        },
        "n.json",
    )
    file = folder.scenario(
        {"plant": folder.block("Plant"), "pilot": {"system": "n.json"}},
        [connection("plant.ship.position.x", "pilot.vehicle.position.x")],
    )
    prepared = load(file)
    prepared.free()
    assert [str(c.target) for c in prepared.system.connections] == ["pilot.head.vehicle.position.x"]


def nested(folder):
    folder.write(
        {
            "components": {
                "head": folder.block("Controller", parameters={"gain": [1, 1]}),
                "tail": folder.block("Gain"),
            },
            "connections": [connection("head.motor[2]", "tail.u")],
            "ports": {
                "inputs": {"vehicle": ["head.vehicle"], "offset": "head.offset"},
                "outputs": {"motor": "head.motor", "extra": "tail.y"},
                "parameters": {"strength": "head.gain"},
            },
        },
        "nested.json",
    )
    return {"pilot": {"system": "nested.json"}, "plant": folder.block("Plant")}


def test_a_nested_system_is_wired_through_its_ports_and_recorded_by_inner_and_port_names(folder):
    file = folder.scenario(nested(folder), PAIR)
    result = columns(file)
    assert result["plant.ship.position.x"] == [0, 1, 2, 3]
    assert result["pilot.head.motor[1]"] == result["pilot.motor[1]"] == [0, 1, 1, 1]
    assert result["pilot.tail.y"] == result["pilot.extra"] == [0, 2, 2, 2]


def test_parameters_reach_inner_components_by_port_or_by_name_and_outer_values_win(folder):
    components = nested(folder)
    components["pilot"]["parameters"] = {"strength": [3, 3], "tail.k": 10.0, "offset": 0.5}
    file = folder.scenario(components, PAIR)
    assert columns(file)["pilot.extra"][-1] == 35.0
    assert columns(file, parameters={"pilot.strength": [4, 4]})["pilot.extra"][-1] == 45.0


def test_two_levels_of_nesting(folder):
    components = nested(folder)
    ports = {"inputs": {"vehicle": "inner.vehicle"}, "outputs": {"motor": "inner.motor"}}
    folder.write({"components": {"inner": {"system": "nested.json"}}, "ports": ports}, "outer.json")
    file = folder.scenario({"pilot": {"system": "outer.json"}, "plant": components["plant"]}, PAIR)
    result = columns(file, parameters={"pilot.inner.head.gain[1]": 7.0})
    assert result["plant.ship.position.x"][-1] == 21
    assert "pilot.inner.head.motor[1]" in result


def test_a_period_of_a_nested_system_holds_for_all_inside(folder):
    components = nested(folder)
    components["pilot"]["period"] = 3
    prepared = load(folder.scenario(components, PAIR))
    prepared.free()
    assert {name: float(period) for name, period in prepared.system.periods.items()} == {
        "pilot.head": 3.0,
        "pilot.tail": 3.0,
    }


def test_input_profiles_feed_inputs_with_the_value_at_the_communication_point(folder):
    (folder.path / "profile.csv").write_text("time,ramp\n0,0\n2,4\n")
    inputs = [{"file": "profile.csv", "to": {"ramp": ["a.u", "b.u"]}}]
    gains = {"a": folder.block("Gain", parameters={"k": 1.0}), "b": folder.block("Gain")}
    result = columns(folder.scenario(gains, inputs=inputs))
    assert result["inputs.0.ramp"] == [0, 2, 4, 4]
    assert result["a.y"] == [0, 0, 2, 4]
    assert result["b.y"] == [0, 0, 4, 8]


def test_a_profile_with_hold_jumps_at_its_rows(folder):
    (folder.path / "profile.csv").write_text("time,step\n0,1\n1.5,2\n2,3\n")
    inputs = [{"file": "profile.csv", "to": {"step": "a.u"}, "interpolation": "hold"}]
    result = columns(
        folder.scenario({"a": folder.block("Gain")}, inputs=inputs, stop_time=2, step_size=0.5)
    )
    assert result["inputs.0.step"] == [1, 1, 1, 2, 3]


@pytest.mark.parametrize(("step_size", "count"), [("1/10", 9), ("1/100", 90), ("1/1000", 900)])
def test_a_profile_with_hold_jumps_exactly_at_its_rows_despite_rounded_times(
    folder, step_size, count
):
    """0.7 + 0.1 is less than 0.8."""
    step = exact_fraction(step_size)
    rows = "".join(f"{float(n * step)!r},{n}\n" for n in range(count + 1))
    (folder.path / "profile.csv").write_text(f"time,step\n{rows}")
    inputs = [{"file": "profile.csv", "to": {"step": "a.u"}, "interpolation": "hold"}]
    result = columns(
        folder.scenario(
            {"a": folder.block("Gain")}, inputs=inputs, stop_time="9/10", step_size=step_size
        )
    )
    assert result["inputs.0.step"] == list(range(count + 1))


def test_events_set_inputs_and_tunable_parameters_through_ports_too(folder):
    events = [
        {"time": 1, "set": {"pilot.offset": 1.0}},
        {"time": 2, "set": {"pilot.tail.k": 100.0}},
    ]
    result = columns(folder.scenario(nested(folder), PAIR, events=events))
    assert result["pilot.extra"] == [0, 2, 4, 200]


def test_times_may_be_fractions(folder):
    result = cosim.run(folder.scenario({"a": folder.block("Gain")}, stop_time=1, step_size="1/60"))
    assert len(result.time) == 61
    assert result.time[1] == 1 / 60


def test_recording_chooses_signals_by_pattern_and_interval(folder):
    record = {"signals": ["*.position.*"], "interval": 1}
    components = {"pilot": folder.block("Controller"), "plant": folder.block("Plant")}
    result = cosim.run(folder.scenario(components, PAIR, record=record))
    assert list(result) == ["plant.ship.position.x", "plant.ship.position.y"]


def test_json_pointers_change_any_part_of_the_scenario(folder):
    file = folder.scenario({"plant": folder.block("Plant", arguments={"vehicle": "ship"})})
    result = cosim.run(file, {"/components/plant/arguments/vehicle": "boat"}, stop_time=1)
    assert "plant.boat.position.x" in result


def test_a_component_that_fails_keeps_its_rows(folder):
    file = folder.scenario({"a": folder.block("FailingBlock")})
    with pytest.raises(cosim.ComponentError) as failure:
        cosim.run(file)
    assert str(failure.value).startswith(
        "a: do_step failed at t = 2 s: ValueError: tilt beyond limit (pythonfmu_blocks.py:"
    )
    assert failure.value.result["a.y"].tolist() == [0, 1, 2]


def test_a_base_exception_in_do_step_is_a_component_error(folder):
    with pytest.raises(
        cosim.ComponentError,
        match="a: do_step failed at t = 0 s: BaseException: index out of bounds",
    ):
        cosim.run(folder.scenario({"a": folder.block("BaseExceptionBlock")}))
