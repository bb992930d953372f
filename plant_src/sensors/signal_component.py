"""Components of a few real inputs and outputs: what sensors, filters and faults have in common."""

from __future__ import annotations

import ctypes
import math
import struct
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from cosim.core.component import DTYPES, Causality, Component, Ports, PreparedCall, Variability, Variable
from cosim.core.errors import ComponentError, InputError, did_you_mean
from cosim.core.units import parse_unit

from ..json_reader import JsonReader
from .counter_based_noise import CounterBasedNoise

_FLOAT, _FLAG = DTYPES["Float64"], DTYPES["Boolean"]


class SignalComponent(Component):
    """Computes real and Boolean outputs from real inputs, once per step.

    A subclass declares `variables`, names what changes while it runs in `memory`, and implements `begin` and `advance`, which
    read `inputs` and fill `outputs` and `flags` (floats and Booleans in the order of the variables). Steps of a few
    microseconds are why it is no PythonFMU class.

    It belongs into a stage after those that feed it. What it computes in a step that ends at time t is then what its inputs
    are at t, and what its readers see at t.
    """

    binds_everything = True
    has_state = True
    #: attributes that change while it runs, besides inputs, outputs and parameters
    state_attributes: tuple[str, ...] = ()
    #: random numbers that a sample needs; they follow from the class, the instance's name, the parameter `seed` and its number
    random_number_count = 0
    noise: CounterBasedNoise

    def __init__(self, instance_name: str, variables: Sequence[Variable]):
        self.name, self.variables = instance_name, list(variables)
        self._by_name = {variable.name: variable for variable in variables}
        #: parameters by name; arrays are flat lists
        self.parameters = {v.name: _flat_value(v, v.start) for v in variables if v.causality == "parameter"}
        inputs = [v for v in variables if v.causality == "input"]
        outputs = [v for v in variables if v.causality == "output"]
        self._ranges = {"input": _variable_ranges(inputs), "output": _variable_ranges(outputs)}
        self.inputs: Sequence[float] = tuple(x for v in inputs for x in np.ravel(_flat_value(v, v.start)).tolist())
        self.outputs: Sequence[float] = (0.0,) * sum(len(v.scalar_names) for v in outputs if v.dtype == _FLOAT)
        self.flags: Sequence[bool] = (False,) * sum(len(v.scalar_names) for v in outputs if v.dtype == _FLAG)
        self._input_data: Any = np.array(self.inputs).data
        self._output_data: Any = np.array(self.outputs).data
        self._flag_data: Any = np.array(self.flags, _FLAG).data
        self._read = struct.Struct(f"{len(self.inputs)}d").unpack_from
        self._write = struct.Struct(f"{len(self.outputs)}d").pack_into
        self._write_flags = struct.Struct(f"{len(self.flags)}?").pack_into
        self._initializing, self.start_time = False, 0.0

    # -- for subclasses ------------------------------------------------------------------------------------------------

    def apply_parameters(self) -> None:
        """Parameters have changed: compute what follows from them."""

    def initialise(self) -> None:
        """The outputs at `start_time`, and the memory as it is then; called again when the inputs change before the start."""
        raise NotImplementedError

    def advance(self, now: float, step_size: float) -> None:
        """The outputs at `now` (s), one step after the last ones."""
        raise NotImplementedError

    # -- variables -----------------------------------------------------------------------------------------------------

    def _variable(self, name: str, function: str) -> Variable:
        if name not in self._by_name:
            raise ComponentError(self.name, function, f'no variable "{name}"{did_you_mean(name, self._by_name)}')
        return self._by_name[name]

    def set(self, name: str, value: Any) -> None:
        variable = self._variable(name, "set")
        if variable.causality == "output":
            raise ComponentError(self.name, "set", f"{name} is an output")
        value = _flat_value(variable, value)
        if variable.causality == "input":
            self._set_input(name, value if isinstance(value, list) else [value])
            return
        self.parameters[name] = value
        try:
            self.apply_parameters()
        except ValueError as error:
            raise ComponentError(self.name, "set", f"{name}: {error}") from None

    def _set_input(self, name: str, values: Sequence[float]) -> None:
        first, end = self._ranges["input"][name]
        self.inputs = (*self.inputs[:first], *values, *self.inputs[end:])
        struct.pack_into(f"{len(values)}d", self._input_data, 8 * first, *values)

    def get(self, name: str) -> Any:
        variable = self._variable(name, "get")
        if variable.causality == "parameter":
            return deepcopy(self.parameters[name])
        first, end = self._ranges[variable.causality][name]
        values = self.inputs if variable.causality == "input" else self.flags if variable.dtype == _FLAG else self.outputs
        found = list(values[first:end])
        return found if variable.shape else found[0]

    # -- life cycle ----------------------------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._input_data = inputs.arrays.get(_FLOAT, np.empty(0)).data
        self._output_data = outputs.arrays.get(_FLOAT, np.empty(0)).data
        self._flag_data = outputs.arrays.get(_FLAG, np.empty(0, _FLAG)).data

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self.start_time, self._initializing = start_time, True
        if self.random_number_count:
            self.noise = CounterBasedNoise(self.random_number_count, type(self).__name__, self.name, self.parameters["seed"])
        self.apply_parameters()
        self.initialise()

    def exit_initialization_mode(self) -> None:
        self._initializing = False

    def set_inputs(self) -> None:
        self.inputs = self._read(self._input_data)
        if self._initializing:
            self.initialise()

    def do_step(self, time: float, step_size: float) -> None:
        try:
            self.advance(time + step_size, step_size)
        except (ArithmeticError, ValueError, OSError) as error:
            raise ComponentError(self.name, "do_step", f"{type(error).__name__}: {error}", time) from error

    def get_outputs(self) -> None:
        self._write(self._output_data, 0, *self.outputs)
        self._write_flags(self._flag_data, 0, *self.flags)

    def prepare_step_calls(self, clock: ctypes.c_double, step_size: float) -> Sequence[PreparedCall]:
        return [PreparedCall(self._turn, (clock, step_size), "do_step")]

    def _turn(self, clock: ctypes.c_double, step_size: float) -> int:
        self.inputs = self._read(self._input_data)
        self.do_step(clock.value, step_size)
        self._write(self._output_data, 0, *self.outputs)
        self._write_flags(self._flag_data, 0, *self.flags)
        return 0

    def get_state(self) -> Any:
        names = ("inputs", "outputs", "flags", "parameters", "start_time", "_initializing", *self.state_attributes)
        return {name: deepcopy(getattr(self, name)) for name in names}

    def set_state(self, state: Any) -> None:
        for name, value in state.items():
            setattr(self, name, deepcopy(value))
        self.apply_parameters()

    def free_state(self, state: Any) -> None: ...

    def terminate(self) -> None: ...

    def free(self) -> None: ...


