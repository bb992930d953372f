"""Loading of components from Python classes: PythonFMU slaves, or classes that implement `Component` themselves."""

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


def load_component(reference: str, folder: Path, instance_name: str, arguments: Mapping[str, Any]) -> Component:
    """Import a class, construct it and return it as a component.

    Args:
        reference: File and class (or function) as "file.py:Class": a PythonFMU class, or one that creates a `Component`.
        folder: Folder that a relative file path starts from.
        instance_name: Name of the component.
        arguments: Further keyword arguments of the class.

    Raises:
        InputError: The class cannot be imported, does not accept the arguments or cannot be constructed, or the constructed
            object does not conform to `Component`.
    """
    factory = load_object(reference, folder)
    if _is_pythonfmu_class(factory):
        from .python_fmu import PythonFmuComponent

        if "instance_name" in arguments:
            raise InputError(f'{reference} receives its "instance_name" from the scenario; remove it from the arguments')
        named = {"instance_name": instance_name, **_resources(factory), **arguments}
        return PythonFmuComponent(_construct(factory, reference, **named), instance_name)
    component: Component = _construct(factory, reference, instance_name, **arguments)
    type_name = type(component).__name__
    if problems := [Problem(f"{reference} creates a {type_name}: {text}") for text in find_violations(component)]:
        raise InputError(problems)
    return component


def _is_pythonfmu_class(factory: object) -> bool:
    """Return whether a class derives from `pythonfmu.Fmi2Slave`.

    A module that defines such a class has imported `pythonfmu`, so other components are loaded without importing it.
    """
    package = sys.modules.get("pythonfmu")
    return package is not None and inspect.isclass(factory) and issubclass(factory, package.Fmi2Slave)


def _resources(factory: type) -> dict[str, str]:
    """Return the argument `resources` for a PythonFMU class that accepts it: the folder of its file, as in an exported FMU."""
    parameters = inspect.signature(factory).parameters
    accepted = "resources" in parameters or any(one.kind is one.VAR_KEYWORD for one in parameters.values())
    file = getattr(sys.modules.get(factory.__module__), "__file__", None)
    return {"resources": str(Path(file).parent)} if accepted and file else {}


def _construct(factory: Callable[..., Any], reference: str, /, *positional: Any, **named: Any) -> Any:
    try:
        inspect.signature(factory).bind(*positional, **named)
    except TypeError as error:
        raise InputError(f"{reference} does not accept these arguments: {error}") from None
    try:
        return factory(*positional, **named)
    except (InputError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise InputError(f"{reference} cannot be constructed: {describe_exception(error)}") from error
