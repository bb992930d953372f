"""Adapter from PythonFMU classes to `Component`."""

import ast
import inspect
import operator
import textwrap
from collections import defaultdict
from collections.abc import Callable, Collection, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from pythonfmu import Fmi2Slave
from pythonfmu.enums import Fmi2Status
from pythonfmu.variables import Boolean, Integer, Real, ScalarVariable, String

from ..core import component_log
from ..core.component import Component, Ports, Variable
from ..core.errors import (
    PASS_THROUGH_EXCEPTIONS,
    ComponentError,
    InputError,
    Problem,
    abbreviate_names,
    describe_exception,
)
from ..core.text import shorten, text_problem
from ..core.units import named_unit, parse_unit
from .object_state import snapshot
from .slave_protection import PYTHONFMU_ATTRIBUTES


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
    if text_problem(value):
        raise ValueError
    return value


class _Kind(NamedTuple):
    """Type of PythonFMU variables.

    Attributes:
        fmi_type: FMI 3.0 type name.
        cast: Conversion of a value for the setter, and of the getter's result.
        usual_type: Python type of an output that needs no conversion.
        convert: Lossless conversion of an output of another type.
        expected: What a message about an output expects.
    """

    fmi_type: str
    cast: Callable[[Any], Any]
    usual_type: type
    convert: Callable[[Any], Any]
    expected: str


_KINDS = {
    Real: _Kind("Float64", float, float, _to_float, "a number"),
    Integer: _Kind("Int32", int, int, operator.index, "an integer of 32 bits"),
    Boolean: _Kind("Boolean", bool, bool, _to_bool, "True or False"),
    # no usual type, because the characters of each text have to be checked
    String: _Kind("String", str, object, _to_str, "a text"),
}


class PythonFmuComponent(Component):
    """Component that runs a `pythonfmu.Fmi2Slave` without export as an FMU.

    Its state is the whole state of the Python object (see `object_state`), or the result of an
    overridden `_get_fmu_state`, as in an FMU that `cosim build` exports. The state of an FMU
    exported by PythonFMU contains only the registered variables.
    """

    binds_everything = False
    has_state = True

    def __init__(self, slave: Fmi2Slave, instance_name: str):
        self._slave, self._name, self._time = slave, instance_name, 0.0
        self._pythonfmu_variables: dict[str, ScalarVariable] = {
            v.name: v for v in slave.vars.values()
        }
        self._kinds = {v.name: _find_kind(v) for v in slave.vars.values()}
        types = {name: kind.fmi_type for name, kind in self._kinds.items()}
        self._units = checked_units(getattr(type(slave), "units", {}), types, type(slave))
        self.variables = [_to_variable(v, self._units.get(v.name)) for v in slave.vars.values()]
        self._setters: list[tuple[Callable[[Any], None], np.ndarray, int]] = []
        self._getters: list[
            tuple[str, Callable[[], Any], type, Callable[[Any], Any], np.ndarray, int]
        ] = []
        self._has_custom_state = type(slave)._get_fmu_state is not Fmi2Slave._get_fmu_state

    def set(self, name: str, value: Any) -> None:
        """Set one variable by its PythonFMU setter."""
        setter, kind = self._pythonfmu_variables[name].setter, self._kinds[name]
        self._call_user_code("set", setter, kind.cast(value))

    def get(self, name: str) -> Any:
        """Return the value of one variable by its PythonFMU getter."""
        value = self._call_user_code("get", self._pythonfmu_variables[name].getter)
        return self._kinds[name].cast(value)

    def unit_source(self, name: str) -> str:
        """Return class, file and line of the class attribute `units` if it names the variable."""
        return units_place(type(self._slave)) if name in self._units else ""

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Call the slave's `setup_experiment` and `enter_initialization_mode`."""
        self._time = start_time
        self._call_user_code(
            "setup_experiment", self._slave.setup_experiment, start_time, stop_time, None
        )
        self._call_user_code("enter_initialization_mode", self._slave.enter_initialization_mode)

    def exit_initialization_mode(self) -> None:
        """Call the slave's `exit_initialization_mode`."""
        self._call_user_code("exit_initialization_mode", self._slave.exit_initialization_mode)

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Pair the slave's setters and getters with the elements of the bound arrays."""
        self._setters = [
            (self._pythonfmu_variables[v.name].setter, array, part.start)
            for v, array, part in inputs.elements()
        ]
        self._getters = []
        for variable, array, part in outputs.elements():
            name, kind = variable.name, self._kinds[variable.name]
            getter = self._pythonfmu_variables[name].getter
            target = (kind.usual_type, kind.convert, array, part.start)
            self._getters.append((name, getter, *target))

    def set_inputs(self) -> None:
        """Pass the bound input values to the slave's setters."""
        self._call_user_code("set_inputs", self._apply_setters)

    def _apply_setters(self) -> None:
        for setter, array, index in self._setters:
            setter(array.item(index))

    def do_step(self, time: float, step_size: float) -> None:
        """Call the slave's `do_step`; any result but True is a ComponentError."""
        self._time = time
        returned = self._call_user_code("do_step", self._slave.do_step, time, step_size)
        if not returned:
            raise ComponentError(self._name, "do_step", f"returned {returned}, expected True", time)

    def get_outputs(self) -> None:
        """Write the values of the slave's getters into the bound output arrays."""
        self._call_user_code("get_outputs", self._apply_getters)

    def _apply_getters(self) -> None:
        for name, getter, usual_type, convert, array, index in self._getters:
            value = getter()
            try:
                array[index] = value if value.__class__ is usual_type else convert(value)
            except (TypeError, ValueError, OverflowError):
                expected = self._kinds[name].expected
                text = f'output "{name}" is {shorten(repr(value))}, expected {expected}'
                raise ComponentError(self._name, "get_outputs", text, self._time) from None

    def get_state(self) -> Any:
        """Return the slave's own state, or a snapshot of its attributes."""
        if self._has_custom_state:
            return self._slave._get_fmu_state()
        return snapshot(self._slave, PYTHONFMU_ATTRIBUTES)

    def set_state(self, state: Any) -> None:
        """Restore a state that `get_state` returned."""
        self._slave._set_fmu_state(state) if self._has_custom_state else state()

    def terminate(self) -> None:
        """Call the slave's `terminate`."""
        self._call_user_code("terminate", self._slave.terminate)

    def _call_user_code(self, function: str, call: Callable[..., Any], *arguments: Any) -> Any:
        """Call a method of the slave.

        Its exceptions become a ComponentError, and its log messages are forwarded.
        """
        try:
            return call(*arguments)
        except (*PASS_THROUGH_EXCEPTIONS, ComponentError):
            raise
        except BaseException as error:
            raise ComponentError(
                self._name, function, describe_exception(error), self._time
            ) from error
        finally:
            if self._slave.log_queue:
                self._forward_log()

    def _forward_log(self) -> None:
        for message in self._slave.log_queue:
            level = {
                Fmi2Status.ok: component_log.INFO,
                Fmi2Status.warning: component_log.WARNING,
            }.get(message.status, component_log.ERROR)
            component_log.log_message(self._name, level, message.msg)
        self._slave.log_queue.clear()