def _variable_ranges(variables: Sequence[Variable]) -> dict[str, tuple[int, int]]:
    """Where the values of each variable lie among those of its dtype."""
    filled = dict.fromkeys((v.dtype for v in variables), 0)
    places = {}
    for variable in variables:
        first = filled[variable.dtype]
        filled[variable.dtype] = first + len(variable.scalar_names)
        places[variable.name] = (first, filled[variable.dtype])
    return places


def _flat_value(variable: Variable, value: Any) -> Any:
    """A value as a scalar or flat list of the variable's type. Raises ComponentError for what is no such value."""
    kind: type = {"Float64": float, "Boolean": bool, "String": str, "Int32": int}[variable.type]
    flat = np.ravel(value).tolist() if variable.shape else [value]
    try:
        values = [kind(x) for x in flat]
    except (TypeError, ValueError):
        values = []
    if len(values) != len(variable.scalar_names):
        expected = f"{math.prod(variable.shape)} values of type {variable.type}"
        raise ComponentError(variable.name, "set", f"found {value!r}, expected {expected}")
    return values if variable.shape else values[0]


def check_seed(reader: JsonReader, seed: Any) -> None:
    """Complain about a seed that is none."""
    reader.integer(seed, ("seed",), 0, 2**31 - 1)


def raise_problems(reader: JsonReader) -> None:
    """Raises InputError with all problems that a reader of arguments has found."""
    if reader.problems:
        raise InputError(reader.problems)


# -- declaring variables -----------------------------------------------------------------------------------------------


def real_variable(
    name: str,
    unit: str,
    causality: Causality,
    start: Any = None,
    description: str = "",
    *,
    shape: tuple[int, ...] = (),
    minimum: float | None = None,
    maximum: float | None = None,
    variability: Variability | None = None,
) -> Variable:
    """A real variable; parameters are tunable unless `variability` says otherwise, inputs start at zero."""
    kind = variability or ("tunable" if causality == "parameter" else "continuous")
    if start is None and causality == "input":
        start = (0.0,) * math.prod(shape) if shape else 0.0
    known = parse_unit(unit) if unit else None
    return Variable(name, "Float64", causality, kind, start, known, shape, description, minimum, maximum)


def vector_variables(
    name: str, axes: str, unit: str, causality: Causality, start: float | None = None, text: str = ""
) -> list[Variable]:
    """Real variables `name.axis`, one for each letter of `axes`."""
    return [real_variable(f"{name}.{axis}", unit, causality, start, f"{text}: {axis}" if text else "") for axis in axes]


def real_parameter(
    name: str, unit: str, start: Any, description: str, minimum: float | None = 0.0, maximum: float | None = None
) -> Variable:
    """A tunable real parameter that may not be negative, unless `minimum` says otherwise."""
    return real_variable(name, unit, "parameter", start, description, minimum=minimum, maximum=maximum)


def seed_parameter(seed: int) -> Variable:
    """The parameter `seed` of everything random in a component. Raises InputError for what is no such number."""
    reader = JsonReader()
    check_seed(reader, seed)
    raise_problems(reader)
    return Variable("seed", "Int32", "parameter", "fixed", seed, description="of all random numbers", minimum=0)


def boolean_variable(name: str, causality: Causality, description: str, start: bool | None = None) -> Variable:
    """A Boolean variable."""
    kind: Variability = "tunable" if causality == "parameter" else "discrete"
    return Variable(name, "Boolean", causality, kind, start, description=description)


def pose_inputs(name: str, place: str = "position") -> list[Variable]:
    """Inputs `name.position.x|y|z` (m, world) and `name.orientation.w|x|y|z` (unit quaternion, body to world), 7 numbers."""
    orientation = [real_variable(f"{name}.orientation.{part}", "1", "input", float(part == "w")) for part in "wxyz"]
    return [*vector_variables(f"{name}.{place}", "xyz", "m", "input"), *orientation]
