"""docs/validation.csv says what the tests measure, and is made by running them."""

from __future__ import annotations

import ast
import csv
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from plant_validation import (
    TABLE,
    TESTS,
    MeasurementCheck,
    Statement,
    ValidationReport,
    statement,
    write_table,
)

FILE = "plant_src/sensors/test_barometer_and_magnetometer.py"


def stated(file: Path) -> Iterator[Statement]:
    """Yield the statements of a test file: the literal arguments of their calls of `measured`."""
    tree = ast.parse(file.read_text())
    constants = dict(
        constant for line in tree.body if isinstance(line, ast.Assign) for constant in texts(line)
    )
    for function in (line for line in tree.body if isinstance(line, ast.FunctionDef)):
        test = f"{file.relative_to(TESTS).as_posix()}::{function.name}"
        for node in ast.walk(function):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "measured":
                arguments = [literal(node.args[k], constants) for k in (0, 1, 4, 5)]
                limits = {
                    word.arg: literal(word.value, constants)
                    for word in node.keywords
                    if word.arg != "case"
                }
                yield statement(test, *arguments, **limits)


def texts(line: ast.Assign) -> Iterator[tuple[str, str]]:
    """Names and values of the strings that a line of a module assigns."""
    names, values = (
        side.elts if isinstance(side, ast.Tuple) else [side]
        for side in (line.targets[0], line.value)
    )
    for name, value in zip(names, values, strict=False):
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield name.id, value.value


def literal(node: ast.expr, constants: dict[str, str]) -> str | float:
    return constants[node.id] if isinstance(node, ast.Name) else ast.literal_eval(node)


def listed(table: Path) -> Iterator[tuple[Statement, str, list[float]]]:
    """The statements of a table that tests wrote, each with its case and numbers."""
    with table.open(newline="") as file:
        for row in csv.DictReader(file):
            texts = [row[name] for name in ("reference", "measured", "deviation")]
            values = [float(text.strip("< rel.") or 0) for text in texts]
            names = ("model", "quantity", "unit", "limit", "source", "test")
            yield Statement(*(row[name] for name in names)), row["case"], values


def test_the_table_lists_exactly_what_the_tests_state() -> None:
    files = [file for file in TESTS.rglob("test_*.py") if "measured(" in file.read_text()]
    made = {each for file in files for each in stated(file)}
    assert len(made) > 80
    assert {each for each, _, _ in listed(TABLE)} == made


def test_running_with_the_option_writes_what_the_table_says(tmp_path: Path) -> None:
    """Here a file's part of it, by a process of pytest-xdist."""
    run = [
        sys.executable,
        "-m",
        "pytest",
        "-n",
        "1",
        "--validation",
        str(tmp_path / "table.csv"),
        str(TESTS / FILE),
    ]
    subprocess.run(run, cwd=TESTS.parent, check=True, capture_output=True)
    again = list(listed(tmp_path / "table.csv"))
    before = [row for row in listed(TABLE) if row[0].test.startswith(FILE)]
    assert [row[:2] for row in again] == [row[:2] for row in before]
    for (_, _, found), (_, _, expected) in zip(again, before, strict=True):
        assert found == pytest.approx(expected, rel=1e-2, abs=1e-9)


@pytest.fixture
def records() -> list[tuple[str, dict[str, object]]]:
    return []


@pytest.fixture
def stating(records: list[tuple[str, dict[str, object]]]) -> MeasurementCheck:
    """The fixture `measured` of a test that is made up."""
    return MeasurementCheck(
        SimpleNamespace(path=TESTS / FILE, originalname="test_it", user_properties=records)
    )


@pytest.mark.parametrize(
    ("found", "expected", "limit"),
    [
        (1.0 + 2e-6, 1.0, {"within": 1e-6}),
        (102.0, 100.0, {"relative": 0.01}),
        ([1.0, 2.0, 4.0], [1.0, 2.0, 3.0], {"within": 0.5}),
        (np.nextafter(1.0, 2.0), 1.0, {}),
        (float("nan"), 1.0, {"within": 1e9}),
    ],
)
def test_what_does_not_agree_fails(
    stating: MeasurementCheck, found: object, expected: object, limit: dict[str, float]
) -> None:
    with pytest.raises(AssertionError, match="Otter: speed"):
        stating("Otter", "speed", found, expected, "m/s", "theory", **limit)


def test_a_model_without_a_section_is_refused(stating: MeasurementCheck) -> None:
    with pytest.raises(AssertionError, match="unknown model Ottter"):
        stating("Ottter", "speed", 1.0, 1.0, "m/s", "theory")


def test_of_several_values_the_worst_is_listed(
    stating: MeasurementCheck, records: list[tuple[str, dict[str, object]]], tmp_path: Path
) -> None:
    for found in (1.001, [1.0, 0.996], 1.002):
        for case in ("10 s", "2 s"):
            stating("Otter", "speed", found, 1.0, "m/s", "theory", within=0.01, case=case)
    write_table([record for _, record in records], tmp_path / "table.csv")
    assert [row[1:] for row in listed(tmp_path / "table.csv")] == [
        ("2 s", [1.0, 0.996, 0.004]),
        ("10 s", [1.0, 0.996, 0.004]),
    ]


@pytest.mark.parametrize("exitstatus", [0, 1])
def test_the_table_is_left_alone_when_tests_fail(tmp_path: Path, exitstatus: int) -> None:
    (table := tmp_path / "table.csv").write_text("before")
    ValidationReport(table).pytest_sessionfinish(exitstatus)
    assert (table.read_text() == "before") == bool(exitstatus)