def _find_kind(registered: ScalarVariable) -> _Kind:
    return next(kind for base, kind in _KINDS.items() if isinstance(registered, base))


def _to_variable(registered: ScalarVariable, unit: str | None) -> Variable:
    unit = unit or getattr(registered, "unit", None)
    causality: Any = registered.causality.name if registered.causality else "local"
    return Variable(
        registered.name,
        _find_kind(registered).fmi_type,
        causality,
        registered.variability.name if registered.variability else "continuous",
        _start_value(registered) if causality in ("parameter", "input") else None,
        named_unit(unit) if unit else None,
        description=registered.description or "",
    )


def _start_value(registered: ScalarVariable) -> Any:
    try:
        return registered.getter()
    except AttributeError as error:
        raise InputError(
            f'the variable "{registered.name}" is registered, but has no value: {error}'
        ) from None


def checked_units(
    units: Any, types: Mapping[str, str], owner: type | None = None
) -> Mapping[str, str]:
    """Return the attribute `units` of a PythonFMU class after a check.

    Args:
        units: Value of the attribute, such as `{"rudder_angle": "rad"}`.
        types: FMI 3.0 type of each variable of the class.
        owner: The class, for messages.

    Raises:
        InputError: The attribute is not a dict of texts, names a variable that does not exist or is
            not of type Real, or contains an unknown unit.
    """
    if not isinstance(units, Mapping) or not all(
        isinstance(text, str) for text in (*units, *units.values())
    ):
        raise _refusal(owner, "is not a dict of names of variables and units")
    numbers = [name for name, kind in types.items() if kind == "Float64"]
    names_by_fault: dict[str, list[str]] = defaultdict(list)
    for name, unit in units.items():
        if fault := _find_fault(name, unit, numbers):
            names_by_fault[fault].append(f'"{name}"')
    if names_by_fault:
        faults = []
        for fault, names in names_by_fault.items():
            faults.append(fault.format(names=abbreviate_names(names, 4)))
        raise _refusal(owner, *faults)
    return units


def units_place(owner: type) -> str:
    """Return the place of the attribute `units`: its class, file and line, as far as known."""
    kind = next((each for each in owner.__mro__ if "units" in vars(each)), owner)
    try:
        lines, first = inspect.getsourcelines(kind)
        (definition,) = ast.parse(textwrap.dedent("".join(lines))).body
        file = Path(inspect.getfile(kind)).name
    except (OSError, TypeError, ValueError, SyntaxError):
        return f"{kind.__name__}.units"
    line = 1
    for node in getattr(definition, "body", ()):
        if ast.unparse(node).partition(" ")[0].rstrip(":") == "units":
            line = node.lineno
            break
    return f"{kind.__name__}.units ({file}:{first + line - 1})"


def _refusal(owner: type | None, *faults: str) -> InputError:
    attribute = units_place(owner) if owner else '"units"'
    return InputError([Problem(f"the class attribute {attribute} {fault}") for fault in faults])


def _find_fault(name: str, unit: str, numbers: Collection[str]) -> str:
    """Return the fault of an entry, with "{names}" in place of its variable.

    "" if there is none.
    """
    if name not in numbers:
        registered = abbreviate_names(numbers) or "none"
        return (
            "names {names}, but no register_variable of type Real does; registered: "
            f"{_escaped(registered)}"
        )
    try:
        parse_unit(unit)
    except ValueError as error:
        return f'contains "{_escaped(unit)}" for {{names}}: {_escaped(str(error))}'
    return ""


def _escaped(text: str) -> str:
    return text.replace("{", "{{").replace("}", "}}")
