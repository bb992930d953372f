"""Mistakes in input profiles: one line with the row."""

from __future__ import annotations

import pytest

from cosim.components.input_table import read_input_table
from cosim.core.errors import InputError


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("time;u\n0;1\n", 'the first column "time;u", expected "time" and columns separated by commas'),
        ("time,u\n0,1\n\n1,x\n", ":4: found '1,x', expected 2 numbers"),
        ("time,u\n0,1\n0,2\n", ":3: expected finite numbers, and a time above"),
        ("time,u\n0,nan\n", ":2: expected finite numbers"),
        ("time,u\n0,1,2\n", ":2: found '0,1,2', expected 2 numbers"),
        ("time,u\n", ":2: found no rows"),
    ],
)
def test_the_row_is_named(tmp_path, text, words):
    file = tmp_path / "in.csv"
    file.write_text(text)
    with pytest.raises(InputError) as refused:
        read_input_table(file, ["u"], "linear")
    (problem,) = refused.value.problems
    assert words in str(problem)


def test_empty_rows_are_passed_over(tmp_path):
    file = tmp_path / "in.csv"
    file.write_text("time,u\r\n0,1\r\n\r\n1,2\r\n\r\n")
    assert [variable.name for variable in read_input_table(file, ["u"], "linear").variables] == ["u"]
