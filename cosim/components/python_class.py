"""PythonFMU classes as components: the same file runs in process or exported as an FMU."""

from __future__ import annotations

import importlib.util
import inspect
import operator
import sys
from collections.abc import Callable, Mapping
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status
from pythonfmu.variables import Boolean, Integer, Real, ScalarVariable, String

from ..core import component_log
from ..core.component import Component, Ports, Variable
from ..core.errors import PASS_THROUGH_EXCEPTIONS, ComponentError, InputError, Problem, describe_exception, did_you_mean
from ..core.paths import is_file, resolve_path
from ..core.units import parse_unit
from .conformance import find_violations
from .object_state import snapshot

_TYPES = {Real: "Float64", Integer: "Int32", Boolean: "Boolean", String: "String"}
_CASTS: Mapping[str, Callable[[Any], Any]] = {"Float64": float, "Int32": int, "Boolean": bool, "String": str}


def _to_float(value: Any) -> float:
    if isinstance(value, str | bytes):
        raise TypeError
    return float(value)


def _to_bool(value: Any) -> bool:
    if isinstance(value, np.bool_):
        return bool(value)
    if operator.index(value) not in (0, 1):
        raise ValueError
    return bool(value)


def _to_str(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


#: what an output of a type is as a rule, and what else becomes one without loss
_OUTPUT_TYPES: Mapping[str, tuple[type, Callable[[Any], Any]]] = {
    "Float64": (float, _to_float),
    "Int32": (int, operator.index),
    "Boolean": (bool, _to_bool),
    "String": (str, _to_str),
}


class PythonFmuComponent(Component):
    """A `pythonfmu.Fmi2Slave` that runs in process, without export.

    Its state is all that it holds (see `memento`), or what its own `_get_fmu_state` says. An exported FMU by PythonFMU saves the
    registered variables alone.
    """

    binds_everything = False
    has_state = True

    def __init__(self, slave: Fmi2Slave, instance_name: str):
        self._slave, self._name, self._time = slave, instance_name, 0.0
        self._pythonfmu_variables: dict[str, ScalarVariable] = {v.name: v for v in slave.vars.values()}
        self.variables = [_to_variable(v) for v in slave.vars.values()]
        self._setters: list[tuple[Callable[[Any], None], np.ndarray, int]] = []
        self._getters: list[tuple[str, Callable[[], Any], type, Callable[[Any], Any], np.ndarray, int]] = []
        self._types = {variable.name: variable.type for variable in self.variables}
        self._has_custom_state = type(slave)._get_fmu_state is not Fmi2Slave._get_fmu_state

    def set(self, name: str, value: Any) -> None:
        registered = self._pythonfmu_variables[name]
        self._call_user_code("set", registered.setter, _CASTS[_fmi_type(registered)](value))

    def get(self, name: str) -> Any:
        registered = self._pythonfmu_variables[name]
        return _CASTS[_fmi_type(registered)](self._call_user_code("get", registered.getter))

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._time = start_time
        self._call_user_code("setup_experiment", self._slave.setup_experiment, start_time, stop_time, None)
        self._call_user_code("enter_initialization_mode", self._slave.enter_initialization_mode)

    def exit_initialization_mode(self) -> None:
        self._call_user_code("exit_initialization_mode", self._slave.exit_initialization_mode)

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._setters = [(self._pythonfmu_variables[v.name].setter, *place) for v, place in _array_positions(inputs)]
        self._getters = [
            (v.name, self._pythonfmu_variables[v.name].getter, *_OUTPUT_TYPES[v.type], *place)
            for v, place in _array_positions(outputs)
        ]

    def set_inputs(self) -> None:
        self._call_user_code("set_inputs", self._apply_setters)

    def _apply_setters(self) -> None:
        for setter, array, index in self._setters:
            setter(array.item(index))

    def do_step(self, time: float, step_size: float) -> None:
        self._time = time
        returned = self._call_user_code("do_step", self._slave.do_step, time, step_size)
        if not returned:
            raise ComponentError(self._name, "do_step", f"returned {returned}, expected True", time)

    def get_outputs(self) -> None:
        self._call_user_code("get_outputs", self._apply_getters)

    def _apply_getters(self) -> None:
        for name, getter, kind, accept, array, index in self._getters:
            value = getter()
            try:
                array[index] = value if value.__class__ is kind else accept(value)
            except (TypeError, ValueError, OverflowError):
                raise TypeError(f'output "{name}" is {value!r}, expected a value of type {self._types[name]}') from None

    def get_state(self) -> Any:
        return self._slave._get_fmu_state() if self._has_custom_state else snapshot(self._slave, {"vars", "log_queue"})

    def set_state(self, state: Any) -> None:
        self._slave._set_fmu_state(state) if self._has_custom_state else state()

    def free_state(self, state: Any) -> None: ...

    def terminate(self) -> None:
        self._call_user_code("terminate", self._slave.terminate)

    def free(self) -> None: ...

    def _call_user_code(self, function: str, call: Callable[..., Any], *arguments: Any) -> Any:
        """Call user code; what it raises becomes a ComponentError, what it logged reaches the log."""
        try:
            return call(*arguments)
        except PASS_THROUGH_EXCEPTIONS:
            raise
        except BaseException as error:
            raise ComponentError(self._name, function, describe_exception(error), self._time) from error
        finally:
            if self._slave.log_queue:
                self._forward_log()

    def _forward_log(self) -> None:
        for message in self._slave.log_queue:
            level = {Fmi2Status.ok: component_log.INFO, Fmi2Status.warning: component_log.WARNING}.get(
                message.status, component_log.ERROR
            )
            component_log.log_message(self._name, level, message.msg)
        self._slave.log_queue.clear()


def _fmi_type(registered: ScalarVariable) -> str:
    return next(name for kind, name in _TYPES.items() if isinstance(registered, kind))


def _to_variable(registered: ScalarVariable) -> Variable:
    unit = getattr(registered, "unit", None)
    causality: Any = registered.causality.name if registered.causality else "local"
    return Variable(
        registered.name,
        _fmi_type(registered),
        causality,
        registered.variability.name if registered.variability else "continuous",
        registered.getter() if causality in ("parameter", "input") else None,
        parse_unit(unit) if unit else None,
        description=registered.description or "",
    )


def _array_positions(ports: Ports) -> list[tuple[Variable, tuple[np.ndarray, int]]]:
    filled = dict.fromkeys(ports.arrays, 0)
    places = []
    for variable in ports.variables:
        places.append((variable, (ports.arrays[variable.dtype], filled[variable.dtype])))
        filled[variable.dtype] += 1
    return places


def load_component(reference: str, folder: Path, instance_name: str, arguments: Mapping[str, Any]) -> Component:
    """An instance of `file.py:Class`, a component or a PythonFMU class; relative paths start at `folder`.

    Raises InputError when the file, the class, its arguments or what it makes are not what they should be.
    """
    kind = load_object(reference, folder)
    if inspect.isclass(kind) and issubclass(kind, Fmi2Slave):
        if "instance_name" in arguments:
            raise InputError(f'{reference} gets its "instance_name" from the scenario; it is no argument')
        return PythonFmuComponent(_construct(kind, reference, instance_name=instance_name, **arguments), instance_name)
    made = _construct(kind, reference, instance_name, **arguments)
    if found := [Problem(f"{reference} makes a {type(made).__name__}: {text}") for text in find_violations(made)]:
        raise InputError(found)
    return made


def _construct(kind: Callable[..., Any], reference: str, /, *positional: Any, **named: Any) -> Any:
    try:
        inspect.signature(kind).bind(*positional, **named)
    except TypeError as error:
        raise InputError(f"{reference} does not accept these arguments: {error}") from None
    try:
        return kind(*positional, **named)
    except (InputError, *PASS_THROUGH_EXCEPTIONS):
        raise
    except BaseException as error:
        raise InputError(f"{reference} cannot be constructed: {describe_exception(error)}") from error


def load_object(reference: str, folder: Path) -> Any:
    """What `file.py:name` refers to. Raises InputError with the nearest name when there is no such thing."""
    file, separator, name = reference.rpartition(":")
    if not separator or not file.endswith(".py") or not name.isidentifier():
        raise InputError(f'expected "file.py:name", found "{reference}"')
    path = resolve_path(folder / file)
    if not is_file(path):
        raise InputError(f'file "{file}" does not exist')
    module = _import_file(path)
    if not hasattr(module, name):
        public = [key for key in vars(module) if not key.startswith("_")]
        raise InputError(Problem(f'"{file}" defines no "{name}"{did_you_mean(name, public)}'))
    return getattr(module, name)


def package_root(path: Path) -> Path:
    """The folder that holds a file's outermost package; the file's own folder when it is in no package."""
    root = path.parent
    while (root / "__init__.py").is_file():
        root = root.parent
    return root


def package_files(path: Path) -> list[Path]:
    """A Python file and everything it may import relatively: all modules of its outermost package."""
    inside = path.resolve().relative_to(package_root(path.resolve())).parts
    return [path] if len(inside) == 1 else sorted((package_root(path.resolve()) / inside[0]).rglob("*.py"))


def _import_file(path: Path) -> ModuleType:
    """Import a file, as a member of its package if it is in one, under a name made unique by the root's path."""
    root = package_root(path)
    unique = f"_cosim_{sha256(str(root).encode()).hexdigest()[:12]}"
    if unique not in sys.modules:
        namespace = ModuleType(unique)
        namespace.__path__ = [str(root)]
        sys.modules[unique] = namespace
    name = ".".join((unique, *path.relative_to(root).with_suffix("").parts))
    try:
        return importlib.import_module(name)
    except PASS_THROUGH_EXCEPTIONS:
        raise
    except BaseException as error:
        raise InputError(f'"{path.name}" cannot be imported: {type(error).__name__}: {error}') from error
