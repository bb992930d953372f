"""Validation of the plant: tests compare quantities with references, and docs/validation.md lists
the comparisons.

A test requests the fixture `measured` and calls

    measured("Otter", "speed at 100/100 rad/s", found, expected, "m/s", "golden value of MSS
    `otter.m`", within=5e-6)

which fails if the values differ by more than the limit. `pytest tests -m "" --validation FILE` runs
these tests and writes the document.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike

TESTS = Path(__file__).parents[1]
DOCUMENT = TESTS.parent / "docs/validation.md"

#: the sections of the document, in order
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
#: the sections of the part "Against measurements", whose text is in `MEASUREMENTS`
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

INTRODUCTION = """# Validation

This page compares every plant model with an independent reference. It contains the values that the tests measured. The page is
written by this command:

```text
pytest tests -m "" --validation docs/validation.md
```

Do not edit this page by hand; the text of its last part, "Against measurements", is
`tests/support/validation_against_measurements.md`.
A comparison that exceeds its limit fails its test. `tests/test_validation_document.py` fails if this page and the tests list
different comparisons. Speed is documented in [performance.md](performance.md).

* *Reference* and *measured* are empty if the quantity is itself a deviation. If a
  quantity has several values, the worst one is listed.
* *Deviation* is absolute, or relative to the reference if it is marked "rel."; values below 1e-12 are rounding errors. *Exact*
  means equal to the last bit.
* *DOP853* is the eighth-order Runge-Kutta method of SciPy with tolerances of 1e-11 or less, applied to an independent
  implementation of the equations in NumPy.
"""
#: text of the last part of the page: comparisons with data that the project does not contain
MEASUREMENTS = Path(__file__).with_name("validation_against_measurements.md")
COLUMNS = ("quantity", "unit", "reference", "measured", "deviation", "limit", "source", "test")
#: the same of a table that compares with a vehicle
VEHICLE_COLUMNS = ("quantity", "unit", "vehicle", "model", "difference", "limit", "source", "test")


@dataclass(frozen=True)
class Statement:
    """A comparison without its values; `test` is its file (below tests/) and function, `limit` the
    text in the document.
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
        f"{relative:g} rel." if relative else f"{within:g}" if within else "exact",
        source,
        test,
    )


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


def render_document(records: Sequence[dict[str, Any]]) -> str:
    """Return the document: a table for each model, ordered by files, lines and cases."""
    parts = [
        INTRODUCTION,
        *(
            f"## {model}\n\n{table}"
            for model in MODELS
            if (table := render_table(records, model, COLUMNS))
        ),
    ]
    text = MEASUREMENTS.read_text()
    for vehicle in MEASURED_VEHICLES:
        heading = f"### {vehicle}\n\n"
        assert heading in text, f"{MEASUREMENTS.name} has no heading {heading.strip()!r}"
        table = render_table(records, vehicle, VEHICLE_COLUMNS)
        text = text.replace(heading, f"{heading}{table}\n" if table else heading)
    return "\n".join([*parts, text])


def render_table(records: Sequence[dict[str, Any]], model: str, columns: Sequence[str]) -> str:
    """Return the table of a model, nothing if there are no records."""
    rows = list(table_rows(record for record in records if record["model"] == model))
    lines = [table_line(columns), table_line(["---"] * len(columns)), *map(table_line, rows)]
    return "\n".join([*lines, ""]) if rows else ""


def table_line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def table_rows(records: Iterable[dict[str, Any]]) -> Iterator[list[str]]:
    """Yield a row for each case of each quantity, with the largest deviation."""
    for _, case in groupby(sorted(records, key=sort_key), sort_key):
        yield table_row(max(case, key=lambda record: record["deviation"]))


def sort_key(record: dict[str, Any]) -> tuple[str, int, str]:
    """Return file, line and case of a record, with numbers padded so that 2 comes before 10."""
    case = re.sub(r"\d+", lambda number: number[0].zfill(9), record["case"])
    return record["test"].partition("::")[0], record["line"], case


def table_row(record: dict[str, Any]) -> list[str]:
    file, _, test = record["test"].partition("::")
    return [
        f"{record['quantity']} [{record['case']}]" if record["case"] else record["quantity"],
        record["unit"],
        *(f"{record[name]:.6g}" if record["expected"] else "" for name in ("expected", "found")),
        format_deviation(record["deviation"])
        + (" rel." if record["limit"].endswith("rel.") else ""),
        record["limit"],
        record["source"],
        f"[{test}](../tests/{file})",
    ]


def format_deviation(deviation: float) -> str:
    if deviation >= 1e-12:
        return f"{deviation:.2e}"
    return "< 1e-12" if deviation else "0"


class ValidationReport:
    """pytest plugin that collects the records, also of pytest-xdist workers, and writes the
    document if all tests passed.
    """

    def __init__(self, target: Path):
        self.target, self.records = target, []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.records += [value for name, value in report.user_properties if name == "measured"]

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, exitstatus: int) -> None:
        if exitstatus == 0:
            self.target.write_text(render_document(self.records))

    def pytest_terminal_summary(
        self, terminalreporter: pytest.TerminalReporter, exitstatus: int
    ) -> None:
        outcome = "written" if exitstatus == 0 else "not written, because tests failed"
        terminalreporter.write_line(f"{self.target}: {outcome}")
