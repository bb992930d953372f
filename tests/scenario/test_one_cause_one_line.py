"""Scenarios with one mistake each: the refusal is one line, without what only follows from the
mistake.
"""

import json
from pathlib import Path

import pytest
from systems import connection

import cosim
from cosim.scenario import load

NAN = float("nan")
GAIN = {"python": f"{Path(__file__).parent}/pythonfmu_blocks.py:Gain"}
KPI = {"name": "k", "python": "cosim.kpis:final", "arguments": {"signal": "b.y"}}
SCENARIO = {
    "name": "one",
    "start_time": 0,
    "stop_time": 3,
    "step_size": 1,
    "components": {"a": {**GAIN, "period": 1, "parameters": {"k": 3.0}}, "b": GAIN},
    "connections": [connection("a", "b"), connection("a.y", "b.u", delay=1)],
    "algorithm": {"stages": [["a"], ["b"]]},
    "record": {"signals": ["a.y", "b.y"], "interval": 1},
    "events": [{"time": 1, "set": {"a.u": 1.0, "b.k": 2.0}}],
    "kpis": [KPI],
    "checks": [{"kpi": "k.value", "min": 0.0, "max": 1.0}],
    "deadlines": {"step": 5},
}
TEXT = json.dumps(SCENARIO)


def renamed(old, new, count=-1):
    return TEXT.replace(json.dumps(old), json.dumps(new), count)


def changed(path, value):
    """Return the scenario with one value changed or added; keys and indices of `path` are separated
    by "/".
    """
    document = json.loads(TEXT)
    *parents, last = [int(key) if key.isdigit() else key for key in path.split("/")]
    target = document
    for key in parents:
        target = target[key]
    target[last] = value
    return json.dumps(document)


def repeated(key, value):
    return TEXT.replace(f'"{key}": ', f'"{key}": {json.dumps(value)}, "{key}": ', 1)


ROOTS = {
    "a list": ([SCENARIO], "expected an object, found [{"),
    "an empty list": ([], "expected an object, found []"),
    "a text": ("scenario", 'expected an object, found "scenario"'),
    "null": (None, "expected an object, found null"),
    "a number": (NAN, "NaN is not allowed"),
    "an empty object": ({}, 'the keys "name", "components", "stop_time", "step_size" are missing'),
}

NAMES = {
    "a component twice": (TEXT.replace('"b": {', '"a": {', 1), "$.components.a: duplicate key"),
    "a component twice, both used": (
        TEXT.replace('"b": {', '"b": {}, "b": {', 1),
        "$.components.b: duplicate key",
    ),
    "a hyphen in a name": (
        TEXT.replace('"b"', '"b-1"').replace('"b.', '"b-1.'),
        "expected a name of letters",
    ),
    "a dot in a name": (
        TEXT.replace('"b"', '"b.c"').replace('"b.', '"b.c.'),
        "expected a name of letters",
    ),
    "a space in a name": (
        TEXT.replace('"b"', '"b c"').replace('"b.', '"b c.'),
        "expected a name of letters",
    ),
    "an empty name": (
        TEXT.replace('"b": {', '"": {', 1),
        '$.components[""]: expected a name of letters',
    ),
    "a digit in front": (TEXT.replace('"b": {', '"1b": {', 1), "expected a name of letters"),
    "a misspelt stage": (
        changed("algorithm/stages/1/0", "bb"),
        'unknown component "bb"; did you mean "b"?',
    ),
    "an illegal stage": (
        changed("algorithm/stages/1/0", "b-"),
        "$.algorithm.stages[1][0]: expected a name",
    ),
    "stages without lists": (
        changed("algorithm/stages", ["a", "b"]),
        'expected a valid list; found "a", and 1 more element likewise',
    ),
    "a key twice": (repeated("stop_time", 2.5), "$.stop_time: duplicate key"),
    "the connections twice": (repeated("connections", []), "$.connections: duplicate key"),
    "a source twice": (repeated("python", "x.py:X"), "python: duplicate key"),
    "the stages twice": (repeated("stages", [["c"]]), "$.algorithm.stages: duplicate key"),
    "a misspelt stop time": (
        renamed("stop_time", "stop_tme"),
        'unknown key; did you mean "stop_time"?',
    ),
    "misspelt components": (
        renamed("components", "component"),
        'unknown key; did you mean "components"?',
    ),
    "a misspelt source": (renamed("python", "pyhton", 1), 'unknown key; did you mean "python"?'),
    "misspelt connections": (
        renamed("connections", "conections"),
        'unknown key; did you mean "connections"?',
    ),
    "misspelt components with seeds": (
        json.dumps(SCENARIO | {"seeds": ["/components/a/parameters/k"]}).replace(
            '"components"', '"compnents"'
        ),
        'unknown key; did you mean "components"?',
    ),
    "a misspelt list of signals": (
        TEXT.replace('"record": {"signals"', '"recrod": {"signals"'),
        'did you mean "record"?',
    ),
    "misspelt KPIs": (renamed("kpis", "kpsi"), 'unknown key; did you mean "kpis"?'),
    "a misspelt end of a connection": (
        renamed("from", "form", 1),
        'unknown key; did you mean "from"?',
    ),
}

