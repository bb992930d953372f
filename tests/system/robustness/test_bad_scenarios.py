"""Bad scenarios by hand: exit code 2, one line that names the place and what would be right, at
once.
"""

from __future__ import annotations

import copy
import json
import os
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from complete_scenario import INNER_SYSTEM, SCENARIO, write_scenario_files
from scenario_mutations import value_at

from cosim import cli
from cosim.scenario import load

TEXT = json.dumps(SCENARIO, indent=1)
PLACE = re.compile(r".*/(scenario|inner|iner)\.json:\d+:\d+: ")
Change = Callable[[Any], object]


def put(path: str, value: Any) -> Change:
    """Set the value at a path such as "components/a/period"."""
    keys = [int(key) if key.isdigit() else key for key in path.split("/")]
    return lambda document: value_at(document, tuple(keys[:-1])).__setitem__(keys[-1], value)


def drop(path: str) -> Change:
    keys = [int(key) if key.isdigit() else key for key in path.split("/")]
    return lambda document: value_at(document, tuple(keys[:-1])).pop(keys[-1])


def add(path: str, value: Any) -> Change:
    return lambda document: value_at(document, tuple(path.split("/"))).append(value)


#: text of the file, and what is said
TEXTS = {
    "empty": ("", "expected a JSON value"),
    "cut": (TEXT[:300], "Unterminated string"),
    "trailing comma": (TEXT[:-2] + ",}", "expected a key in double quotes"),
    "comment": ("// mine\n" + TEXT, "scenario.json:1:1: expected a JSON value"),
    "single quotes": (TEXT.replace('"', "'"), 'expected a key in double quotes or "}"'),
    "duplicate key": (
        TEXT.replace('"stop_time"', '"step_size": 1, "stop_time"', 1),
        "$.step_size: duplicate key",
    ),
    "NaN": (
        TEXT.replace("4.0", "NaN", 1),
        "$.stop_time: NaN is not allowed, expected a finite number",
    ),
    "overflow": (
        TEXT.replace("4.0", "1e999", 1),
        "$.stop_time: 1e999 is not allowed, expected a finite number",
    ),
    "thousands of digits": (TEXT.replace("4.0", "9" * 5000, 1), "$.stop_time: "),
    "deep": (
        TEXT.replace('"vehicle": "ship"', '"vehicle": ' + "[" * 200 + "]" * 200, 1),
        "nested more than 100 levels deep",
    ),
    "two documents": (TEXT + TEXT, "expected the end of the file"),
    "list": ("[]", "expected an object, found []"),
}

