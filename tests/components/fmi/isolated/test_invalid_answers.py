"""Answers of a worker process that foreign code in it has written."""

from __future__ import annotations

from functools import partial

import pytest

from cosim.components.fmi.isolated import pipe_messages
from cosim.components.fmi.isolated.pipe_messages import INVALID_ANSWER_ERRORS, decode_line
from cosim.core.component import StepResult, Variable
from cosim.core.errors import ComponentError, InputError

SCALAR, ARRAY = Variable("x"), Variable("x", shape=(2,))
TEXT, TEXTS = Variable("x", "String"), Variable("x", "String", shape=(2,))


@pytest.mark.parametrize(
    ("convert", "value", "expected"),
    [
        (pipe_messages.no_value, None, None),
        (pipe_messages.state_number, 3, 3),
        (pipe_messages.call_names, ["fmi2DoStep"], ["fmi2DoStep"]),
        (pipe_messages.step_result, None, None),
        (pipe_messages.step_result, [0.5, False, True], StepResult(0.5, False, True)),
        (partial(pipe_messages.variable_value, variable=SCALAR), 1.5, 1.5),
        (partial(pipe_messages.variable_value, variable=ARRAY), [1.5, 2.5], [1.5, 2.5]),
        (partial(pipe_messages.variable_value, variable=TEXT), "a", "a"),
        (partial(pipe_messages.variable_value, variable=TEXTS), ["a", b"b"], ["a", b"b"]),
        (partial(pipe_messages.string_values, count=0), None, []),
        (partial(pipe_messages.string_values, count=2), ["a", b"b"], ["a", b"b"]),
    ],
)
def test_a_valid_value_is_returned(convert, value, expected):
    assert convert(value) == expected


#: values that fit none of the functions, as far as they are not named there
INVALID = [
    "x",
    [],
    {},
    [1, 2, 3, 4],
    ["a", False, False],
    [0.5, 1, True],
    {"a": 1},
    [[1], 2],
    [None],
    object(),
]


@pytest.mark.parametrize(
    ("convert", "fitting", "more"),
    [
        (pipe_messages.no_value, [], [1, True]),
        (pipe_messages.state_number, [], [None, True, 1.5]),
        (pipe_messages.call_names, [[]], [None, 1]),
        (pipe_messages.step_result, [], [1, True, 1e999, [0.5, True]]),
        (partial(pipe_messages.variable_value, variable=SCALAR), [], [None]),
        (partial(pipe_messages.variable_value, variable=ARRAY), [], [None, 1]),
        (partial(pipe_messages.variable_value, variable=TEXT), ["x"], [None, 1]),
        (partial(pipe_messages.variable_value, variable=TEXTS), [], [None, 1, ["a", 1]]),
        (partial(pipe_messages.string_values, count=2), [], [None, 1, ["a", None]]),
    ],
)
def test_a_value_of_another_form_is_refused(convert, fitting, more):
    for value in [*(value for value in INVALID if value not in fitting), *more]:
        with pytest.raises(INVALID_ANSWER_ERRORS):
            convert(value)


@pytest.mark.parametrize(
    "line", [b"[" * 100_000, b"{", b"\xff", b'{"bytes": 3}', b'{"bytes": "x"}', b"1" * 5000, b""]
)
def test_a_line_that_is_not_json_is_refused(line):
    with pytest.raises(INVALID_ANSWER_ERRORS):
        decode_line(line)


def test_a_reported_error_is_one_of_the_component_itself():
    with pytest.raises(ComponentError, match=r"lag: fmi2DoStep failed at t = 0\.5 s: no"):
        pipe_messages.raise_reported_error(
            {"component_error": ["innocent", "fmi2DoStep", "no", 0.5]}, "lag"
        )
    with pytest.raises(InputError, match="no such file"):
        pipe_messages.raise_reported_error({"input_error": ["no such file"]}, "lag")


@pytest.mark.parametrize(
    "error", [{"component_error": 1}, {"component_error": ["a"]}, {"input_error": 3}, None]
)
def test_an_invalid_report_of_an_error_is_refused(error):
    with pytest.raises(INVALID_ANSWER_ERRORS):
        pipe_messages.raise_reported_error(error, "lag")
