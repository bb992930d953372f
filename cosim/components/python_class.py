"""Loading of components from Python classes.

PythonFMU slaves, or classes that implement `Component` themselves.
"""

import inspect
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args

from ..core.component import Causality, Component, Variability, Variable
from ..core.errors import (
    PASS_THROUGH_EXCEPTIONS,
    InputError,
    Problem,
    describe_exception,
    did_you_mean,
)
from ..core.units import Unit
from .python_import import load_object


def load_component(
    reference: str, folder: Path, instance_name: str, arguments: Mapping[str, Any]
) -> Component:
    """Import a class, construct it and return it as a component.

    Args:
        reference: File and class (or function) as "file.py:Class": a PythonFMU class, or one that
            creates a `Component`.
        folder: Folder that a relative file path starts from.
        instance_name: Name of the component.
        arguments: Further keyword arguments of the class.

    Raises:
        InputError: The class cannot be imported, does not accept the arguments or cannot be
            constructed, or the constructed object does not conform to `Component`.
    """
    return create_python_component(
        load_object(reference, folder), reference, instance_name, arguments
    )


def create_python_component(
    source: Any, reference: str, instance_name: str, arguments: Mapping[str, Any]
) -> Component:
    """Return a component that a Python class (or function) creates, or that an object is.

    Args:
        source: A PythonFMU class, a class or function that creates a `Component`, or an object of
            such a class.
        reference: Description of the source, for messages.
        instance_name: Name of the component.
        arguments: Further keyword arguments of the class.

    Raises:
        InputError: The class does not accept the arguments or cannot be constructed, or the object
            does not conform to `Component`.
    """
    if callable(source):
        if _is_pythonfmu_class(source) and "instance_name" in arguments:
            raise InputError(
                f'{reference} receives its "instance_name" from the scenario; remove it from the '
                "arguments"
            )
        if _is_pythonfmu_class(source):
            source = _construct(
                source, reference, instance_name=instance_name, **_resources(source), **arguments
            )
        else:
            source = _construct(source, reference, instance_name, **arguments)
    elif arguments:
        raise InputError(
            f'{reference} takes no "arguments", because it has already been constructed'
        )
    if _is_pythonfmu_class(type(source)):
        from .python_fmu import PythonFmuComponent

        return PythonFmuComponent(source, instance_name)
    component: Component = source
    type_name = type(component).__name__
    if problems := [
        Problem(f"{reference} creates a {type_name}: {text}") for text in find_violations(component)
    ]:
        raise InputError(problems)
    return component


def _is_pythonfmu_class(factory: object) -> bool:
    """Return whether a class derives from `pythonfmu.Fmi2Slave`.

    A module that defines such a class has imported `pythonfmu`, so other components are loaded
    without importing it.
    """
    package = sys.modules.get("pythonfmu")
    return (
        package is not None and inspect.isclass(factory) and issubclass(factory, package.Fmi2Slave)
    )


def _resources(factory: type) -> dict[str, str]:
    """Return the argument `resources` for a PythonFMU class that accepts it.

    The folder of its file, as in an exported FMU.
    """
    parameters = inspect.signature(factory).parameters
    accepted = "resources" in parameters or any(
        one.kind is one.VAR_KEYWORD for one in parameters.values()
    )
    file = getattr(sys.modules.get(factory.__module__), "__file__", None)
    return {"resources": str(Path(file).parent)} if accepted and file else {}


def _check_do_step(factory: type, reference: str) -> None:
    """Raise InputError unless a PythonFMU class has a method `do_step` with its arguments."""
    method = factory.__dict__.get("do_step") or getattr(factory, "do_step", None)
    if method is None or getattr(method, "__isabstractmethod__", False):
        raise InputError(f"{reference} has no method do_step(self, current_time, step_size)")
    if not inspect.isfunction(method):
        return
    try:
        inspect.signature(method).bind(None, 0.0, 0.0)
    except TypeError:
        place = f"{Path(method.__code__.co_filename).name}:{method.__code__.co_firstlineno}"
        found = f"do_step{inspect.signature(method)}"
        raise InputError(
            f"{reference}: expected do_step(self, current_time, step_size); found {found} ({place})"
        ) from None


def _construct(
    factory: Callable[..., Any], reference: str, /, *positional: Any, **named: Any
) -> Any:
    if isinstance(factory, type) and _is_pythonfmu_class(factory):
        _check_do_step(factory, reference)
    try:
        inspect.signature(factory).bind(*positional, **named)
    except TypeError as error:
        raise InputError(f"{reference} does not accept these arguments: {error}") from None
    try:
        return factory(*positional, **named)
    except (InputError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise InputError(
            f"{reference} cannot be constructed: {describe_exception(error)}"
        ) from error


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
    for entry in entries:
        yield from _find_entry_violations(entry)
    for name, count in Counter(str(variable.name) for variable in variables).items():
        if count > 1:
            yield f'variable "{name}" is declared {count} times'
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


def _find_entry_violations(entry: Any) -> Iterator[str]:
    """Yield what is wrong with an element of `Component.variables`."""
    if not isinstance(entry, Variable):
        yield f'"variables" contains {entry!r}, expected a cosim.core.component.Variable'
        return
    start = f'variable "{entry.name}": '
    for field, valid in _VALID_FIELD_VALUES.items():
        if (value := getattr(entry, field)) not in valid:
            yield f'{start}{field} is "{value}"{did_you_mean(str(value), valid)}'
    if not isinstance(entry.unit, Unit | None):
        yield (
            f"{start}unit is {entry.unit!r}, expected a cosim.core.units.Unit, such as "
            f"parse_unit({str(entry.unit)!r})"
        )
    if not isinstance(entry.shape, tuple) or not all(isinstance(size, int) for size in entry.shape):
        yield f"{start}shape is {entry.shape!r}, expected a tuple of sizes"


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
    """Return a message suffix that names a similarly spelt method of the candidate, or ""."""
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
