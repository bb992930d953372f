"""Input profiles: types of their columns, and mistakes, one line with the row."""

from __future__ import annotations

import pytest

from cosim.components.input_table import read_input_table
from cosim.core.component import Ports, Variable
from cosim.core.errors import InputError
from cosim.engine.layout import build_layout


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "time;u\n0;1\n",
            'the first column "time;u", expected "time" and columns separated by commas',
        ),
        ("time,u\n0,1\n\n1,x\n", ":4: column \"u\": found 'x', expected a finite number"),
        ("time,u\n0,1\n0,2\n", ":3: expected a time above that of the row before"),
        ("time,u\n0,nan\n", ":2: column \"u\": found 'nan', expected a finite number"),
        ("time,u\n0,1_0\n", ":2: column \"u\": found '1_0', expected a finite number"),
        ("time,u\n0,1,2\n", ":2: found '0,1,2', expected 2 values"),
        ("time,u\n", ":2: found no rows"),
    ],
)
def test_the_row_is_named(tmp_path, text, words):
    file = tmp_path / "in.csv"
    file.write_text(text)
    with pytest.raises(InputError) as refused:
        read_input_table(file, {"u": None}, "linear")
    (problem,) = refused.value.problems
    assert words in str(problem)


def test_empty_rows_are_passed_over(tmp_path):
    file = tmp_path / "in.csv"
    file.write_text("time,u\r\n0,1\r\n\r\n1,2\r\n\r\n")
    assert [
        variable.name for variable in read_input_table(file, {"u": None}, "linear").variables
    ] == ["u"]


COLOURS = (("red", 1), ("green", 2))


def values_of_u(file, kind):
    """Return what a profile gives an input of a type at 0, 1 and 2 s."""
    variable = Variable("u", kind, items=COLOURS if kind == "Enumeration" else ())
    table = read_input_table(file, {"u": variable}, "linear")
    assert table.variables[0].type == kind
    ports = build_layout({"table": table.variables}).ports["table"]
    table.bind(Ports((), {}), ports)
    table.enter_initialization_mode(0.0, 2.0)
    found = []
    for time in (0.0, 1.0, 2.0):
        table.get_outputs()
        found += ports.arrays[table.variables[0].dtype].tolist()
        table.do_step(time, 1.0)
    return found


@pytest.mark.parametrize("mark", ["", "\ufeff"], ids=["", "marked"])
@pytest.mark.parametrize("comma", [",", ", "], ids=["", "blank"])
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"], ids=["lf", "crlf", "cr"])
def test_files_of_every_system_are_read(tmp_path, mark, comma, line_end):
    file = tmp_path / "in.csv"
    file.write_bytes((mark + line_end.join(["time,u", "0,1", "2,5"]).replace(",", comma)).encode())
    assert values_of_u(file, "Float64") == [1.0, 3.0, 5.0]


@pytest.mark.parametrize(
    ("kind", "cells", "values"),
    [
        ("Float32", ("0", "1"), [0.0, 0.5, 1.0]),
        ("Int8", ("-128", "127"), [-128, -128, 127]),
        ("UInt64", ("18446744073709551615", "3.0"), [2**64 - 1, 2**64 - 1, 3]),
        ("Boolean", ("true", "0"), [True, True, False]),
        ("Enumeration", ("green", "1"), [2, 2, 1]),
        ("String", ("a b", ""), ["a b", "a b", ""]),
        ("Binary", ("00ff", ""), [b"\0\xff", b"\0\xff", b""]),
    ],
)
def test_a_column_has_the_type_of_its_input(tmp_path, kind, cells, values):
    file = tmp_path / "in.csv"
    file.write_text(f"time,ignored,u\n0,x,{cells[0]}\n2,x,{cells[1]}\n")
    assert values_of_u(file, kind) == values


@pytest.mark.parametrize(
    ("kind", "cell"),
    [
        ("Int8", "128"),
        ("Int8", "1.5"),
        ("UInt8", "-1"),
        ("Boolean", "2"),
        ("Boolean", "yes"),
        ("Enumeration", "blue"),
        ("Int32", ""),
    ],
)
def test_a_cell_of_another_type_is_refused(tmp_path, kind, cell):
    file = tmp_path / "in.csv"
    file.write_text(f"time,u\n0,{cell}\n")
    with pytest.raises(
        InputError, match=f"column \"u\": found '{cell}', expected a value of type {kind}"
    ):
        read_input_table(
            file,
            {"u": Variable("u", kind, items=COLOURS if kind == "Enumeration" else ())},
            "linear",
        )
