"""Invalid scenarios: all problems are reported at once, each with file, line and JSON path, before the first step."""

import numpy as np
import pytest
from systems import connection

import cosim
from cosim.core import resources
from cosim.core.errors import did_you_mean


def lines(file, **more):
    with pytest.raises(cosim.InputError) as refusal:
        cosim.run(file, **more)
    return [str(problem).replace(f"{file.parent}/", "") for problem in refusal.value.problems]


def refused(folder, components, connections=(), **more):
    return lines(folder.scenario(components, list(connections), **more))


def test_all_problems_are_reported_at_once(folder):
    gain = folder.block("Gain")["python"]
    file = folder.write(
        f"""{{"name": "bad", "stop_time": 3, "stop_time": 3.5, "step_size": 1, "colour": "red",
 "components": {{
  "a": {{"parameters": {{"kk": 1, "k": "x", "u": NaN}}, "python": "{gain}"}},
  "b": {{"python": "{gain}"}},
  "c": {{"fmu": "missing.fmu"}}}},
 "connections": [
  {{"from": "a.y", "to": "b.u"}}, {{"from": "b.y", "to": "b.u"}},
  {{"from": "a.u", "to": "b.u"}}, {{"from": "d.y", "to": "a.u"}},
  {{"from": "a.y", "too": "b.u"}}],
 "algorithm": {{"stages": [["a", "e"]]}}, "record": {{"signals": ["a.z"]}},
 "kpis": [{{"name": "k", "python": "none.py:f"}}], "checks": [{{"kpi": "kk.x", "max": 1}}],
 "events": [{{"time": 0.5, "set": {{"a.q": 1}}}}]}}"""
    )
    assert [line.removeprefix("scenario.json:") for line in lines(file)] == [
        "1:33: $.stop_time: duplicate key",
        "3:48: $.components.a.parameters.u: NaN is not allowed, expected a finite number",
        '9:3: $.connections[4].to: the key "to" is missing',
        '9:19: $.connections[4].too: unknown key; did you mean "to"?',
        "1:67: $.colour: unknown key",
        '5:3: $.components.c: FMU "missing.fmu" does not exist',
        '3:24: $.components.a.parameters.kk: component "a" has no variable "kk"; did you mean "k"?',
        '3:33: $.components.a.parameters.k: "k" is of type Float64, found "x"',
        "7:33: $.connections[1]: input b.u is connected twice: it is already fed by a.y",
        "8:4: $.connections[2].from: a.u is an input, expected an output",
        '8:34: $.connections[3].from: unknown component "d"; valid: a, b, c',
        '10:64: $.record.signals[0]: no output matches "a.z"; did you mean "a.y"?',
        '12:35: $.events[0].set["a.q"]: component "a" has no variable "q"; valid: u, k',
        '10:16: $.algorithm.stages: unknown component "e"; valid: a, b',
        '10:16: $.algorithm.stages: component "b" is in no stage, so it would never step',
        "1:33: $.stop_time: 3.5 s is no multiple of the step size 1.0 s",
        "12:13: $.events[0]: event time 0.5 s lies between two communication points (1.0 s apart)",
        '11:11: $.kpis[0]: file "none.py" does not exist',
        '11:62: $.checks[0].kpi: no KPI "kk.x"; did you mean "k"?',
    ]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"stop_tme": 1}, '$.stop_tme: unknown key; did you mean "stop_time"?'),
        ({"step_size": 0}, "$.step_size: expected a positive number of seconds; found 0"),
        ({"step_size": "fast"}, 'expected seconds as a number or as a fraction in text such as "1/60"; found "fast"'),
        (
            {"start_time": 1e15, "stop_time": 1e15 + 3, "step_size": 0.01},
            "$.step_size: a step of 0.01 s is not resolved at t = 1000000000000003.0 s, where the times of components are 0.125",
        ),
        (
            {"start_time": -1e15, "stop_time": -1e15 + 3, "step_size": 0.125},
            "a step of 0.125 s is not resolved at t = 10000000",
        ),
        ({"start_time": 2**53, "stop_time": 2**53}, "a step of 1.0 s is not resolved"),
        ({"start_time": 1e10, "stop_time": 1e10 + 1, "step_size": 0.0001}, "a step of 0.0001 s is not resolved at t = 1000"),
        ({"stop_time": 2.5}, "$.stop_time: 2.5 s is no multiple of the step size 1.0 s"),
        ({"record": {"signals": ["a.z"]}}, '$.record.signals[0]: no output matches "a.z"; did you mean "a.y"?'),
        ({"record": {"interval": 1.5}}, "$.record.interval: recording interval 1.5 s is no multiple of the step size 1.0 s"),
        ({"events": [{"time": 0.5, "set": {"a.u": 1}}]}, "$.events[0]: event time 0.5 s lies between two"),
        ({"events": [{"time": 1, "set": {"a.q": 1}}]}, '$.events[0].set["a.q"]: component "a" has no variable "q"'),
        ({"algorithm": {"stages": [["a"], ["b"]]}}, '$.algorithm.stages: unknown component "b"; valid: a'),
        ({"algorithm": {"stages": []}}, '$.algorithm.stages: component "a" is in no stage'),
        ({"algorithm": {"kind": "magic", "stages": [["a"]]}}, "$.algorithm.kind: expected 'staged'"),
        ({"connections": [connection("a.y", "a.u", delay=-1)]}, "$.connections[0].delay: expected greater than or equal to 0"),
        ({"connections": [connection("a.y", "a.u", delay=1.5)]}, "$.connections[0].delay: expected a valid integer"),
        ({"connections": [connection("a.y", "a")]}, "$.connections[0]: input a.u has no matching output a.y.u"),
        ({"connections": [connection("a.u", "a.u")]}, "$.connections[0].from: a.u is an input, expected an output"),
        ({"connections": [connection("a.y", "a.y")]}, "$.connections[0].to: a.y is an output, expected an input"),
        ({"connections": [connection("a.yy", "a.u")]}, 'component "a" has no output "yy"; did you mean "y"?'),
        ({"connections": [connection("aa.y", "a.u")]}, 'unknown component "aa"; did you mean "a"?'),
        ({"connections": [connection("a.y", "a.u")] * 2}, "input a.u is connected twice: it is already fed by a.y"),
        ({"kpis": [{"name": "k", "python": "none.py:f"}]}, '$.kpis[0]: file "none.py" does not exist'),
        ({"checks": [{"kpi": "k.x", "max": 1}]}, '$.checks[0].kpi: no KPI "k.x"'),
        ({"checks": [{"kpi": "k.x"}]}, 'expected at least one of "min", "max", "equals"'),
        ({"inputs": [{"file": "no.csv", "to": {"x": "a.u"}}]}, "no.csv: No such file"),
    ],
)
def test_one_mistake_is_reported_in_one_line(folder, change, line):
    found = refused(folder, {"a": folder.block("Gain")}, **change)
    assert len(found) == 1
    assert found[0].startswith("scenario.json:1:")
    assert line in found[0]


