"""Conditions in scenarios that end the run."""

from __future__ import annotations

from typing import Any

import pytest

import cosim

END = {"name": "end", "when": "a.y > 3", "for": 2}


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (
            {"when": "a.yy > 3"},
            '$.stop_when[0].when: no recorded signal "a.yy"; did you mean "a.y"?',
        ),
        ({"when": "a.u > 3"}, '$.stop_when[0].when: no recorded signal "a.u"; did you mean "a.y"?'),
        ({"when": "a.y >"}, '$.stop_when[0].when: "a.y >" is not an expression: invalid syntax'),
        (
            {"when": "import os"},
            (
                '$.stop_when[0].when: "import os" is not an expression: "import" is a reserved '
                "word of Python"
            ),
        ),
        ({"for": -1}, "$.stop_when[0].for: expected 0 s or more; found -1"),
        (
            {"outcome": "crashed"},
            "$.stop_when[0].outcome: expected 'crash' or 'decided'; found \"crashed\"",
        ),
    ],
)
def test_an_invalid_condition_is_refused(folder: Any, change: dict[str, Any], line: str) -> None:
    (found,) = folder.problems({"a": folder.block("Gain")}, stop_when=[{**END, **change}])
    assert found.endswith(line)


def test_a_repeated_name_is_refused(folder: Any) -> None:
    (found,) = folder.problems({"a": folder.block("Gain")}, stop_when=[END, END])
    assert found.endswith('$.stop_when[1].name: the name "end" is used more than once')


def test_signals_of_an_invalid_component_are_not_reported(folder: Any) -> None:
    (found,) = folder.problems(
        {"a": {"python": "none.py:A"}, "b": folder.block("Gain")}, stop_when=[END]
    )
    assert 'file "none.py" does not exist' in found


def ramp(folder: Any, *stops: dict[str, Any], **more: Any) -> cosim.Result:
    """A run of 8 s in which a.y is 2 t from the input profile."""
    (folder.path / "u.csv").write_text("time,u\n0,0\n8,8\n")
    inputs = [{"file": "u.csv", "to": {"u": "a.u"}}]
    content = {"stop_time": 8, "inputs": inputs, "stop_when": list(stops), **more}
    return cosim.run(folder.scenario({"a": folder.block("Gain")}, **content))


def test_the_result_tells_what_ended_the_run(folder: Any) -> None:
    result = ramp(folder, END)
    assert result.metadata["terminated_by"] == {
        "condition": "end",
        "outcome": "decided",
        "cause": "a.y > 3",
        "since": 3.0,
        "time": 5.0,
    }
    assert result.time[-1] == 5.0
    assert result.termination == "decided at t = 3 s, ended at t = 5 s: end (a.y > 3)"
    assert not result.crashed
    assert ramp(folder, {**END, "outcome": "crash"}).crashed


def test_conditions_see_recorded_points_only(folder: Any) -> None:
    result = ramp(folder, {"name": "end", "when": "a.y > 3"}, record={"interval": 4})
    assert result.time.tolist() == [0.0, 4.0]


def test_a_condition_that_is_never_met_has_no_effect(folder: Any) -> None:
    result = ramp(folder, {**END, "for": 10})
    assert (result.time[-1], result.termination) == (8.0, "")
