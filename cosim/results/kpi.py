"""Key performance indicators: numbers computed from a result.

A KPI is a plain function `function(result, **arguments)` that returns its numbers by name:

    @units(lateral_error="m")
    def landing(result: Result, vehicle: Prefix, deck: Prefix) -> dict[str, float]: ...

Arguments that are annotated as `Signal` or `Prefix` are held against the recorded signals before a scenario runs.
"""

from __future__ import annotations

import inspect
import math
import re
import sys
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, TypeVar

import numpy as np

from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, InputError, Problem, describe_exception, did_you_mean
from ..core.units import multiply_units
from .checks import Number
from .result import Result

#: the name of a recorded signal: "plant.uav.position.z"
Signal = str
#: what names of recorded signals begin with, up to a dot or bracket: "plant.uav"
Prefix = str
KpiFunction = TypeVar("KpiFunction", bound=Callable[..., Any])


#: a factor of a declared unit: a unit, or the argument whose signal has it, and a power
_UNIT_FACTOR = re.compile(r"(\{(\w+)\}|[A-Za-z%]+)(-?\d*)")


class ResultFunction(NamedTuple):
    """A function of a result under the name that a scenario gives it, with its keyword arguments: a KPI or a figure."""

    name: str
    function: Callable[..., Any]
    arguments: Mapping[str, Any]

    def problems(self, kind: str) -> list[Problem]:
        """What is wrong with the arguments; `kind` ("KPI", "figure") says in the messages what this is."""
        signature = inspect.signature(self.function)
        try:
            signature.bind(None, **self.arguments)
        except TypeError as error:
            unknown = [name for name in self.arguments if name not in signature.parameters]
            hint = did_you_mean(unknown[0], list(signature.parameters)[1:]) if unknown else ""
            return [Problem(f"{error}{hint}", f'{kind} "{self.name}"')]
        return []

    def evaluate(self, kind: str, result: Result) -> Any:
        """The function's value. Raises InputError for wrong arguments or signals, ComponentError when the function fails."""
        if problems := self.problems(kind):
            raise InputError(problems)
        try:
            return self.function(result, **self.arguments)
        except InputError as error:
            raise InputError([Problem(str(problem), f'{kind} "{self.name}"') for problem in error.problems]) from error
        except PASS_THROUGH_EXCEPTIONS:
            raise
        except BaseException as error:
            raise self.failure(kind, describe_exception(error)) from error

    def failure(self, kind: str, reason: str) -> ComponentError:
        """The error that says this function is at fault."""
        return ComponentError(f'{kind} "{self.name}"', self.function.__name__, reason)


def units(**unit_of: str) -> Callable[[KpiFunction], KpiFunction]:
    """Decorator: the units of a KPI's numbers in Modelica syntax; what is not named is a count or a Boolean.

    "{signal}" stands for the unit of the signal that the argument `signal` names: an integral of its square has "{signal}2.s".
    """

    def declare(function: KpiFunction) -> KpiFunction:
        function.units = unit_of  # type: ignore[attr-defined]
        return function

    return declare


def better(**sense: Literal["lower", "higher"]) -> Callable[[KpiFunction], KpiFunction]:
    """Decorator: which of a KPI's numbers are better the lower or the higher they are; what is not named is neither."""

    def declare(function: KpiFunction) -> KpiFunction:
        function.better = sense  # type: ignore[attr-defined]
        return function

    return declare


def evaluate_kpis(result: Result, kpis: Iterable[tuple[str, Callable[..., Any], Mapping[str, Any]]]) -> dict[str, Number]:
    """The numbers of all KPIs, given as (name, function, arguments), as "name.key" in the order given.

    Values may be NaN (not applicable to this run). Raises InputError or ComponentError that name the KPI.
    """
    values: dict[str, Number] = {}
    for evaluation in map(ResultFunction._make, kpis):
        numbers = evaluation.evaluate("KPI", result)
        if not isinstance(numbers, Mapping):
            raise evaluation.failure("KPI", f"returned {type(numbers).__name__}, expected a mapping from names to numbers")
        values |= {f"{evaluation.name}.{key}": _checked_number(evaluation, key, value) for key, value in numbers.items()}
    return values


def _checked_number(evaluation: ResultFunction, key: str, value: Any) -> Number:
    number = value.item() if isinstance(value, np.generic) else value
    if isinstance(number, int) and abs(number) > sys.float_info.max:
        raise evaluation.failure("KPI", f'"{key}" is larger than any double')
    if not isinstance(number, Number):
        raise evaluation.failure("KPI", f'"{key}" is {type(value).__name__}, expected a number or Boolean')
    return number


def first_crossing_time(time: np.ndarray, values: np.ndarray, level: float) -> float:
    """When a line through the rows (`time`, `values`), shape (rows,), first is at `level` or above; NaN when it never is."""
    above = np.flatnonzero(values >= level)
    if not above.size:
        return math.nan
    row = above[0]
    if row == 0:
        return float(time[0])
    share = (level - values[row - 1]) / (values[row] - values[row - 1])
    return float(time[row - 1] + share * (time[row] - time[row - 1]))


def kpi_units(
    kpis: Iterable[tuple[str, Callable[..., Any], Mapping[str, Any]]],
    names: Iterable[str],
    signal_units: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """The unit that a KPI's function declares (see `units`) for each of `names`, "" for none; "time[3]" is declared as "time".

    `signal_units` are those of the result; a unit that depends on a signal's is "" where that is unknown.
    """
    declared = {
        f"{name}.{key}": _resolve_unit(unit, arguments, signal_units)
        for name, function, arguments in kpis
        for key, unit in getattr(function, "units", {}).items()
    }
    return {name: declared.get(name.partition("[")[0], "") for name in names}


def _resolve_unit(declared: str, arguments: Mapping[str, Any], signal_units: Mapping[str, str]) -> str:
    """A declared unit with the units of signals in their places."""
    if "{" not in declared:
        return declared
    factors = [(part, signal, int(power or 1)) for part, signal, power in _UNIT_FACTOR.findall(declared)]
    known = [(signal_units.get(str(arguments.get(signal)), "") if signal else part, power) for part, signal, power in factors]
    return multiply_units(known) if all(unit for unit, _ in known) else ""


def kpi_senses(kpis: Iterable[tuple[str, Callable[..., Any], Mapping[str, Any]]], names: Iterable[str]) -> dict[str, str]:
    """ "lower" or "higher" for each of `names` whose KPI's function says what is better (see `better`)."""
    declared = {f"{name}.{key}": sense for name, function, _ in kpis for key, sense in getattr(function, "better", {}).items()}
    found = {name: declared.get(name.partition("[")[0]) for name in names}
    return {name: sense for name, sense in found.items() if sense}