@pytest.mark.parametrize(
    ("component", "line"),
    [
        ({"fmuu": "x.fmu"}, '$.components.a.fmuu: unknown key; did you mean "fmu"?'),
        ({}, "expected exactly one of fmu, python, modelica, system; found none"),
        ({"fmu": "x.fmu", "python": "y.py:Y"}, "found fmu and python"),
        ({"fmu": "missing.fmu"}, 'missing.fmu" does not exist'),
        ({"python": "missing.py:X"}, 'file "missing.py" does not exist'),
        ({"python": "x"}, 'expected "file.py:name", found "x"'),
        ({"system": "missing.json"}, "No such file or directory"),
        ({"modelica": "missing.mo:X"}, 'file "missing.mo" does not exist'),
    ],
)
def test_a_component_with_an_invalid_source_is_reported_once_and_without_consequences(folder, component, line):
    found = refused(folder, {"a": component, "b": folder.block("Gain")}, [connection("a.y", "b.u"), connection("b.y", "a.u")])
    assert len(found) == 1
    assert line in found[0]


@pytest.mark.parametrize(
    ("parameters", "line"),
    [
        ({"number": 1.5}, '"number" is of type Int32, found 1.5'),
        ({"flag": 1}, '"flag" is of type Boolean, found 1'),
        ({"text": 3}, '"text" is of type String, found 3'),
        ({"out": True}, '"out" is of causality output and cannot be set'),
        ({"numbr": 1}, 'component "a" has no variable "numbr"; did you mean "number"?'),
        ({"number": {"x": 1}}, "expected a number, true, false, a text, or a list of these"),
    ],
)
def test_values_must_have_the_type_of_their_variables(folder, parameters, line):
    found = refused(folder, {"a": folder.block("Typed", parameters=parameters)})
    assert len(found) == 1
    assert line in found[0]


