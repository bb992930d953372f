"""Conversion of the values in a worker process's answers, which foreign code in it may have written.

Each function raises one of `INVALID_ANSWER_ERRORS` for a value that is not of the expected form.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.component import StepResult, Variable
from ....core.errors import ComponentError, InputError

INVALID_ANSWER_ERRORS = (ValueError, TypeError, LookupError, AttributeError, ArithmeticError, RecursionError)

_OBJECT_DTYPE = np.dtype(object)


def no_value(value: Any) -> None:
    """Check that a command returned no value."""
    if value is not None:
        raise TypeError("a value that no command asked for")


def state_number(value: Any) -> int:
    """Return the number of an FMU state."""
    if type(value) is not int:
        raise TypeError("no number of a state")
    return value


def call_names(value: Any) -> list[str]:
    """Return the names of the calls of a step."""
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise TypeError("no names of calls")
    return value


def step_result(value: Any) -> StepResult | None:
    """Return the outcome of a step, None if it simply reached its end."""
    if value is None:
        return None
    time, event_needed, terminate_requested = value
    if type(time) not in (int, float) or type(event_needed) is not bool or type(terminate_requested) is not bool:
        raise TypeError("no outcome of a step")
    return StepResult(float(time), event_needed, terminate_requested)


def variable_value(value: Any, variable: Variable) -> Any:
    """Return the value of a variable: a scalar, or a list for an array."""
    count = len(variable.scalar_names)
    if variable.dtype == _OBJECT_DTYPE:
        string_values(value if variable.shape else [value], count)
        return value
    numbers = np.asarray(value)
    if numbers.dtype.kind not in "biuf" or numbers.size != count or bool(numbers.ndim) != bool(variable.shape):
        raise TypeError("no value of the variable")
    return value


def string_values(value: Any, count: int) -> list[Any]:
    """Return `count` values of String and Binary variables; None stands for none."""
    values = [] if value is None else value
    if not isinstance(values, list) or len(values) != count or not all(isinstance(text, str | bytes) for text in values):
        raise TypeError("no values of strings")
    return values


def raise_reported_error(message: dict[str, Any], component: str) -> None:
    """Raise the error that an answer reports, if any, as one of `component`."""
    if "component_error" in message:
        _, function, reason, time = message["component_error"]
        raise ComponentError(component, str(function), str(reason), None if time is None else float(time))
    if "input_error" in message:
        raise InputError([str(problem) for problem in list(message["input_error"])])
