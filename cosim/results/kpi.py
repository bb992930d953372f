"""Key performance indicators (KPIs): numbers computed from a result.

A KPI is a function `function(result, **arguments)` that returns one or more values by name:

    @units(lateral_error="m")
    @better(lateral_error="lower")
    def landing(result: Result, vehicle: Prefix, deck: Prefix) -> dict[str, float]: ...

Arguments annotated as `Signal` or `Prefix` are compared with the recorded signals before a scenario
runs.
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

from ..core.errors import (
    PASS_THROUGH_EXCEPTIONS,
    ComponentError,
    InputError,
    Problem,
    abbreviate_names,
    describe_exception,
    did_you_mean,
)
from ..core.units import multiply_units, split_unit
from .checks import Number
from .result import Result

#: name of a recorded signal, such as "plant.uav.position.z"
Signal = str
#: prefix of names of recorded signals, up to a dot or bracket, such as "plant.uav"
Prefix = str
#: name, function and keyword arguments of a KPI or figure
NamedCall = tuple[str, Callable[..., Any], Mapping[str, Any]]
KpiFunction = TypeVar("KpiFunction", bound=Callable[..., Any])

#: name of an argument, in a declared unit
_PLACEHOLDER = re.compile(r"\{(\w+)\}")


class NoValue(float):
    """NaN as a value of a KPI, with the reason for which there is no number.

        return {"time": NoValue("plant.uav touches no vessel")}

    Attributes:
        reason: The reason, shown below the table of KPIs.
    """

    reason: str

    def __new__(cls, reason: str) -> NoValue:
        """Return NaN with a reason."""
        value = super().__new__(cls, math.nan)
        value.reason = str(reason)
        return value


class ResultFunction(NamedTuple):
    """KPI or figure of a scenario: its name, function and keyword arguments."""

    name: str
    function: Callable[..., Any]
    arguments: Mapping[str, Any]

    def problems(self, kind: str) -> list[Problem]:
        """Return the errors of the arguments.

        Args:
            kind: "KPI" or "figure", for the messages.
        """
        signature = inspect.signature(self.function)
        try:
            signature.bind(None, **self.arguments)
        except TypeError as error:
            unknown = [name for name in self.arguments if name not in signature.parameters]
            hint = did_you_mean(unknown[0], list(signature.parameters)[1:]) if unknown else ""
            return [Problem(f"{error}{hint}", f'{kind} "{self.name}"')]
        return []

    def evaluate(self, kind: str, result: Result) -> Any:
        """Call the function.

        Args:
            kind: "KPI" or "figure", for the messages.
            result: First argument of the function.

        Returns:
            The value of the function.

        Raises:
            InputError: The arguments do not match the function, or a signal was not recorded.
            ComponentError: The function raised any other exception.
        """
        if problems := self.problems(kind):
            raise InputError(problems)
        try:
            return self.function(result, **self.arguments)
        except InputError as error:
            raise InputError(
                [Problem(str(problem), f'{kind} "{self.name}"') for problem in error.problems]
            ) from error
        except PASS_THROUGH_EXCEPTIONS:
            raise
        except BaseException as error:
            raise self.failure(kind, describe_exception(error)) from error

    def reason_without_value(self) -> str:
        """Return the reason that `no_value` declared, with the values of the arguments."""
        bound = inspect.signature(self.function).bind(None, **self.arguments)
        bound.apply_defaults()
        reason: str = getattr(self.function, "no_value", "the function returned NaN")
        return reason.format_map(bound.arguments)

    def failure(self, kind: str, reason: str) -> ComponentError:
        """Return a ComponentError that names this function."""
        return ComponentError(f'{kind} "{self.name}"', self.function.__name__, reason)


def units(**unit_of: str) -> Callable[[KpiFunction], KpiFunction]:
    """Declare the units of a KPI's values.

        @units(max_speed="m/s", distance="{speed}.s")
        def motion(result: Result, speed: Signal) -> dict[str, float]: ...

    Args:
        **unit_of: Unit of each value, in Modelica syntax. "{speed}" is the unit of the signal that
            the argument `speed` names; "{speed}2.s" is the unit of the integral of its square.
            Values without a unit are counts, ratios or Booleans.

    Returns:
        A decorator that returns the function itself.
    """
    return _declaring(units=unit_of)


def better(**sense: Literal["lower", "higher"]) -> Callable[[KpiFunction], KpiFunction]:
    """Declare which of a KPI's values should be minimized ("lower") or maximized ("higher").

        @better(overshoot="lower", share_on_course="higher")
        def course(result: Result, signal: Signal) -> dict[str, float]: ...

    Args:
        **sense: "lower" or "higher" for each value; the others are only informative.

    Returns:
        A decorator that returns the function itself.
    """
    return _declaring(better=sense)


def no_value(reason: str) -> Callable[[KpiFunction], KpiFunction]:
    """Declare the reason for which values of a KPI are NaN, unless they are `NoValue`.

        @no_value("{signal} does not reach {level}")
        def time_to_reach(result: Result, signal: Signal, level: float) -> dict[str, float]: ...

    Args:
        reason: The reason; "{level}" is the value of the argument `level`.

    Returns:
        A decorator that returns the function itself.
    """
    return _declaring(no_value=reason)


def _declaring(**attributes: Any) -> Callable[[KpiFunction], KpiFunction]:
    """Return a decorator that adds attributes to a function."""

    def declare(function: KpiFunction) -> KpiFunction:
        vars(function).update(attributes)
        return function

    return declare


def declared_units(function: Callable[..., Any]) -> Mapping[str, str]:
    """Return the units that `units` declared, by name of the value."""
    unit_of: Mapping[str, str] = getattr(function, "units", {})
    return unit_of


def evaluate_kpis(result: Result, kpis: Iterable[NamedCall]) -> dict[str, Number]:
    """Evaluate KPIs.

    Args:
        result: The run.
        kpis: Name, function and arguments of each KPI.

    Returns:
        All values by "name.key", in the order of the KPIs; a NaN is a `NoValue`.

    Raises:
        InputError: Arguments of a KPI do not match its function, or a signal was not recorded.
        ComponentError: The function of a KPI failed or returned something other than numbers.
    """
    values: dict[str, Number] = {}
    for evaluation in map(ResultFunction._make, kpis):
        numbers = evaluation.evaluate("KPI", result)
        if not isinstance(numbers, Mapping):
            raise evaluation.failure(
                "KPI",
                f"returned {type(numbers).__name__}, expected a mapping from names to numbers",
            )
        values |= {
            f"{evaluation.name}.{key}": _checked_number(evaluation, key, value)
            for key, value in numbers.items()
        }
    return values


def _checked_number(evaluation: ResultFunction, key: str, value: Any) -> Number:
    """Return a value as Python number or Boolean; raise ComponentError for anything else."""
    number = value.item() if isinstance(value, np.generic) else value
    if isinstance(number, int) and abs(number) > sys.float_info.max:
        raise evaluation.failure("KPI", f'"{key}" is larger than any double')
    if not isinstance(number, Number):
        raise evaluation.failure(
            "KPI", f'"{key}" is {type(value).__name__}, expected a number or Boolean'
        )
    if math.isnan(number) and not isinstance(number, NoValue):
        return NoValue(evaluation.reason_without_value())
    return number


def kpi_units(
    kpis: Iterable[NamedCall],
    names: Iterable[str],
    signal_units: Mapping[str, str] = MappingProxyType({}),
) -> dict[str, str]:
    """Return the units of KPI values (see `units`).

    Args:
        kpis: Name, function and arguments of each KPI.
        names: Names of values, such as "landing.time"; the unit of "waypoints.time[3]" is that of
            "waypoints.time".
        signal_units: Units of the signals of the result.

    Returns:
        The unit of each name; "" if none is declared, or if it depends on the unknown unit of a
        signal.
    """
    declared = {}
    for name, function, arguments in kpis:
        for key, unit in declared_units(function).items():
            declared[f"{name}.{key}"] = _resolve_unit(unit, arguments, signal_units)
    return {name: declared.get(name.partition("[")[0], "") for name in names}


def _resolve_unit(
    declared: str, arguments: Mapping[str, Any], signal_units: Mapping[str, str]
) -> str:
    """Replace the names of arguments in a declared unit by the units of their signals."""
    if "{" not in declared:
        return declared
    factors = []
    for symbol, power in split_unit(declared):
        match = _PLACEHOLDER.fullmatch(symbol)
        unit = signal_units.get(str(arguments.get(match[1])), "") if match else symbol
        factors.append((unit, power))
    if not all(unit for unit, _ in factors):
        return ""
    (unit, power), *others = factors
    return unit if power == 1 and not others else multiply_units(factors)


def kpi_notes(
    kpis: Mapping[str, Number], taken: Iterable[tuple[str, Mapping[str, Any]]] = ()
) -> list[str]:
    """Return lines with the reason of each missing value, and with the signals that KPIs took.

    Args:
        kpis: Values by name.
        taken: Names of KPIs and signals by argument, such as ("descent", {"mode": "uav.mode"}).
    """
    names_of: dict[str, list[str]] = {}
    for name, value in kpis.items():
        if isinstance(value, NoValue):
            names_of.setdefault(value.reason, []).append(name)
    notes = [f"{abbreviate_names(names, 3)}: {reason}" for reason, names in names_of.items()]
    for name, signals in taken:
        for argument, signal in signals.items():
            notes.append(f'{name} is computed from the signal {signal} (argument "{argument}")')
    return notes


def kpi_senses(kpis: Iterable[NamedCall], names: Iterable[str]) -> dict[str, str]:
    """Return "lower" or "higher" for those KPI values that declare it (see `better`).

    Args:
        kpis: Name, function and arguments of each KPI.
        names: Names of values, such as "landing.time".
    """
    declared = {}
    for name, function, _ in kpis:
        for key, sense in getattr(function, "better", {}).items():
            declared[f"{name}.{key}"] = sense
    senses = {name: declared.get(name.partition("[")[0]) for name in names}
    return {name: sense for name, sense in senses.items() if sense}
