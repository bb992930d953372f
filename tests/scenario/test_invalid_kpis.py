"""Invalid KPIs and checks, which are refused before the run."""

import pytest

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
    (found,) = folder.problems({"a": folder.block("Gain")}, kpis=[kpi])
    assert found.endswith(f"$.kpis[0]: {line}")


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (
            {"vehicle": "a.shpi"},
            (
                'vehicle: no signal below "a.shpi" is recorded; did you mean "a.ship"? (inputs are '
                "recorded "
            ),
        ),
        (
            {"vehicle": "a.ship", "target": "a.ship"},
            (
                'target: no signal "a.ship" is recorded; valid: a.ship.position.x, '
                "a.ship.position.y (inputs are "
            ),
        ),
    ],
)
def test_signals_in_arguments_of_functions_are_checked_before_the_run(folder, arguments, line):
    (folder.path / "f.py").write_text(FUNCTIONS)
    kpi = {"name": "k", "python": "f.py:error", "arguments": arguments}
    (found,) = folder.problems({"a": folder.block("Plant")}, kpis=[kpi])
    assert f"$.kpis[0].arguments.{line}" in found


def test_a_function_may_come_from_a_file_beside_the_named_one(folder):
    (folder.path / "f.py").write_text(FUNCTIONS)
    (folder.path / "g.py").write_text("from f import good as best, missing\n")
    kpi = {"name": "k", "python": "g.py:best", "arguments": {"sgnal": "a.y"}}
    (found,) = folder.problems({"a": folder.block("Gain")}, kpis=[kpi])
    assert found.endswith('$.kpis[0]: "best" takes no argument "sgnal"; did you mean "signal"?')
    (found,) = folder.problems(
        {"a": folder.block("Gain")}, kpis=[{**kpi, "python": "g.py:missing"}]
    )
    assert found.endswith('$.kpis[0]: "g.py" defines no function "missing"; valid: best')


TYPED = """
from collections.abc import Sequence
from cosim.results.kpi import Prefix, Signal

def typed(result, signal: Signal = "a.y", start: float = 0.0, count: int = 1,
          target: Signal | float | None = None, x: Sequence[float] = (),
          point: tuple[float, float] = (0, 0), plain: bool = False, free=None): ...
"""


@pytest.mark.parametrize(
    ("argument", "wrong", "message", "right"),
    [
        ("start", "300", 'expected a number; found "300"', 300),
        ("start", True, "expected a number; found true", 0.5),
        ("count", 2.5, "expected an integer; found 2.5", 2),
        ("signal", 3, "expected the name of a signal; found 3", "a.y"),
        ("target", [1], "expected the name of a signal or a number or null; found [1]", None),
        ("x", [1, "2"], 'expected a list, each element a number; found [1, "2"]', [1, 2.5]),
        ("x", "12", 'expected a list, each element a number; found "12"', []),
        ("point", 1, "expected a list, each element a number; found 1", [1, 2]),
        ("plain", 1, "expected true or false; found 1", True),
    ],
)
@pytest.mark.parametrize("kind", ["kpis", "figures"])
def test_values_of_arguments_must_have_the_annotated_type(
    folder, kind, argument, wrong, message, right
):
    (folder.path / "f.py").write_text(TYPED)
    good = {
        "name": "good",
        "python": "f.py:typed",
        "arguments": {argument: right, "free": {"any": ["thing"]}},
    }
    bad = {"name": "bad", "python": "f.py:typed", "arguments": {argument: wrong}, "optional": True}
    (found,) = folder.problems({"a": folder.block("Gain")}, **{kind: [good, bad]})
    assert found.endswith(f"$.{kind}[1].arguments.{argument}: {message}")


def test_a_value_that_is_taken_from_the_system_must_have_the_annotated_type(folder):
    (folder.path / "f.py").write_text(TYPED)
    taken = {"name": "taken", "python": "f.py:typed", "arguments": {"count": {"from": "a.k"}}}
    by_name = {"name": "by_name", "python": "f.py:typed", "from": "/components/a/parameters"}
    found = folder.problems(
        {"a": folder.block("Gain", parameters={"start": "x", "k": 2.0})}, kpis=[taken, by_name]
    )
    assert [each.partition("$.kpis")[2] for each in found if "kpis" in each] == [
        "[0].arguments.count: expected an integer; found 2.0",
        '[1].from: argument start: expected a number; found "x"',
    ]


def test_missing_signals_of_an_invalid_component_are_not_reported(folder):
    kpi = {"name": "k", "python": "cosim.kpis:rms", "arguments": {"signal": "a.y"}}
    (found,) = folder.problems(
        {"a": {"python": "none.py:A"}, "b": folder.block("Gain")}, kpis=[kpi]
    )
    assert 'file "none.py" does not exist' in found


@pytest.mark.parametrize(
    ("number", "message"),
    [
        ("error.final_eror", 'no KPI "error.final_eror"; did you mean "error.final_error"?'),
        ("error", 'no KPI "error"; did you mean "error.time"?'),
        ("eror.time[1]", 'no KPI "eror.time[1]"; did you mean "error.time"?'),
        (
            "speed.value",
            'no KPI "speed.value"; valid: error.largest, error.final_error, error.time, unsaid',
        ),
    ],
)
def test_checks_must_name_a_value_of_a_kpi(folder, number, message):
    """Only names in a literal after `return` can be checked; `unsaid` returns a variable, so any
    name is accepted.
    """
    (folder.path / "f.py").write_text(FUNCTIONS)
    known, unknown = (
        {"name": name, "python": f"f.py:{name}", "arguments": {"vehicle": "a"}}
        for name in ("error", "unsaid")
    )
    checks = [
        {"kpi": each, "max": 1}
        for each in (number, "error.largest", "error.time[2]", "unsaid.anything")
    ]
    (found,) = folder.problems({"a": folder.block("Gain")}, kpis=[known, unknown], checks=checks)
    assert found.endswith(f"$.checks[0].kpi: {message}")


def test_a_check_without_kpis_says_that_there_are_none(folder):
    (found,) = folder.problems(
        {"a": folder.block("Gain")}, checks=[{"kpi": "speed.value", "max": 1}]
    )
    assert found.endswith('$.checks[0].kpi: no KPI "speed.value"; there are no KPIs')


def test_two_kpis_cannot_have_the_same_name(folder):
    (folder.path / "f.py").write_text(FUNCTIONS)
    kpi = {"name": "k", "python": "f.py:good", "arguments": {"signal": "a.y"}}
    (found,) = folder.problems({"a": folder.block("Gain")}, kpis=[kpi, kpi])
    assert found.endswith('$.kpis[1].name: the name "k" is used more than once')
