"""Invalid scenarios: all problems are reported at once, each with file, line and JSON path, before
the first step.
"""

import numpy as np
import pytest
from systems import connection

import cosim
from cosim.core.errors import did_you_mean
from cosim.scenario import load


def test_all_problems_are_reported_at_once(folder):
    gain = folder.block("Gain")["python"]
    file = folder.write(
        f"""{{"name": "bad", "stop_time": 3.5, "description": "", "description": "", \
"step_size": 1, "colour": "red",
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
    assert [line.removeprefix("scenario.json:") for line in folder.problems_of(file)] == [
        "1:54: $.description: duplicate key",
        "3:48: $.components.a.parameters.u: NaN is not allowed, expected a finite number",
        '9:19: $.connections[4].too: unknown key; did you mean "to"?',
        "1:89: $.colour: unknown key",
        f'5:3: $.components.c: FMU "missing.fmu" does not exist; no *.fmu in "{folder.path}"',
        '3:24: $.components.a.parameters.kk: component "a" has no variable "kk"; did you mean "k"?',
        '3:33: $.components.a.parameters.k: "k" is of type Float64, found "x"',
        "7:33: $.connections[1]: input b.u is connected twice: it is already fed by a.y",
        "8:4: $.connections[2].from: a.u is an input, expected an output",
        '8:34: $.connections[3].from: unknown component "d"; valid: a, b, c',
        '10:64: $.record.signals[0]: no variable matches "a.z"; did you mean "a.y"?',
        '12:35: $.events[0].set["a.q"]: component "a" has no variable "q"; valid: k, u',
        '10:16: $.algorithm.stages: unknown component "e"; valid: b',
        "12:13: $.events[0]: event time 0.5 s lies between two communication points (1.0 s apart)",
        f'11:11: $.kpis[0]: file "none.py" does not exist; no *.py in "{folder.path}"',
        '11:62: $.checks[0].kpi: no KPI "kk.x"; valid: k',
    ]


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"stop_tme": 1}, '$.stop_tme: unknown key; did you mean "stop_time"?'),
        ({"step_size": 0}, "$.step_size: expected a positive number of seconds; found 0"),
        (
            {"step_size": "fast"},
            'expected seconds as a number or as a fraction in text such as "1/60"; found "fast"',
        ),
        ({"step_size": "0.01"}, 'such as "1/60"; found "0.01"; write 0.01 without quotes'),
        ({"checks": [{"kpi": "k.value", "max": "2"}]}, '; found "2"; write 2 without quotes'),
        (
            {"start_time": 1e15, "stop_time": 1e15 + 3, "step_size": 0.01},
            (
                "$.step_size: a step of 0.01 s is not resolved at t = 1000000000000003.0 s, where "
                "the times of components are 0.125"
            ),
        ),
        (
            {"start_time": -1e15, "stop_time": -1e15 + 3, "step_size": 0.125},
            "a step of 0.125 s is not resolved at t = 10000000",
        ),
        ({"start_time": 2**53, "stop_time": 2**53}, "a step of 1.0 s is not resolved"),
        (
            {"start_time": 1e10, "stop_time": 1e10 + 1, "step_size": 0.0001},
            "a step of 0.0001 s is not resolved at t = 1000",
        ),
        ({"stop_time": 0.5}, "$.stop_time: the duration 0.5 s is shorter than the step size 1.0 s"),
        (
            {"record": {"signals": ["a.z"]}},
            '$.record.signals[0]: no variable matches "a.z"; did you mean "a.y"?',
        ),
        (
            {"record": {"signals": ["a.[yz]"]}},
            '$.record.signals[0]: no variable matches "a.[yz]"; only "*" is a wildcard',
        ),
        (
            {"record": {"interval": 1.5}},
            "$.record.interval: recording interval 1.5 s is no multiple of the step size 1.0 s",
        ),
        (
            {"events": [{"time": 0.5, "set": {"a.u": 1}}]},
            "$.events[0]: event time 0.5 s lies between two",
        ),
        (
            {"events": [{"time": 1, "set": {"a.q": 1}}]},
            '$.events[0].set["a.q"]: component "a" has no variable "q"',
        ),
        ({"algorithm": {"stages": [["a"], ["b"]]}}, '$.algorithm.stages: unknown component "b"'),
        (
            {"algorithm": {"stages": []}},
            '$.components.a: component "a" is in no stage of "algorithm", so it would never step',
        ),
        (
            {"algorithm": {"kind": "magic", "stages": [["a"]]}},
            "$.algorithm.kind: expected 'staged'",
        ),
        (
            {"connections": [connection("a.y", "a.u", delay=-1)]},
            "$.connections[0].delay: expected greater than or equal to 0",
        ),
        (
            {"connections": [connection("a.y", "a.u", delay=1.5)]},
            "$.connections[0].delay: expected a valid integer",
        ),
        (
            {"connections": [connection("a.y", "a")]},
            "$.connections[0]: input a.u has no matching output a.y.u",
        ),
        (
            {"connections": [connection("a.u", "a.u")]},
            "$.connections[0].from: a.u is an input, expected an output",
        ),
        (
            {"connections": [connection("a.y", "a.y")]},
            "$.connections[0].to: a.y is an output, expected an input",
        ),
        (
            {"connections": [connection("a.yy", "a.u")]},
            'component "a" has no output "yy"; did you mean "y"?',
        ),
        ({"connections": [connection("aa.y", "a.u")]}, 'unknown component "aa"; did you mean "a"?'),
        (
            {"connections": [connection("a.y", "a.u")] * 2},
            "input a.u is connected twice: it is already fed by a.y",
        ),
        (
            {"kpis": [{"name": "k", "python": "none.py:f"}]},
            '$.kpis[0]: file "none.py" does not exist',
        ),
        ({"checks": [{"kpi": "k.x", "max": 1}]}, '$.checks[0].kpi: no KPI "k.x"'),
        ({"checks": [{"kpi": "k.x"}]}, 'expected at least one of "min", "max", "equals"'),
        ({"inputs": [{"file": "no.csv", "to": {"x": "a.u"}}]}, "no.csv: No such file"),
    ],
)
def test_one_mistake_is_reported_in_one_line(folder, change, line):
    found = folder.problems({"a": folder.block("Gain")}, **change)
    assert len(found) == 1
    assert found[0].startswith("scenario.json:1:")
    assert line in found[0]


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("", "expected a JSON value"),
        ('{"name": "x",}', "expected a key in double quotes"),
        ("{// a comment", 'expected a key in double quotes or "}"; JSON has no comments'),
        ('{"name": "x"} x', "expected the end of the file"),
        ('{"name" "x"}', "expected ':'"),
        ("[" * 200, "nested more than 100 levels deep"),
        ('{"name": tru}', "expected a JSON value"),
        ('{"name": "x', "Unterminated string"),
    ],
)
def test_text_that_is_not_json_is_reported_with_its_position(folder, text, line):
    (found,) = folder.problems_of(folder.write(text))
    assert found.startswith("scenario.json:1:")
    assert line in found


def test_numbers_beyond_a_double_are_refused(folder):
    found = folder.problems_of(
        folder.write(
            '{"name": "x", "stop_time": 1e400, "step_size": 1, "components": {"a": {"fmu": '
            '"x.fmu"}}}'
        )
    )
    assert "$.stop_time: 1e400 is not allowed, expected a finite number" in found[0]


def test_the_name_of_a_scenario_must_be_usable_as_a_folder_name(folder):
    (line,) = folder.problems({"a": folder.block("Gain")}, name="../evil")
    assert "$.name: expected a name" in line


@pytest.mark.parametrize("components", [None, [], 3, {}])
def test_without_components_there_are_no_further_problems_with_components(folder, components):
    content = {
        "name": "x",
        "stop_time": 1,
        "step_size": 1,
        "connections": [connection("a.y", "b.u")],
    }
    if components is not None:
        content["components"] = components
    (line,) = folder.problems_of(
        folder.write({**content, "algorithm": {"stages": [["a"]]}, "record": {"signals": ["a.y"]}})
    )
    assert "$.components" in line


def test_an_invalid_step_size_is_reported_without_consequences(folder):
    gain = folder.block("Gain", period=0.3)
    (line,) = folder.problems(
        {"a": gain}, step_size="fast", events=[{"time": 0.7, "set": {"a.u": 1}}]
    )
    assert "$.step_size: expected seconds" in line


def test_an_invalid_stop_time_does_not_hide_an_invalid_event(folder):
    found = folder.problems(
        {"a": folder.block("Gain")}, stop_time=-1, events=[{"time": 0.7, "set": {"a.u": 1}}]
    )
    assert [line.split(": ")[1] for line in found] == ["$.stop_time", "$.events[0]"]


def test_for_an_unknown_scenario_the_nearest_shipped_one_is_suggested():
    with pytest.raises(
        cosim.InputError, match='no shipped scenario "demo1_bx"; did you mean "demo1_box"'
    ):
        load("demo1_bx")


def test_a_name_with_swapped_letters_is_suggested():
    assert did_you_mean("plant.uva", ["plant.usv", "plant.uav"]) == '; did you mean "plant.uav"?'


def test_settings_of_the_caller_are_checked(folder):
    file = folder.scenario({"a": folder.block("Gain")})
    assert folder.problems_of(file, parameters={"a.kk": 1}) == [
        'setting "a.kk": component "a" has no variable "kk"; did you mean "k"?'
    ]
    assert folder.problems_of(file, parameters={"/components/b/period": 1}) == [
        'setting "/components/b/period": the scenario has no "/components/b"; "components" has: a'
    ]
    assert folder.problems_of(file, parameters={"/connections/0/from": "a.y"}) == [
        (
            'setting "/connections/0/from": the scenario has no "/connections/0"; "connections" '
            "has 0 elements"
        )
    ]


def test_settings_of_the_caller_may_be_arrays_and_must_be_finite(folder):
    file = folder.scenario({"a": folder.block("Controller")})
    cosim.run(file, {"a.gain": np.array([1.0, 2.0])})
    assert folder.problems_of(file, parameters={"a.gain": []}) == [
        'setting "a.gain": "gain" is a list of values, found []'
    ]
    assert folder.problems_of(file, parameters={"a.offset": np.inf}) == [
        'setting "a.offset": "offset" is of type Float64, found Infinity'
    ]


@pytest.mark.parametrize(
    "times",
    [
        {"start_time": 1_700_000_000, "stop_time": 1_700_000_001, "step_size": 0.0001},
        {"start_time": -1e13, "stop_time": -1e13, "step_size": 0.25},
        {"stop_time": 1e-300, "step_size": 1e-300},
    ],
)
def test_steps_that_the_times_resolve_are_accepted(folder, times):
    load(folder.scenario({"a": folder.block("Gain")}, **times)).free()


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('{"name": "a"\n "stop_time": 3}', "1:13"),
        ('{"name": "a",\n "stop_time": [1\n\n  2]}', "2:17"),
        ('{"name": "a" "stop_time": 3}', "1:14"),
    ],
)
def test_a_missing_comma_is_located_at_the_end_of_the_line(folder, text, place):
    (found,) = folder.problems_of(folder.write(text))
    assert found.startswith(f"scenario.json:{place}: expected ',' or ")


def test_a_python_file_is_not_read_as_json(folder):
    file = folder.write("x = 1", "room.py")
    assert folder.problems_of(file) == [
        "room.py is a Python file, expected a scenario, which is a JSON file that names its classes"
    ]


def test_a_gain_of_the_wrong_type_and_a_wrong_name_are_reported_in_one_line_each(folder):
    blocks = {"a": folder.block("Gain"), "b": folder.block("Gain")}
    (found,) = folder.problems(blocks, [{"from": "a.y", "to": "b.u", "gain": "2"}])
    assert found.endswith(
        '$.connections[0].gain: expected a number or a list of numbers; found "2"; write 2 without '
        "quotes"
    )
    (found,) = folder.problems(blocks, name="my run/1")
    assert found.endswith(
        '$.name: expected a name of letters, digits, "_", ".", "-" and spaces; found "my run/1"'
    )
