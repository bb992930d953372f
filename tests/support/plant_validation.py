"""How the plant is validated: tests state quantities beside their references, and docs/validation.md is made of what they say.

A test asks for the fixture `measured` and states

    measured("Otter", "speed at 100/100 rad/s", found, expected, "m/s", "golden value of MSS `otter.m`", within=5e-6)

which fails unless both agree. `pytest tests -m "" --validation FILE` runs the tests that do so and writes the document.
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
    "Crazyflie and survey hexacopter",
    "Strider, planar",
    "Strider, six degrees of freedom",
    "Otter",
    "Waves",
    "Wind and current",
    "Contact",
    "Fleets",
    "World and plant FMUs",
    "Determinism and saved states",
    "Sensors",
    "Replica of the published simulator",
)

INTRODUCTION = """# Validation

Every model of the plant beside a reference that is independent of it, with the numbers that the tests measured. Written by

```text
pytest tests -m "" --validation docs/validation.md
```

never by hand: a statement that is not met fails its test, and `tests/test_validation_document.py` fails where this page
lists other statements than the tests make. Speed has a page of its own: [performance.md](performance.md).

* *Reference* and *measured* are left out where the quantity is a deviation by itself. Of several values the worst stands here.
* *Deviation* is absolute, or a share of the reference where it says "rel."; what is below 1e-12 is rounding. *Exact*: to the
  last bit.
* *DOP853* is the eighth-order Runge-Kutta method of SciPy with tolerances of 1e-11 and less, on equations written a second
  time in NumPy.
"""
COLUMNS = ("quantity", "unit", "reference", "measured", "deviation", "limit", "source", "test")


@dataclass(frozen=True)
class Statement:
    """What a test says that it measures; `test` is its file (below tests/) and function, `limit` as the document shows it."""

    model: str
    quantity: str
    unit: str
    limit: str
    source: str
    test: str


def statement(test: str, model: str, what: str, unit: str, source: str, within: float = 0.0, relative: float = 0.0) -> Statement:
    """The statement that these arguments of `measured` make."""
    assert model in MODELS, f"{model} is none of {MODELS}"
    return Statement(model, what, unit, f"{relative:g} rel." if relative else f"{within:g}" if within else "exact", source, test)


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
        """Assert |found - expected| <= within, or relative |expected|, in every element; the test may state several cases."""
        test = f"{self.node.path.relative_to(TESTS).as_posix()}::{self.node.originalname}"
        said = statement(test, model, what, unit, source, within, relative)
        values = worst_deviation(found, expected, bool(relative))
        where = {"case": case, "line": sys._getframe(1).f_lineno}
        self.node.user_properties.append(("measured", {**asdict(said), **where, **values}))
        assert values["deviation"] <= (relative or within), f"{model}: {what} {case}: {values}, expected within {said.limit}"


def worst_deviation(found: ArrayLike, expected: ArrayLike, relative: bool) -> dict[str, float]:
    """The pair that disagrees most."""
    pairs = np.broadcast_arrays(np.asarray(found, float), np.asarray(expected, float))
    values, references = (np.ravel(pair) for pair in pairs)
    deviations = np.abs(values - references) / (np.abs(references) if relative else 1.0)
    k = int(np.argmax(deviations))
    return {"found": float(values[k]), "expected": float(references[k]), "deviation": float(deviations[k])}


def render_document(records: Sequence[dict[str, Any]]) -> str:
    """The page: a table for each model, in the order of files, lines, statements and cases."""
    lines = [INTRODUCTION]
    sections = {model: list(table_rows(record for record in records if record["model"] == model)) for model in MODELS}
    for model, section in sections.items():
        if section:
            lines += [f"## {model}", "", table_line(COLUMNS), table_line(["---"] * len(COLUMNS)), *map(table_line, section), ""]
    return "\n".join(lines)


def table_line(cells: Iterable[str]) -> str:
    return f"| {' | '.join(cells)} |"


def table_rows(records: Iterable[dict[str, Any]]) -> Iterator[list[str]]:
    """A row for each case of each quantity, with the largest deviation."""
    for _, case in groupby(sorted(records, key=sort_key), sort_key):
        yield table_row(max(case, key=lambda record: record["deviation"]))


def sort_key(record: dict[str, Any]) -> tuple[str, int, str]:
    """File and line of a statement, and its case, so that 2 comes before 10."""
    case = re.sub(r"\d+", lambda number: number[0].zfill(9), record["case"])
    return record["test"].partition("::")[0], record["line"], case


def table_row(record: dict[str, Any]) -> list[str]:
    file, _, test = record["test"].partition("::")
    return [
        f"{record['quantity']} [{record['case']}]" if record["case"] else record["quantity"],
        record["unit"],
        *(f"{record[name]:.6g}" if record["expected"] else "" for name in ("expected", "found")),
        format_deviation(record["deviation"]) + (" rel." if record["limit"].endswith("rel.") else ""),
        record["limit"],
        record["source"],
        f"[{test}](../tests/{file})",
    ]


def format_deviation(deviation: float) -> str:
    if deviation >= 1e-12:
        return f"{deviation:.2e}"
    return "< 1e-12" if deviation else "0"


class ValidationReport:
    """Collects what tests measured, in this process or in those of pytest-xdist, and writes the page if all of them passed."""

    def __init__(self, target: Path):
        self.target, self.records = target, []

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when == "call":
            self.records += [value for name, value in report.user_properties if name == "measured"]

    @pytest.hookimpl(trylast=True)
    def pytest_sessionfinish(self, exitstatus: int) -> None:
        if exitstatus == 0:
            self.target.write_text(render_document(self.records))

    def pytest_terminal_summary(self, terminalreporter: pytest.TerminalReporter, exitstatus: int) -> None:
        said = "written" if exitstatus == 0 else "not written, because tests failed"
        terminalreporter.write_line(f"{self.target}: {said}")
