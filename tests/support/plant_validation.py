"""Validation of the plant: tests compare quantities with references, and docs/validation.csv lists
the comparisons.

A test requests the fixture `measured` and calls

    measured("Otter", "speed at 100/100 rad/s", found, expected, "m/s", "golden value of MSS
    `otter.m`", within=5e-6)

which fails if the values differ by more than the limit. `pytest tests -m "" --validation FILE` runs
these tests and writes the file.
"""

from __future__ import annotations

import csv
import re
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

TESTS = Path(__file__).parents[1]
TABLE = TESTS.parent / "docs/validation.csv"

#: models of the table, in order
MODELS = (
    "AR.Drone 2.0",
    "Multirotors",
    "Crazyflie and survey hexacopter",
    "Submerged vehicles",
    "Strider, planar",
    "Strider, six degrees of freedom",
    "Otter",
    "Otter of MSS",
    "Waves",
    "Wind and current",
    "Contact",
    "Fleets",
    "World and plant FMUs",
    "Determinism and saved states",
    "Sensors",
    "Replica of the published simulator",
)
#: vehicles that are compared with measurements; docs/validation_measurements.md describes these
MEASURED_VEHICLES = (
    "AR.Drone 2.0 in flight",
    "BlueBoat",
    "BlueROV2 Heavy",
    "Crazyflie 2.1",
    "CyberShip II",
    "Heron",
    "Otter at sea",
    "WAM-V 16",
)

COLUMNS = (
    "model",
    "quantity",
    "case",
    "unit",
    "reference",
    "measured",
    "deviation",
    "limit",
    "source",
    "test",
)


@dataclass(frozen=True)
class Statement:
    """A comparison without its values; `test` is its file (below tests/) and function, `limit` the
    text in the table.
    """

    model: str
    quantity: str
    unit: str
    limit: str
    source: str
    test: str


def statement(
    test: str,
    model: str,
    what: str,
    unit: str,
    source: str,
    within: float = 0.0,
    relative: float = 0.0,
) -> Statement:
    """Return the statement of a call of `measured`."""
    assert model in (known := MODELS + MEASURED_VEHICLES), (
        f"unknown model {model}, expected one of {known}"
    )
    return Statement(
        model,
        what,
        unit,
        _tolerance_text(relative, within),
        source,
        test,
    )


def _tolerance_text(relative: float, within: float) -> str:
    if relative:
        return f"{relative:g} rel."
    return f"{within:g}" if within else "exact"


@dataclass(frozen=True)
class MeasurementCheck:
    """The fixture `measured`."""

    node: Any

    def __call__(
        self,
        model: str,
        what: str,
        found: ArrayLike,
        expected: ArrayLike,
        unit: str,
        source: str,
        *,
        within: float = 0.0,
        relative: float = 0.0,
        case: str = "",
    ) -> None:
        """Assert |found - expected| <= within, or <= relative |expected|, in every element; `case`
        names one of several cases.
        """
        test = f"{self.node.path.relative_to(TESTS).as_posix()}::{self.node.originalname}"
        comparison = statement(test, model, what, unit, source, within, relative)
        values = worst_deviation(found, expected, bool(relative))
        where = {"case": case, "line": sys._getframe(1).f_lineno}
        self.node.user_properties.append(("measured", {**asdict(comparison), **where, **values}))
        assert values["deviation"] <= (relative or within), (
            f"{model}: {what} {case}: {values}, expected within {comparison.limit}"
        )


def worst_deviation(found: ArrayLike, expected: ArrayLike, relative: bool) -> dict[str, float]:
    """Return the pair of values with the largest deviation."""
    pairs = np.broadcast_arrays(np.asarray(found, float), np.asarray(expected, float))
    values, references = (np.ravel(pair) for pair in pairs)
    deviations = np.abs(values - references) / (np.abs(references) if relative else 1.0)
    k = int(np.argmax(deviations))
    return {
        "found": float(values[k]),
        "expected": float(references[k]),
        "deviation": float(deviations[k]),
    }


def write_table(records: Iterable[dict[str, Any]], target: Path) -> None:
    """Write the table, ordered by models, files, lines and cases; of each case its worst row."""
    with target.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for _, case in groupby(sorted(records, key=sort_key), sort_key):
            writer.writerow(table_row(max(case, key=lambda record: record["deviation"])))


def sort_key(record: dict[str, Any]) -> tuple[int, str, int, str]:
    """Return model, file, line and case of a record; numbers are padded: 2 comes before 10."""
    case = re.sub(r"\d+", lambda number: number[0].zfill(9), record["case"])
    model = (MODELS + MEASURED_VEHICLES).index(record["model"])
    return model, record["test"].partition("::")[0], record["line"], case


def table_row(record: dict[str, Any]) -> list[str]:
    has_reference = bool(record["expected"])
    is_relative = record["limit"].endswith("rel.")
    return [
        record["model"],
        record["quantity"],
        record["case"],
        record["unit"],
        f"{record['expected']:.6g}" if has_reference else "",
        f"{record['found']:.6g}" if has_reference else "",
        format_deviation(record["deviation"]) + (" rel." if is_relative else ""),
        record["limit"],
        record["source"],
        record["test"],
    ]


def format_deviation(deviation: float) -> str:
    if deviation >= 1e-12:
        return f"{deviation:.2e}"
    return "< 1e-12" if deviation else "0"


class ValidationReport:
    """pytest plugin that collects the records, also of pytest-xdist workers, and writes the
    table if all tests passed.
    """

    def __init__(self, target: Path):
        self.target, self.records = target, []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.records += [value for name, value in report.user_properties if name == "measured"]

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, exitstatus: int) -> None:
        if exitstatus == 0:
            write_table(self.records, self.target)

    def pytest_terminal_summary(
        self, terminalreporter: pytest.TerminalReporter, exitstatus: int
    ) -> None:
        outcome = "written" if exitstatus == 0 else "not written, because tests failed"
        terminalreporter.write_line(f"{self.target}: {outcome}")
