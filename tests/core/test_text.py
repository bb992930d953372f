"""Long texts: shortened in messages, and never searched for similar names in quadratic time."""

from __future__ import annotations

import logging

import pytest

from cosim.core import component_log
from cosim.core.errors import ComponentError, InputError, Problem, describe_exception, did_you_mean
from cosim.core.text import MAX_TEXT_LENGTH, acceptable_text, shorten, text_problem

LONG = "x" * 20_000_000


@pytest.mark.parametrize(
    "message",
    [
        str(InputError(LONG)),
        str(Problem("found", LONG)),
        str(ComponentError("a", "fmi2DoStep", LONG)),
        str(ComponentError(LONG, "fmi2DoStep", "status 3")),
        describe_exception(ValueError(LONG)),
    ],
)
def test_a_line_of_an_error_is_short_and_says_what_is_missing(message):
    assert len(message) < 10_000
    assert message.endswith("characters more")


def test_a_log_message_is_short(caplog):
    component_log.log_message("a", logging.WARNING, LONG)
    assert caplog.messages[-1].endswith("x ... and 19996000 characters more")


def test_a_similar_signal_of_the_same_component_comes_first():
    names = ["usv.heading_reference", "uav.altitude_command", *(f"a.x{i}" for i in range(12))]
    assert did_you_mean("uav.altitude_reference", names) == '; did you mean "uav.altitude_command"?'
    assert did_you_mean("uav.altitude_reference", [names[0], *names[2:]]) == ""
    assert did_you_mean("uva.altitude_command", names) == '; did you mean "uav.altitude_command"?'


def test_a_name_in_other_case_comes_first():
    assert did_you_mean("PI", ["P", "Pi", "Pid"]) == '; did you mean "Pi"?'


def test_a_long_name_has_no_similar_one():
    assert did_you_mean(LONG, ["x" * 100, LONG[:-1]]) == ""
    assert did_you_mean("x" * 99, ["x" * 100]) == f'; did you mean "{"x" * 100}"?'


@pytest.mark.parametrize("text", ["", "x" * MAX_TEXT_LENGTH, "\N{PILE OF POO}\t\n\x01\ue000"])
def test_an_acceptable_text_stays_as_it_is(text):
    assert (text_problem(text), acceptable_text(text)) == ("", text)


@pytest.mark.parametrize("text", ["\0", "a\ud800", "\udfff", "x" * (MAX_TEXT_LENGTH + 1)])
def test_the_replacement_of_another_text_is_acceptable(text):
    assert "not allowed" in text_problem(text)
    assert text_problem(acceptable_text(text)) == ""


def test_a_shortened_text_of_the_limit_is_complete():
    assert (shorten("abc", 3), shorten("abcd", 3)) == ("abc", "abc ... and 1 character more")