#: a change of the good scenario, and what is said
CHANGES: dict[str, tuple[Change, str]] = {
    # keys
    "unknown key": (put("stop_tme", 1), '$.stop_tme: unknown key; did you mean "stop_time"?'),
    "missing key": (drop("step_size"), '$.step_size: the key "step_size" is missing'),
    "unknown key of a component": (
        put("components/a/parameter", {}),
        '.parameter: unknown key; did you mean "parameters"?',
    ),
    "unknown key of a connection": (
        put("connections/0/form", "a.y"),
        'connections[0].form: unknown key; did you mean "from"?',
    ),
    "unknown key of a check": (put("checks/0/maximum", 1), "$.checks[0].maximum: unknown key"),
    "no components": (
        put("components", {}),
        "$.components: expected at least one component, found none",
    ),
    "a name with a dot": (
        put("components/a.b", {"python": "pythonfmu_blocks.py:Gain"}),
        "letters, digits and underscores",
    ),
    # types
    "text for a number": (
        put("checks/0/max", "10"),
        '$.checks[0].max: expected a valid number; found "10"',
    ),
    "number for a text": (put("name", 3), "$.name: expected a valid string; found 3"),
    "list for an object": (put("components", []), "$.components: expected an object; found []"),
    "object for a list": (put("connections", {}), "$.connections: expected a valid list; found {}"),
    "null": (put("stop_time", None), "$.stop_time: expected seconds"),
    "truth for a time": (put("stop_time", True), "$.stop_time: expected seconds"),
    # times
    "step of zero": (
        put("step_size", 0),
        "$.step_size: expected a positive number of seconds; found 0",
    ),
    "negative step": (
        put("step_size", -0.01),
        "$.step_size: expected a positive number of seconds; found -0.01",
    ),
    "stop before start": (
        put("stop_time", -1),
        "$.stop_time: the stop time -1.0 lies before the start time 0.0",
    ),
    "step longer than the run": (
        put("step_size", 100),
        "step size 100.0 s is longer than the period of a, inner.g",
    ),
    "division by zero": (put("stop_time", "1/0"), "$.stop_time: expected seconds"),
    "more steps than can be counted": (
        put("step_size", 1e-18),
        "are more than 9007199254740992 steps",
    ),
    "a number to hang on": (put("stop_time", "1e999999999"), "$.stop_time: expected seconds"),
    "period off the grid": (
        put("components/a/period", 0.75),
        "period 0.75 s is no multiple of the step size 0.5 s",
    ),
    "event off the grid": (
        put("events/0/time", 0.7),
        "event time 0.7 s lies between two communication points",
    ),
    "recording off the grid": (
        put("record/interval", 0.7),
        "$.record.interval: recording interval 0.7 s is no multiple",
    ),
    # sources
    "missing FMU": (put("components/f/fmu", "prob.fmu"), '$.components.f: FMU "'),
    "a circle of links as FMU": (
        put("components/f/fmu", "circle.fmu"),
        "Too many levels of symbolic links",
    ),
    "a circle of links as Python file": (
        put("components/a/python", "circle.py:A"),
        'file "circle.py" does not exist',
    ),
    "a module that exits": (
        put("components/a/python", "leaves.py:A"),
        '"leaves.py" cannot be imported: SystemExit: 0',
    ),
    "a module that panics": (
        put("components/a/python", "panics.py:A"),
        '"panics.py" cannot be imported: BaseException: lost',
    ),
    "a class that panics": (
        put("components/a/python", "panic.py:A"),
        "panic.py:A cannot be constructed: BaseException: lost",
    ),
    "a folder as FMU": (put("components/f/fmu", "."), "is a folder, expected a regular file"),
    "a text as FMU": (put("components/f/fmu", "profile.csv"), "is not an FMU"),
    "missing Python file": (
        put("components/a/python", "block.py:Gain"),
        'file "block.py" does not exist',
    ),
    "missing class": (
        put("components/a/python", "pythonfmu_blocks.py:Gian"),
        'did you mean "Gain"?',
    ),
    "no class": (
        put("components/a/python", "pythonfmu_blocks.py"),
        'expected "file.py:name", found "pythonfmu_blocks.py"',
    ),
    "a function that makes no component": (
        put("components/c/python", "kpis.py:nothing"),
        "creates a dict: it has no variables",
    ),
    "two sources": (put("components/a/fmu", "probe.fmu"), "found fmu and python"),
    "arguments for an FMU": (
        put("components/f/arguments", {"x": 1}),
        '"arguments" are for components with "python"',
    ),
    "a path with a null character": (
        put("components/f/fmu", "a\0b"),
        "the character U+0000 is not allowed",
    ),
    # values
    "unknown parameter": (
        put("components/f/parameters/y_strat", 1),
        'has no variable "y_strat"; did you mean "y_start"?',
    ),
    "parameter out of range": (
        put("components/f/parameters/y_start", 99),
        '"y_start" must lie in -10.0 ... 10.0, found 99',
    ),
    "fraction for an integer": (
        put("components/t/parameters/number", 1.5),
        '"number" is of type Int32, found 1.5',
    ),
    "number for a truth": (
        put("components/t/parameters/flag", 1),
        '"flag" is of type Boolean, found 1',
    ),
    "too many values": (
        put("components/c/parameters/gain", [1, 2, 3]),
        '"gain" takes at most 2 values, found 3',
    ),
    "huge integer": (
        put("components/a/parameters/k", 10**400),
        '"k" is of type Float64, found 1000',
    ),
    # wiring
    "unknown component": (
        put("connections/0/from", "aa.y"),
        'unknown component "aa"; did you mean "a"?',
    ),
    "unknown output": (
        put("connections/0/from", "a.yy"),
        'component "a" has no output "yy"; did you mean "y"?',
    ),
    "input as source": (put("connections/0/from", "a.u"), "a.u is an input, expected an output"),
    "connected twice": (
        add("connections", {"from": "a.y", "to": "f.u"}),
        "input f.u is connected twice",
    ),
    "unknown port": (
        put("connections/0/to", "inner.z"),
        'nested system "inner" has no input port "z"',
    ),
    "prefix without an output": (
        put("connections/1/from", "b.shop"),
        'no output "shop"; valid: ship.position.x',
    ),
    "a delay without end": (
        put("connections/1/delay", 10**12),
        "delay: expected less than or equal to 1000000",
    ),
    "negative delay": (
        put("connections/1/delay", -1),
        "$.connections[1].delay: expected greater than or equal to 0",
    ),
    "a component in no stage": (
        drop("algorithm/stages/2"),
        'component "f" is in no stage of "algorithm", so it would never step',
    ),
    "a component in two stages": (add("algorithm/stages", ["a"]), '"a"'),
    "unknown algorithm": (put("algorithm/kind", "jacoby"), "$.algorithm.kind: expected 'staged'"),
    # what is done with the result
    "nothing to record": (
        put("record/signals", ["a.z"]),
        'no variable matches "a.z"; did you mean "a.y"?',
    ),
    "a pipe as profile": (put("inputs/0/file", "pipe"), "pipe: Not a regular file"),
    "a pattern to hang on": (
        put("record/signals", ["*" + "a*" * 2000 + "q"]),
        'no variable matches "*a*a',
    ),
    "missing profile": (put("inputs/0/file", "profil.csv"), "$.inputs[0]: "),
    "unknown column": (put("inputs/0/to", {"xx": ["a.u"]}), '"xx"'),
    "missing function": (
        put("kpis/0/python", "kpis.py:lost"),
        'defines no function "lost"; did you mean "last"?',
    ),
    "missing argument": (put("kpis/0/arguments", {}), '"last" needs the argument signal'),
    "check of no KPI": (
        put("checks/0/kpi", "ende.value"),
        'no KPI "ende.value"; did you mean "end.value"?',
    ),
    "check that cannot be met": (put("checks/0/min", 11), 'expected "min" to be at most "max"'),
    "a nested system in itself": (
        put("components/inner/system", "scenario.json"),
        "contains itself",
    ),
    "a device as nested system": (
        put("components/inner/system", "/dev/zero"),
        'cannot read "/dev/zero": Not a regular file',
    ),
    "missing nested system": (
        put("components/inner/system", "iner.json"),
        "No such file or directory",
    ),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory, probes: dict[int, Path]) -> Path:
    folder = write_scenario_files(tmp_path_factory.mktemp("bad"), probes[2])
    (folder / "inner.json").write_text(json.dumps(INNER_SYSTEM))
    (folder / "scenario.json").write_text(TEXT)
    (folder / "leaves.py").write_text("raise SystemExit(0)")
    (folder / "panics.py").write_text("raise BaseException('lost')")
    (folder / "panic.py").write_text("def A(name):\n    raise BaseException('lost')")
    os.mkfifo(folder / "pipe")
    for circle in ("circle.fmu", "circle.py"):
        (folder / circle).symlink_to(circle)
    load(folder / "scenario.json").free()  # what is imported later is no time of the scenarios
    return folder


def refused(folder: Path, text: str, words: str, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "scenario.json").write_text(text)
    begin = time.process_time()
    code = cli.run_command_line(
        [
            "run",
            str(folder / "scenario.json"),
            "--isolation",
            "none",
            "--output-dir",
            str(folder / "out"),
        ]
    )
    processor_time = time.process_time() - begin
    errors = capsys.readouterr().err
    assert code == 2, errors
    assert words in errors
    assert all(PLACE.match(line) for line in errors.splitlines()), errors
    assert processor_time < 2  # seconds; a search without end takes minutes


@pytest.mark.parametrize("name", TEXTS)
def test_a_text_that_is_no_scenario(folder, name, capsys):
    refused(folder, *TEXTS[name], capsys)


@pytest.mark.parametrize("name", CHANGES)
def test_a_scenario_with_one_fault(folder, name, capsys):
    change, words = CHANGES[name]
    document = copy.deepcopy(SCENARIO)
    change(document)
    refused(folder, json.dumps(document, indent=1), words, capsys)