def test_ranges_of_an_fmu_are_respected(folder, probes):
    found = refused(folder, {"a": {"fmu": str(probes[2]), "parameters": {"y_start": 11}}})
    assert len(found) == 1
    assert '"y_start" must lie in -10.0 ... 10.0, found 11' in found[0]


@pytest.mark.parametrize(
    ("name", "value", "line"),
    [
        ("int8_in", 300, '"int8_in" must lie in -128 ... 127, found 300'),
        ("uint8_in", -1, '"uint8_in" must lie in 0 ... 255, found -1'),
        ("int32_in", 2**40, '"int32_in" must lie in -2147483648 ... 2147483647'),
        ("int64_in", 2**63, '"int64_in" must lie in'),
        ("uint64_in", 2**64 + 5, '"uint64_in" must lie in 0 ... 18446744073709551615'),
        ("f_in", 1e300, '"f_in" must lie in -3.4'),
        ("e_in", 7, '"e_in" is one of off (1), on (2), found 7'),
        ("e_in", "onn", '"e_in" is one of off (1), on (2), found "onn"; did you mean "on"?'),
    ],
)
def test_values_outside_the_range_of_their_type_are_refused(folder, probes, name, value, line):
    assert line in refused(folder, {"a": {"fmu": str(probes[3]), "parameters": {name: value}}})[0]


@pytest.mark.parametrize("value", [2, "on"])
def test_enumeration_items_can_be_set_by_number_or_name(folder, probe, value):
    result = cosim.run(folder.scenario({"a": {"fmu": str(probe), "parameters": {"e_in": value}}}))
    assert result["a.e_out"][-1] == 2


def test_an_event_must_set_all_elements_of_an_array(folder, probes):
    """The elements that are missing would get their start values again."""
    events = [{"time": 1, "set": {"a.v_in": [11.0]}}]
    assert "takes 3 values, found 1" in refused(folder, {"a": {"fmu": str(probes[3])}}, events=events)[0]


def test_a_port_does_not_hide_a_component_of_the_nested_system(folder):
    parts = {"left": folder.block("Gain"), "right": folder.block("Gain")}
    folder.write({"components": parts, "ports": {"outputs": {"right": "left"}}}, "inner.json")
    (line,) = refused(folder, {"u": {"system": "inner.json"}})
    assert line.startswith("inner.json:")
    assert '"right" is already the name of a component here' in line


def test_a_list_that_is_too_long_is_reported_with_the_largest_length(folder):
    found = refused(folder, {"a": folder.block("Controller", parameters={"gain": [1, 2, 3]})})
    assert [line.split(": ", 1)[1] for line in found] == [
        '$.components.a.parameters.gain: "gain" takes at most 2 values, found 3'
    ]


def test_periods_must_fit_step_size_and_duration(folder):
    found = refused(folder, {"a": folder.block("Gain", period=1.5), "b": folder.block("Gain", period=2)})
    assert [line.split(": $.")[1] for line in found] == [
        "components.a.period: period 1.5 s is no multiple of the step size 1.0 s",
        "components.b.period: the duration 3.0 s is no multiple of the period 2.0 s",
    ]