NUMBERS = {
    path: (changed(path, NAN), f"{key}: NaN is not allowed, expected a finite number")
    for path, key in {
        "name": "$.name",
        "start_time": "$.start_time",
        "stop_time": "$.stop_time",
        "step_size": "$.step_size",
        "components/a": "$.components.a",
        "components/a/python": "$.components.a.python",
        "components/a/period": "$.components.a.period",
        "components/a/parameters/k": "$.components.a.parameters.k",
        "connections/1/delay": "$.connections[1].delay",
        "connections/0": "$.connections[0]",
        "algorithm/stages/1/0": "$.algorithm.stages[1][0]",
        "record/signals/1": "$.record.signals[1]",
        "record/interval": "$.record.interval",
        "events/0/time": "$.events[0].time",
        "events/0/set/a.u": '$.events[0].set["a.u"]',
        "kpis/0/name": "$.kpis[0].name",
        "kpis/0/arguments/signal": "$.kpis[0].arguments.signal",
        "checks/0/max": "$.checks[0].max",
        "deadlines/step": "$.deadlines.step",
    }.items()
}

SURROGATES = {
    f"surrogate in {path}": (changed(path, "\ud800"), "the character U+D800 is not allowed")
    for path in (
        "name",
        "description",
        "components/a/python",
        "connections/1/from",
        "connections/1/to",
        "record/signals/0",
        "algorithm/stages/0/0",
        "events/0/set/a.u",
        "components/a/parameters/k",
        "kpis/0/python",
        "kpis/0/arguments/signal",
        "checks/0/kpi",
    )
} | {
    "surrogate as component": (
        TEXT.replace('"b": {', '"\\ud800": {', 1),
        '$.components["\\ufffd"]: the character U+D800',
    ),
    "surrogate as key": (
        TEXT.replace('"stop_time"', '"\\ud800"', 1),
        '$["\\ufffd"]: the character U+D800',
    ),
    "surrogate as variable": (
        TEXT.replace('"k": 3.0', '"\\udfff": 3.0'),
        "the character U+DFFF is not allowed",
    ),
    "NUL in a path": (
        changed("components/a/python", "a\0.py:A"),
        "the character U+0000 is not allowed",
    ),
}

CONSEQUENCES = {
    "a missing source": (
        changed("components/a", {"fmu": "none.fmu"}),
        '$.components.a: FMU "none.fmu" does not exist',
    ),
    "a value of the wrong type for an input of a prefix": (
        TEXT.replace(', "delay": 1', "")
        .replace(json.dumps(connection("a.y", "b.u")), "")
        .replace("}, ]", "}]")
        .replace('"b": {', '"b": {"parameters": {"u": "x"}, ', 1),
        '"u" is of type Float64, found "x"',
    ),
    "a wrong connection that overrides a prefix": (
        changed("connections/1/from", "a.yy"),
        'has no output "yy"; did you mean "y"?',
    ),
    "an input profile that does not exist": (
        json.dumps(
            SCENARIO
            | {
                "connections": [connection("a", "b")],
                "inputs": [{"file": "no.csv", "to": {"x": "b.u"}}],
            }
        ),
        "cannot read no.csv",
    ),
    "a KPI without a valid name": (
        changed("kpis/0/name", 5),
        "$.kpis[0].name: expected a valid string; found 5",
    ),
    "a KPI with a misspelt key": (
        changed("kpis/0", {"name": "k", "pyhton": "x"}),
        'unknown key; did you mean "python"?',
    ),
    "a recorded signal of the wrong type": (
        changed("record/signals/1", 5),
        "$.record.signals[1]: expected a valid string",
    ),
    "recorded signals of the wrong type": (
        changed("record/signals", [1, 2, 3]),
        "found 1, and 2 more elements likewise",
    ),
    "components in a list": (
        changed("components", [GAIN, GAIN]),
        "$.components: expected an object; found [{",
    ),
    "a step of zero": (changed("step_size", 0), "$.step_size: expected a positive number"),
}

