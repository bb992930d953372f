"""The JSON Schema and the loader accept and refuse the same values.

Rules that JSON Schema cannot express are left out: `min` above `max`, and times in text that are
too large for a double.
"""

import copy
from itertools import chain

import pytest
from jsonschema import Draft202012Validator

from cosim.scenario.json_document import Document
from cosim.scenario.schema import NestedSpec, ScenarioSpec, json_schema
from cosim.scenario.validation import validate_document

TIMES = [
    "0.01",
    "1/60",
    "1/0",
    "0/5",
    "-1/2",
    "+1/2",
    " 1",
    "1 ",
    "1e-2",
    "1E+2",
    "1_0",
    "\u0663",
    ".5",
    "5.",
    ".",
    "0e5",
    "1/2/3",
]
#: keys of times; elsewhere these texts are like others
TIME_KEYS = {"start_time", "stop_time", "step_size", "period", "delay", "interval", "time"}
NUMBERS = [0, 1, -1, 2, 0.5, 1.0, -0.0, 1e300, 2**53, 2**53 + 1, -(2**53)]
TEXTS = ["", "a", "a.y", "auto", "fmu", "staged", "linear", "error", "a b"]
OTHERS = [
    None,
    True,
    False,
    [],
    [1],
    ["a"],
    [["a"]],
    [None],
    [{}],
    [True, "x", 1.5],
    {},
    {"a": 1},
    {"a": {}},
]
NAMES = ["b-1", "", "1b", "b c", "b.c", "_x", "\u00e9", "unknown"]

SCENARIO = {
    "$schema": "x",
    "name": "n",
    "description": "d",
    "start_time": 0,
    "stop_time": 3,
    "step_size": 1,
    "components": {
        "a": {
            "python": "x.py:A",
            "arguments": {"q": 1},
            "parameters": {"k": 1.0, "l": [1, 2]},
            "period": 1,
        },
        "f": {"fmu": "x.fmu", "isolation": "fmu"},
        "s": {"system": "n.json"},
        "i": {
            "system": {
                "components": {"p": {"fmu": "y.fmu"}},
                "connections": [{"from": "p.y", "to": "p.u"}],
                "ports": {"inputs": {"u": "p.u"}},
            }
        },
    },
    "connections": [{"from": "a.y", "to": "f.u", "delay": 1}],
    "algorithm": {
        "kind": "staged",
        "stages": [["a"]],
        "parallel": "auto",
        "iteration": {"tolerance": 1e-9, "limit": 5},
    },
    "record": {"signals": ["*"], "interval": 1},
    "events": [{"time": 1, "set": {"a.u": 1}}],
    "inputs": [{"file": "x.csv", "to": {"c": ["a.u"], "d": "a.v"}, "interpolation": "hold"}],
    "kpis": [{"name": "k", "python": "x.py:k", "arguments": {}}],
    "checks": [
        {"kpi": "k.x", "min": 0},
        {"kpi": "k.x", "max": 1.5},
        {"kpi": "k.x", "equals": True},
    ],
    "scene": {"python": "x.py:s"},
    "reference": {"file": "r.csv", "tolerances": {"*": {"absolute": 0.1}}},
    "deadlines": {"load": 1},
    "non_finite": "error",
}
NESTED = {
    "components": {"m": {"modelica": "m.mo:M"}},
    "ports": {
        "inputs": {"u": ["m.u"], "v": "m.v"},
        "outputs": {"y": "m.y"},
        "parameters": {"p": "m.p"},
    },
}
#: shortest valid scenario; short documents make the tests quick
MINIMUM = {"name": "n", "stop_time": 3, "step_size": 1, "components": {"f": {"fmu": "x.fmu"}}}
KINDS = {"scenario": (SCENARIO, ScenarioSpec), "nested system": (NESTED, NestedSpec)}


def paths(value, path=()):
    """Yield the paths of all values in a document."""
    items = enumerate(value) if isinstance(value, list) else ()
    for key, each in value.items() if isinstance(value, dict) else items:
        yield (*path, key)
        yield from paths(each, (*path, key))


def mutants(document, path):
    """Yield (change, document) with another value at a path, without it, under other names, and
    with a further key.
    """
    *parents, last = path

    def mutant():
        copied = target = copy.deepcopy(document)
        for key in parents:
            target = target[key]
        return copied, target

    for value in [*(TIMES if last in TIME_KEYS else TIMES[:2]), *NUMBERS, *TEXTS, *OTHERS]:
        changed, target = mutant()
        target[last] = value
        yield repr(value), changed
    changed, target = mutant()
    del target[last]
    yield "removed", changed
    for name in NAMES if isinstance(last, str) else ():
        changed, target = mutant()
        target[name] = target.pop(last)
        yield f"renamed to {name!r}", changed
    for name in ("unknown", "fmu", "python", "arguments", "isolation"):
        changed, target = mutant()
        if isinstance(target[last], dict) and name not in target[last]:
            target[last][name] = "fmu"
            yield f"with {name}", changed


def problems(document, kind, tmp_path):
    """Return the problems of a document and of its inline nested systems."""
    spec, found, _ = validate_document(Document(tmp_path / "x.json", "", document), kind)
    inner = [each.nested_system for each in spec.components.values()]
    return [
        *found,
        *chain.from_iterable(
            problems(each, NestedSpec, tmp_path) for each in inner if isinstance(each, dict)
        ),
    ]


@pytest.mark.parametrize(
    ("kind", "key"),
    [(kind, key) for kind, (document, _) in KINDS.items() for key in document],
    ids=lambda text: text,
)
def test_the_schema_and_the_loader_agree(kind, key, tmp_path):
    complete, spec = KINDS[kind]
    document = MINIMUM | {key: complete[key]} if spec is ScenarioSpec else complete
    validator = Draft202012Validator(json_schema(nested=kind == "nested system"))
    disagreements = []
    for path in [(key,), *paths(document[key], (key,))]:
        for change, changed in mutants(document, path):
            found = problems(changed, spec, tmp_path)
            if bool(found) == validator.is_valid(changed):
                disagreements.append(f"{path} {change}: {found}")
    assert disagreements == []


@pytest.mark.parametrize("kind", KINDS)
def test_the_schemas_are_valid_and_accept_the_documents(kind, tmp_path):
    document, spec = KINDS[kind]
    schema = json_schema(nested=kind == "nested system")
    Draft202012Validator.check_schema(schema)
    Draft202012Validator(schema).validate(document)
    assert problems(document, spec, tmp_path) == []


@pytest.mark.parametrize(("text", "seconds"), [("1/100", 0.01), ("+1/4", 0.25), ("2/1", 2.0)])
def test_a_time_may_be_a_fraction_in_text(text, seconds, tmp_path):
    document = Document(tmp_path / "x.json", "", SCENARIO | {"step_size": text})
    spec, _, _ = validate_document(document, ScenarioSpec)
    assert float(spec.step_size) == seconds


@pytest.mark.parametrize("value", ["x", [1], {}, "1"])
def test_a_wrong_value_of_equals_is_one_problem(value, tmp_path):
    document = SCENARIO | {"checks": [{"kpi": "k", "equals": value}]}
    (problem,) = problems(document, ScenarioSpec, tmp_path)
    assert problem.message.startswith("expected a number, true or false; found")