def test_a_period_inside_a_nested_system_is_found_in_its_file(folder):
    folder.write({"components": {"g": folder.block("Gain", period=1.5)}}, "n.json")
    (line,) = refused(folder, {"a": {"system": "n.json"}})
    assert line.startswith("n.json:1:")
    assert "$.components.g.period: period 1.5 s is no multiple of the step size 1.0 s" in line


def test_units_of_different_quantities_are_refused(folder):
    fmus = resources.root() / "fmus"
    components = {name: {"fmu": str(fmus / f"{name}.fmu")} for name in ("vtol", "attitude_controller")}
    (line,) = refused(folder, components, [connection("vtol.altitude_reference", "attitude_controller.roll_command")])
    assert line.endswith(
        'vtol.altitude_reference cannot feed attitude_controller.roll_command: units "m" and "rad" measure different quantities'
    )


def test_arguments_may_have_the_parameter_names_of_the_loader(folder):
    cosim.load(folder.scenario({"a": folder.block("Gain", arguments={"kind": 1, "reference": "x"})})).free()


def test_the_instance_name_cannot_be_an_argument(folder):
    (line,) = refused(folder, {"a": folder.block("Gain", arguments={"instance_name": "b"})})
    assert 'Gain receives its "instance_name" from the scenario' in line


def test_problems_of_a_python_component_are_located_at_its_arguments(folder):
    world = str(resources.root() / "plant_src/world.py:World")
    vehicles = {"uav": {"model": "ar_dron", "position": [0, 0, 1]}, "usv": {"model": "strider", "position": [0]}}
    found = refused(folder, {"plant": {"python": world, "arguments": {"vehicles": vehicles}}})
    assert [line.split(": ", 1)[1] for line in found] == [
        '$.components.plant.arguments.vehicles.uav.model: unknown vehicle model "ar_dron"; did you mean "ar_drone"?',
        "$.components.plant.arguments.vehicles.usv.position: found [0], expected a list of 2 numbers [x, y]",
    ]


def test_incompatible_units_and_types_are_refused(folder, probes):
    xml = {"a": {"fmu": str(probes[2])}, "b": {"fmu": str(probes[3])}}
    wires = [
        connection("a.s_out", "b.u"),
        connection("a.b_out", "b.int8_in"),
        connection("b.uint64_out", "a.u"),
        connection("a.i_out", "b.f_in"),
    ]
    assert [line.split(": ", 2)[2] for line in refused(folder, xml, wires)] == [
        "a.s_out cannot feed b.u: type String cannot be converted to Float64",
        "a.b_out cannot feed b.int8_in: type Boolean cannot be converted to Int8",
        "b.uint64_out cannot feed a.u: type UInt64 cannot be converted to Float64",
        "a.i_out cannot feed b.f_in: type Int32 cannot be converted to Float32",
    ]


def test_a_prefix_without_a_matching_output_names_the_input(folder):
    components = {"pilot": folder.block("Controller"), "gain": folder.block("Gain")}
    (line,) = refused(
        folder, {**components, "plant": folder.block("Plant")}, [connection("plant.ship.position", "pilot.vehicle")]
    )
    assert "input pilot.vehicle.position.x has no matching output plant.ship.position.position.x" in line


def test_problems_in_a_nested_file_are_located_in_that_file(folder):
    folder.write({"components": {"g": folder.block("Gain", parameters={"kk": 1})}, "ports": {"outputs": {"y": "h.y"}}}, "n.json")
    found = refused(folder, {"a": {"system": "n.json"}})
    assert [line.split(":")[0] for line in found] == ["n.json", "n.json"]
    assert 'component "a.g" has no variable "kk"' in found[0]
    assert 'unknown component "h"' in found[1]


def test_a_system_that_contains_itself_is_refused(folder):
    folder.write({"components": {"again": {"system": "n.json"}}}, "n.json")
    (line,) = refused(folder, {"a": {"system": "n.json"}})
    assert 'the nested system "n.json" contains itself' in line


