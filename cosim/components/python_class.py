"""Loading of components from Python classes.

PythonFMU slaves, or classes that implement `Component` themselves.
"""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from ..core.component import Component
from ..core.errors import PASS_THROUGH_EXCEPTIONS, InputError, Problem, describe_exception
from .conformance import find_violations
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
    """Raise InputError unless a PythonFMU class has a method `do_step` that accepts the time and the step size."""
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
