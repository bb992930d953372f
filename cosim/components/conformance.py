"""Conformance check of user-written Python components, made once when a component is loaded."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from ..core.component import Causality, Component, Variability, Variable
from ..core.errors import did_you_mean
from ..core.units import Unit

_METHODS = {
    name: method
    for name, method in vars(Component).items()
    if inspect.isfunction(method) and not name.startswith("_")
}
#: method name -> names of its arguments
_ARGUMENTS = {
    name: tuple(inspect.signature(method).parameters)[1:] for name, method in _METHODS.items()
}
_VALID_FIELD_VALUES = {"causality": get_args(Causality), "variability": get_args(Variability)}


def find_violations(candidate: Any) -> Iterator[str]:
    """Find all violations of the `Component` protocol by an object.

    Args:
        candidate: The object that a user's class or function created.

    Yields:
        One message per violation; none for a valid component.
    """
    expected = (
        name
        for name in {**Component.__annotations__, **vars(Component)}
        if not name.startswith("_")
    )
    if missing := [name for name in expected if not hasattr(candidate, name)]:
        yield f"it has no {', '.join(missing)}; expected a component or an Fmi2Slave class"
        return
    entries = (
        candidate.variables if isinstance(candidate.variables, Sequence) else [candidate.variables]
    )
    variables = [entry for entry in entries if isinstance(entry, Variable)]
    yield from _check_entries(entries)
    yield from _check_unique_names(variables)
    for name in _required_methods(
        {variable.causality for variable in variables}, candidate.has_state
    ):
        if getattr(getattr(candidate, name), "__func__", None) is _METHODS[name]:
            yield f'it does not define "{name}"{_misnamed_method_hint(candidate, name)}'
    for name, arguments in _ARGUMENTS.items():
        method = getattr(candidate, name)
        if getattr(method, "__func__", None) is not _METHODS[name] and not _accepts_arguments(
            method, arguments
        ):
            yield f'"{name}" does not take the arguments ({", ".join(arguments)})'


def _check_entries(entries: Sequence[Any]) -> Iterator[str]:
    for entry in entries:
        if isinstance(entry, Variable):
            yield from (
                f'variable "{entry.name}": {text}' for text in _check_variable_fields(entry)
            )
        else:
            yield f'"variables" contains {entry!r}, expected a cosim.core.component.Variable'


def _check_unique_names(variables: Sequence[Variable]) -> Iterator[str]:
    names = Counter(str(variable.name) for variable in variables)
    yield from (
        f'variable "{name}" is declared {count} times' for name, count in names.items() if count > 1
    )


def _check_variable_fields(variable: Variable) -> Iterator[str]:
    for field, valid in _VALID_FIELD_VALUES.items():
        if (value := getattr(variable, field)) not in valid:
            yield f'{field} is "{value}"{did_you_mean(str(value), valid)}'
    if not isinstance(variable.unit, Unit | None):
        yield (
            f"unit is {variable.unit!r}, expected a cosim.core.units.Unit, such as "
            f"parse_unit({str(variable.unit)!r})"
        )
    if not isinstance(variable.shape, tuple) or not all(
        isinstance(size, int) for size in variable.shape
    ):
        yield f"shape is {variable.shape!r}, expected a tuple of sizes"


def _required_methods(causalities: set[Causality], has_state: bool) -> Iterator[str]:
    """Yield the methods that must override the empty ones of `Component`."""
    yield "do_step"
    if causalities & {"input", "output"}:
        yield "bind"
    if "input" in causalities:
        yield "set_inputs"
    if "output" in causalities:
        yield "get_outputs"
    if causalities & {"input", "parameter", "structuralParameter"}:
        yield from ("set", "get")
    if has_state:
        yield from ("get_state", "set_state")


def _misnamed_method_hint(candidate: Any, name: str) -> str:
    """Return a message suffix that names a similarly spelt method of the candidate, or an empty string."""
    own_names = [other for other in dir(type(candidate)) if not hasattr(Component, other)]
    similar = get_close_matches(name, own_names, n=1)
    return f', but "{similar[0]}"' if similar else ""


def _accepts_arguments(method: Any, arguments: Sequence[str]) -> bool:
    try:
        inspect.signature(method).bind(*arguments)
    except TypeError:
        return False
    except ValueError:  # functions implemented in C may have no signature
        return True
    return True