def test_an_unknown_port_is_reported_with_the_nearest_name(folder):
    folder.write({"components": {"g": folder.block("Gain")}, "ports": {"inputs": {"command": "g.u"}}}, "n.json")
    components = {"a": {"system": "n.json"}, "b": folder.block("Gain")}
    (line,) = refused(folder, components, [connection("b.y", "a.comand")])
    assert 'nested system "a" has no input port "comand"; did you mean "command"?' in line


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "expected a JSON value"),
        ('{"name": "x",}', "expected a key in double quotes"),
        ('{"name": "x"} x', "expected the end of the file"),
        ('{"name" "x"}', "expected ':'"),
        ("[" * 200, "nested more than 100 levels deep"),
        ('{"name": tru}', "expected a JSON value"),
        ('{"name": "x', "Unterminated string"),
    ],
)
def test_text_that_is_not_json_is_reported_with_its_position(folder, text, line):
    (found,) = lines(folder.write(text))
    assert found.startswith("scenario.json:1:")
    assert line in found


def test_a_nested_system_with_times_is_refused(folder):
    folder.write({"components": {"g": folder.block("Gain")}, "stop_time": 3, "step_size": 1}, "n.json")
    found = refused(folder, {"a": {"system": "n.json"}})
    assert [line.split(";")[0].split(": ", 1)[1] for line in found] == ["$.stop_time: unknown key", "$.step_size: unknown key"]


@pytest.mark.parametrize("components", [None, [], 3, {}])
def test_without_components_there_are_no_further_problems_with_components(folder, components):
    content = {"name": "x", "stop_time": 1, "step_size": 1, "connections": [connection("a.y", "b.u")]}
    if components is not None:
        content["components"] = components
    (line,) = lines(folder.write({**content, "algorithm": {"stages": [["a"]]}, "record": {"signals": ["a.y"]}}))
    assert "$.components" in line


def test_an_invalid_step_size_is_reported_without_consequences(folder):
    gain = folder.block("Gain", period=0.3)
    (line,) = refused(folder, {"a": gain}, step_size="fast", events=[{"time": 0.7, "set": {"a.u": 1}}])
    assert "$.step_size: expected seconds" in line


def test_an_invalid_stop_time_does_not_hide_an_invalid_event(folder):
    found = refused(folder, {"a": folder.block("Gain")}, stop_time=2.5, events=[{"time": 0.7, "set": {"a.u": 1}}])
    assert [line.split(": ")[1] for line in found] == ["$.stop_time", "$.events[0]"]


def test_the_name_of_a_scenario_must_be_usable_as_a_folder_name(folder):
    (line,) = refused(folder, {"a": folder.block("Gain")}, name="../evil")
    assert "$.name: expected a name" in line


FUNCTIONS = """
from cosim.results.kpi import Prefix, Signal

def good(result, signal, limit=1.0): ...

def error(result, vehicle: Prefix, target: float | Signal = 0.0):
    if not result:
        return nothing()
    return {"largest": 1.0, "final_error": 0.0, **{f"time[{i}]": 0.0 for i in range(3)}}

def unsaid(result, vehicle: Prefix):
    if not result:
        return {"found": False}
    values = {"value": 1.0}
    return values
"""


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"sgnal": "a.y"}, '"good" takes no argument "sgnal"; did you mean "signal"?'),
        ({}, '"good" needs the argument signal'),
    ],
)
def test_arguments_of_kpis_are_checked_before_the_run(folder, arguments, line):
    (folder.path / "f.py").write_text(FUNCTIONS)
    kpi = {"name": "k", "python": "f.py:good", "arguments": arguments}
    (found,) = refused(folder, {"a": folder.block("Gain")}, kpis=[kpi])
    assert found.endswith(f"$.kpis[0]: {line}")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        ({"vehicle": "a.shpi"}, 'vehicle: no signal below "a.shpi" is recorded; did you mean "a.ship"?'),
        (
            {"vehicle": "a.ship", "target": "a.ship"},
            'target: no signal "a.ship" is recorded; valid: a.ship.position.x, a.ship.position.y',
        ),
    ],
)
def test_signals_in_arguments_of_functions_are_checked_before_the_run(folder, arguments, line):
    (folder.path / "f.py").write_text(FUNCTIONS)
    kpi = {"name": "k", "python": "f.py:error", "arguments": arguments}
    (found,) = refused(folder, {"a": folder.block("Plant")}, kpis=[kpi])
    assert found.endswith(f"$.kpis[0].arguments.{line}")


