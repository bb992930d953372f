"""Conversion of the values in the answers of a worker process.

Foreign code in the worker may have written these values.

Each function raises one of `INVALID_ANSWER_ERRORS` for a value that is not of the expected form.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ....core.component import StepResult, Variable
from ....core.errors import ComponentError, InputError

INVALID_ANSWER_ERRORS = (
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)

_OBJECT_DTYPE = np.dtype(object)


def no_value(value: Any) -> None:
    """Raise TypeError if a worker sent a value for a command that has no result."""
    if value is not None:
        raise TypeError("a value that no command asked for")


def state_number(value: Any) -> int:
    """Return the number of an FMU state that a worker sent."""
    if type(value) is not int:
        raise TypeError("no number of a state")
    return value


def call_names(value: Any) -> list[str]:
    """Return the names of the FMI calls of a step that a worker sent."""
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise TypeError("no names of calls")
    return value


def step_result(value: Any) -> StepResult | None:
    """Return the step result that a worker sent.

    None if the step reached its end and requested nothing.
    """
    if value is None:
        return None
    time, event_needed, terminate_requested = value
    if (
        type(time) not in (int, float)
        or type(event_needed) is not bool
        or type(terminate_requested) is not bool
    ):
        raise TypeError("no outcome of a step")
    return StepResult(float(time), event_needed, terminate_requested)


def variable_value(value: Any, variable: Variable) -> Any:
    """Return the value of a variable that a worker sent: a scalar, or a list for an array."""
    count = len(variable.scalar_names)
    if variable.dtype == _OBJECT_DTYPE:
        string_values(value if variable.shape else [value], count)
        return value
    numbers = np.asarray(value)
    if (
        numbers.dtype.kind not in "biuf"
        or numbers.size != count
        or bool(numbers.ndim) != bool(variable.shape)
    ):
        raise TypeError("no value of the variable")
    return value


def derivative_values(value: Any, count: int) -> list[float] | None:
    """Return `count` directional derivatives that a worker sent.

    None if the FMU does not offer them.
    """
    if value is not None and (
        not isinstance(value, list)
        or len(value) != count
        or {type(each) for each in value} - {float}
    ):
        raise TypeError("no directional derivatives")
    return value


def string_values(value: Any, count: int) -> list[Any]:
    """Return `count` values of String or Binary variables that a worker sent.

    None means an empty list.
    """
    values = [] if value is None else value
    if (
        not isinstance(values, list)
        or len(values) != count
        or not all(isinstance(text, str | bytes) for text in values)
    ):
        raise TypeError("no values of strings")
    return values


def raise_reported_error(message: dict[str, Any], component: str) -> None:
    """Raise the error that a worker's answer reports, if any, with the name of `component`."""
    if "component_error" in message:
        _, function, reason, time = message["component_error"]
        raise ComponentError(
            component, str(function), str(reason), None if time is None else float(time)
        )
    if "input_error" in message:
        raise InputError([str(problem) for problem in list(message["input_error"])])
