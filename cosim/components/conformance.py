"""What a component that somebody wrote in Python has to be, examined once, when it is loaded."""

from __future__ import annotations

import inspect
from collections import Counter
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from typing import Any, get_args

from ..core.component import Causality, Component, Variability, Variable
from ..core.errors import did_you_mean
from ..core.units import Unit

_METHODS = {name: method for name, method in vars(Component).items() if inspect.isfunction(method) and not name.startswith("_")}
_VALID_FIELD_VALUES = {"causality": get_args(Causality), "variability": get_args(Variability)}


def find_violations(candidate: Any) -> Iterator[str]:
    """Everything that keeps an object from being a component."""
    expected = (name for name in {**Component.__annotations__, **vars(Component)} if not name.startswith("_"))
    if missing := [name for name in expected if not hasattr(candidate, name)]:
        yield f"it has no {', '.join(missing)}; expected a component or an Fmi2Slave class"
        return
    variables = candidate.variables if isinstance(candidate.variables, Sequence) else [candidate.variables]
    yield from _check_variables(variables)
    known = [variable for variable in variables if isinstance(variable, Variable)]
    for name in _required_methods({variable.causality for variable in known}, candidate.has_state):
        if getattr(getattr(candidate, name), "__func__", None) is _METHODS[name]:
            yield f'it does not define "{name}"{_misnamed_method_hint(candidate, name)}'
    for name, method in _METHODS.items():
        arguments = list(inspect.signature(method).parameters)[1:]
        if not _accepts_arguments(getattr(candidate, name), arguments):
            yield f'"{name}" does not take the arguments ({", ".join(arguments)})'


def _check_variables(variables: Sequence[Any]) -> Iterator[str]:
    for variable in variables:
        if isinstance(variable, Variable):
            yield from (f'variable "{variable.name}": {text}' for text in _check_variable_fields(variable))
        else:
            yield f'"variables" holds {variable!r}, expected a cosim.core.component.Variable'
    names = Counter(str(variable.name) for variable in variables if isinstance(variable, Variable))
    yield from (f'variable "{name}" stands there {count} times' for name, count in names.items() if count > 1)


def _check_variable_fields(variable: Variable) -> Iterator[str]:
    for field, valid in _VALID_FIELD_VALUES.items():
        if (found := getattr(variable, field)) not in valid:
            yield f'{field} is "{found}"{did_you_mean(str(found), valid)}'
    if not isinstance(variable.unit, Unit | None):
        yield f"unit is {variable.unit!r}, expected a cosim.core.units.Unit, such as parse({str(variable.unit)!r})"
    if not isinstance(variable.shape, tuple) or not all(isinstance(size, int) for size in variable.shape):
        yield f"shape is {variable.shape!r}, expected a tuple of sizes"


def _required_methods(causalities: set[Causality], has_state: bool) -> Iterator[str]:
    """The methods that a component with such variables cannot leave to the empty ones of `Component`."""
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


def _misnamed_method_hint(made: Any, name: str) -> str:
    """What may be the method under a wrong name, as the end of a message."""
    own = [other for other in dir(type(made)) if not hasattr(Component, other)]
    near = get_close_matches(name, own, n=1)
    return f', but "{near[0]}"' if near else ""


def _accepts_arguments(method: Any, arguments: list[str]) -> bool:
    try:
        inspect.signature(method).bind(*arguments)
    except TypeError:
        return False
    except ValueError:  # of a method in C nothing is known
        return True
    return True