def test_missing_signals_of_an_invalid_component_are_not_reported(folder):
    kpi = {"name": "k", "python": "cosim.kpis:rms", "arguments": {"signal": "a.y"}}
    (found,) = refused(folder, {"a": {"python": "none.py:A"}, "b": folder.block("Gain")}, kpis=[kpi])
    assert 'file "none.py" does not exist' in found


@pytest.mark.parametrize(
    ("number", "message"),
    [
        ("error.final_eror", 'no KPI "error.final_eror"; did you mean "error.final_error"?'),
        ("error", 'no KPI "error"; did you mean "error.time"?'),
        ("eror.time[1]", 'no KPI "eror.time[1]"; did you mean "error"?'),
    ],
)
def test_checks_must_name_a_value_of_a_kpi(folder, number, message):
    """Only names in a literal after `return` can be checked; `unsaid` returns a variable, so any name is accepted."""
    (folder.path / "f.py").write_text(FUNCTIONS)
    known, unknown = ({"name": name, "python": f"f.py:{name}", "arguments": {"vehicle": "a"}} for name in ("error", "unsaid"))
    checks = [{"kpi": each, "max": 1} for each in (number, "error.largest", "error.time[2]", "unsaid.anything")]
    (found,) = refused(folder, {"a": folder.block("Gain")}, kpis=[known, unknown], checks=checks)
    assert found.endswith(f"$.checks[0].kpi: {message}")


def test_a_name_with_swapped_letters_is_suggested():
    assert did_you_mean("plant.uva", ["plant.usv", "plant.uav"]) == '; did you mean "plant.uav"?'


def test_two_kpis_cannot_have_the_same_name(folder):
    (folder.path / "f.py").write_text(FUNCTIONS)
    kpi = {"name": "k", "python": "f.py:good", "arguments": {"signal": "a.y"}}
    (found,) = refused(folder, {"a": folder.block("Gain")}, kpis=[kpi, kpi])
    assert found.endswith('$.kpis[1].name: the name "k" is used more than once')


def test_settings_of_the_caller_may_be_arrays_and_must_be_finite(folder):
    file = folder.scenario({"a": folder.block("Controller")})
    cosim.run(file, {"a.gain": np.array([1.0, 2.0])})
    assert lines(file, parameters={"a.gain": []}) == ['setting "a.gain": "gain" is a list of values, found []']
    assert lines(file, parameters={"a.offset": np.inf}) == ['setting "a.offset": "offset" is of type Float64, found Infinity']


def test_numbers_beyond_a_double_are_refused(folder):
    found = lines(folder.write('{"name": "x", "stop_time": 1e400, "step_size": 1, "components": {"a": {"fmu": "x.fmu"}}}'))
    assert "$.stop_time: 1e400 is not allowed, expected a finite number" in found[0]


def test_for_an_unknown_scenario_the_nearest_shipped_one_is_suggested():
    with pytest.raises(cosim.InputError, match='no shipped scenario "demo1_bx"; did you mean "demo1_box"'):
        cosim.load("demo1_bx")


def test_settings_of_the_caller_are_checked(folder):
    file = folder.scenario({"a": folder.block("Gain")})
    assert lines(file, parameters={"a.kk": 1}) == ['setting "a.kk": component "a" has no variable "kk"; did you mean "k"?']
    assert lines(file, parameters={"/components/b/period": 1}) == [
        'setting "/components/b/period": the scenario has no "/components/b"'
    ]


@pytest.mark.parametrize(
    "times",
    [
        {"start_time": 1_700_000_000, "stop_time": 1_700_000_001, "step_size": 0.0001},
        {"start_time": -1e13, "stop_time": -1e13, "step_size": 0.25},
        {"stop_time": "1e-300", "step_size": "1e-300"},
    ],
)
def test_steps_that_the_times_resolve_are_accepted(folder, times):
    cosim.load(folder.scenario({"a": folder.block("Gain")}, **times)).free()