CASES = NAMES | NUMBERS | SURROGATES | CONSEQUENCES


def refusal(folder, text):
    file = folder.write(text)
    with pytest.raises(cosim.InputError) as error:
        load(file)
    return [str(problem).replace(f"{folder.path}/", "") for problem in error.value.problems]


def test_the_scenario_is_valid_without_the_mistakes(folder):
    load(folder.write(TEXT)).free()


@pytest.mark.parametrize("case", ROOTS)
def test_a_file_that_is_no_scenario_is_refused_in_one_line(folder, case):
    value, words = ROOTS[case]
    (line,) = refusal(folder, json.dumps(value))
    assert line.startswith("scenario.json:1:1: $: ")
    assert words in line


@pytest.mark.parametrize("case", CASES)
def test_one_mistake_gives_one_line(folder, case):
    text, words = CASES[case]
    (line,) = refusal(folder, text)
    assert line.startswith("scenario.json:1:")
    assert words in line


NESTED = {"components": {"x": GAIN}, "ports": {"inputs": {"u": "x.u"}, "outputs": {"y": "x.y"}}}


def test_a_nested_system_in_no_stage_is_one_line(folder):
    folder.write(NESTED | {"components": {"x": GAIN, "z": GAIN}}, "n.json")
    stages = {"components": {"a": GAIN, "b": GAIN, "n": {"system": "n.json"}}, "seeds": []}
    (line,) = refusal(folder, json.dumps(SCENARIO | stages))
    assert line.endswith(
        '$.components.n: component "n" is in no stage of "algorithm", so it would never step'
    )


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (json.dumps([NESTED]), "n.json:1:1: $: expected an object"),
        (json.dumps(NESTED).replace('"x": {', '"x": {}, "x": {'), "$.components.x: duplicate key"),
        (
            json.dumps(NESTED).replace('"x.y"', "5"),
            "$.ports.outputs.y: expected a valid string; found 5",
        ),
        (
            json.dumps(NESTED).replace('"x.y"', '"z.y"'),
            '$.ports.outputs.y: unknown component "z"; valid: x',
        ),
        (json.dumps(NESTED).replace("ports", "prots"), 'unknown key; did you mean "ports"?'),
        (json.dumps(NESTED).replace('"x"', '"x-1"'), "expected a name of letters"),
        (json.dumps(NESTED)[:-1], "expected ',' or '}'"),
    ],
)
def test_one_mistake_in_a_nested_system_gives_one_line(folder, text, words):
    folder.write(text, "n.json")
    components = {name: {"system": "n.json"} for name in "ab"} | {"g": GAIN}
    wires = [connection("a.y", "b.u"), connection("b.y", "g.u"), connection("g.y", "a.u")]
    (line,) = refusal(
        folder,
        json.dumps(
            SCENARIO
            | {
                "components": components,
                "connections": wires,
                "algorithm": None,
                "record": {"signals": ["a.y", "b.y"]},
                "events": [],
                "kpis": [KPI],
                "checks": [],
            }
        ),
    )
    assert words in line


def test_a_missing_component_is_one_line_with_the_number_of_its_places(folder):
    wires = [connection("a", "b"), connection("helm.y", "b.u"), connection("helm.y", "a.u")]
    (line,) = refusal(
        folder,
        json.dumps(
            SCENARIO | {"connections": wires, "events": [{"time": 1, "set": {"helm.k": 1.0}}]}
        ),
    )
    assert (
        '$.connections[1].from: unknown component "helm"; valid: a, b; 2 more places likewise'
        in line
    )


def test_a_mistake_hides_no_other_mistake(folder):
    text = (
        TEXT.replace('"k": 3.0', '"k": NaN')
        .replace('"b.y"]', '"b.z"]')
        .replace('"step": 5', '"steps": 5')
    )
    assert [line.partition(": ")[2] for line in refusal(folder, text)] == [
        "$.components.a.parameters.k: NaN is not allowed, expected a finite number",
        '$.deadlines.steps: unknown key; did you mean "step"?',
        '$.record.signals[1]: no variable matches "b.z"; did you mean "b.y"?',
    ]
