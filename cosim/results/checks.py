"""Checks of KPIs against the limits of a scenario, and of recorded signals for NaN and infinity."""

import logging
import math
import operator
from collections.abc import Callable, Iterable, Mapping
from itertools import chain, islice
from typing import Any, NamedTuple

import numpy as np

from ..core.errors import InputError, Problem, did_you_mean, near_or_valid_names
from ..core.recording import Recording
from .files import iterate_chunks

Number = float | int | bool

LIMIT_OPERATORS: Mapping[str, Callable[[Any, Any], bool]] = {
    "min": operator.ge,
    "max": operator.le,
    "equals": operator.eq,
}

_LIMIT_WORDS = {"min": "at least ", "max": "at most ", "equals": ""}


class CheckOutcome(NamedTuple):
    """Outcome of a check.

    Attributes:
        check: The check as in the scenario, such as {"kpi": "landing.lateral_error", "max": 0.1}.
        value: Value of the KPI; NaN if it was not evaluated.
        passed: The value is within all limits.
    """

    check: Mapping[str, Any]
    value: Number
    passed: bool

    @property
    def limits(self) -> str:
        """The limits in words, such as "max 0.1"."""
        return ", ".join(
            f"{key} {str(limit).lower()}" for key, limit in self.check.items() if key != "kpi"
        )

    def __str__(self) -> str:
        return self.text({})

    def text(self, units: Mapping[str, str]) -> str:
        """Return value and limits, such as "roll.value is 0.46 rad, expected at most 0.35 rad".

        Args:
            units: Units of KPIs by name; "", "1" and missing ones are not written.
        """
        unit = units.get(self.check["kpi"]) or "1"
        suffix = "" if unit == "1" else f" {unit}"
        value = (
            str(self.value).lower() if isinstance(self.value, bool) else f"{self.value:.6g}{suffix}"
        )
        found = "has no value" if math.isnan(self.value) else f"is {value}"
        limits = (
            f"{_LIMIT_WORDS[key]}{str(limit).lower()}{suffix}"
            for key, limit in self.check.items()
            if key != "kpi"
        )
        return f"{self.check['kpi']} {found}, expected {' and '.join(limits)}"


def evaluate_checks(
    kpis: Mapping[str, Number], checks: Iterable[Mapping[str, Any]]
) -> list[CheckOutcome]:
    """Evaluate checks; NaN violates every limit.

    Args:
        kpis: Values of KPIs by name.
        checks: Checks such as {"kpi": "landing.lateral_error", "max": 0.1}, with the limits "min",
            "max" and "equals".

    Returns:
        The outcomes, in the order of the checks.

    Raises:
        InputError: A KPI was not evaluated, or a limit does not exist; `problems` lists all such
            checks.
    """
    checks = list(checks)
    problems = list(chain.from_iterable(_find_check_problems(kpis, check) for check in checks))
    if problems:
        raise InputError(problems)
    outcomes = []
    for check in checks:
        value = kpis[check["kpi"]]
        limits = [(LIMIT_OPERATORS[key], limit) for key, limit in check.items() if key != "kpi"]
        passed = all(holds(value, limit) for holds, limit in limits)
        outcomes.append(CheckOutcome(check, value, passed))
    return outcomes


def evaluate_all_checks(
    kpis: Mapping[str, Number], checks: Iterable[Mapping[str, Any]]
) -> list[CheckOutcome]:
    """Evaluate checks; unlike in `evaluate_checks`, a missing KPI fails with the value NaN."""
    checks = list(checks)
    return evaluate_checks({**{check["kpi"]: math.nan for check in checks}, **kpis}, checks)


def kpi_hint(name: str, kpis: Iterable[str]) -> str:
    """Return a hint for the end of a message about an unknown KPI.

    The most similar name, else the valid names.
    """
    return near_or_valid_names(name, kpis) or "; there are no KPIs"


def _find_check_problems(kpis: Mapping[str, Number], check: Mapping[str, Any]) -> list[Problem]:
    name, limits = check["kpi"], [key for key in check if key != "kpi"]
    where = f'check of "{name}"'
    problems = [
        Problem(f'unknown limit "{key}"{did_you_mean(key, LIMIT_OPERATORS)}', where)
        for key in limits
        if key not in LIMIT_OPERATORS
    ]
    if name not in kpis:
        problems.append(Problem(f"no such KPI{kpi_hint(name, kpis)}", where))
    if not limits:
        problems.append(
            Problem(f"no limit given, expected one of {', '.join(LIMIT_OPERATORS)}", where)
        )
    return problems


#: number of rows that are examined at a time
_CHUNK_ROWS = 1 << 14
#: number of signals with a separate warning
_MAX_WARNINGS = 20


def warn_non_finite(recording: Recording) -> dict[str, float]:
    """Log a warning for every signal that has a value which is NaN or infinite.

    Args:
        recording: The recorded signals.

    Returns:
        Time (s) of the first such value by name of the signal, the earliest first.
    """
    rows = _first_rows(recording)
    logger = logging.getLogger("cosim")
    for name, row in islice(rows.items(), _MAX_WARNINGS):
        value, time = recording.columns[name][row], recording.time[row]
        logger.warning(
            "%s is %s at t = %.12g s, its first value that is not finite", name, value, time
        )
    if len(rows) > _MAX_WARNINGS:
        logger.warning("%d further recorded signals are not finite", len(rows) - _MAX_WARNINGS)
    return {name: float(recording.time[row]) for name, row in rows.items()}


def _first_rows(recording: Recording) -> dict[str, int]:
    """Return the first row that is not finite by name of the signal, in ascending order."""
    floats = {
        name: values for name, values in recording.columns.items() if values.dtype.kind == "f"
    }
    first_rows: dict[str, int] = {}
    for rows in iterate_chunks([recording.time, *floats.values()], _CHUNK_ROWS):
        for name in [name for name in floats if name not in first_rows]:
            finite = np.isfinite(floats[name][rows])
            if not finite.all():
                first_rows[name] = rows.start + int(np.argmin(finite))
    return dict(sorted(first_rows.items(), key=lambda item: item[1]))
