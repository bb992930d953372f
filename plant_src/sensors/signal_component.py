"""Base classes of sensors, estimators and faults: few real inputs and outputs."""

import ctypes
import math
import struct
from collections import deque
from collections.abc import Sequence
from copy import deepcopy
from typing import Any

import numpy as np

from cosim.core.component import DTYPES, Component, Ports, PreparedCall, Variable
from cosim.core.errors import ComponentError, did_you_mean

from ..variable_views import recorded_others
from .counter_based_noise import CounterBasedNoise
from .variable_declarations import real_parameter, real_variable

_FLOAT, _FLAG = DTYPES["Float64"], DTYPES["Boolean"]

#: attributes that belong to the state of every component
_STATE_ATTRIBUTES = ("inputs", "outputs", "flags", "parameters", "start_time", "_initializing")

#: rounding errors of a sample number and of a time (s)
_SAMPLE_TOLERANCE, _TIME_TOLERANCE = 1e-6, 1e-9

#: values of the real outputs without `time`, and of the Boolean outputs
Measurement = tuple[Sequence[float], Sequence[bool]]


class SignalComponent(Component):
    """Component that computes real and Boolean outputs from real inputs, once per step.

    A subclass declares its variables, names its internal state in `state_attributes` and implements
    `initialise` and `advance`. These read `inputs` and set `outputs` (floats) and `flags`
    (Booleans), each in the order of the variables. It is not a PythonFMU class because a step takes
    a few microseconds only.

    In a scenario the component belongs to a stage after the components that it is connected to: the
    outputs of a step that ends at time t then belong to the inputs at t.

    Args:
        instance_name: Name of the component.
        variables: Inputs, outputs and parameters. Inputs are Float64, outputs Float64 or Boolean.
    """

    binds_everything = True
    has_state = True
    #: attributes that belong to the state, besides inputs, outputs, flags and parameters
    state_attributes: tuple[str, ...] = ()
    #: random numbers per sample; they depend on the class, the name of the instance, the parameter
    #: `seed` and the sample number
    random_number_count = 0
    noise: CounterBasedNoise

    def __init__(self, instance_name: str, variables: Sequence[Variable]):
        self.name, self.variables = instance_name, list(variables)
        self._by_name = {variable.name: variable for variable in variables}
        #: parameters by name; arrays are flat lists
        self.parameters = {
            v.name: _flat_value(v, v.start) for v in variables if v.causality == "parameter"
        }
        inputs = [v for v in variables if v.causality == "input"]
        outputs = [v for v in variables if v.causality == "output"]
        self._ranges = {"input": _variable_ranges(inputs), "output": _variable_ranges(outputs)}
        starts = [np.ravel(_flat_value(v, v.start)) for v in inputs]
        self.inputs: Sequence[float] = tuple(np.concatenate([[], *starts]).tolist())
        self.outputs: Sequence[float] = (0.0,) * _scalar_count(outputs, _FLOAT)
        self.flags: Sequence[bool] = (False,) * _scalar_count(outputs, _FLAG)
        self._input_data: Any = np.array(self.inputs).data
        self._output_data: Any = np.array(self.outputs).data
        self._flag_data: Any = np.array(self.flags, _FLAG).data
        self._read = struct.Struct(f"{len(self.inputs)}d").unpack_from
        self._write = struct.Struct(f"{len(self.outputs)}d").pack_into
        self._write_flags = struct.Struct(f"{len(self.flags)}?").pack_into
        self._initializing, self.start_time = False, 0.0

    # -- for subclasses ----------------------------------------------------------------------------

    def apply_parameters(self) -> None:
        """Compute values that depend on parameters; called after every change.

        Raises ValueError for an invalid parameter.
        """

    def initialise(self) -> None:
        """Set outputs and state at `start_time`.

        Called again when inputs change in initialization mode.
        """
        raise NotImplementedError

    def advance(self, now: float, step_size: float) -> None:
        """Set outputs and state at `now` (s), the end of a step of `step_size` (s)."""
        raise NotImplementedError

    # -- variables ---------------------------------------------------------------------------------

    def _variable(self, name: str, function: str) -> Variable:
        """Return the variable `name`. Raises ComponentError if it does not exist."""
        if name not in self._by_name:
            raise ComponentError(
                self.name, function, f'no variable "{name}"{did_you_mean(name, self._by_name)}'
            )
        return self._by_name[name]

    def set(self, name: str, value: Any) -> None:
        """Set an input or a parameter. Raises ComponentError for an output or an invalid value."""
        variable = self._variable(name, "set")
        if variable.causality == "output":
            raise ComponentError(self.name, "set", f"{name} is an output")
        value = _flat_value(variable, value)
        if variable.causality == "input":
            values = value if isinstance(value, list) else [value]
            first, end = self._ranges["input"][name]
            self.inputs = (*self.inputs[:first], *values, *self.inputs[end:])
            struct.pack_into(f"{len(values)}d", self._input_data, 8 * first, *values)
            return
        self.parameters[name] = value
        try:
            self.apply_parameters()
        except ValueError as error:
            raise ComponentError(self.name, "set", f"{name}: {error}") from None

    def get(self, name: str) -> Any:
        """Return the present value of a variable, an array as a flat list."""
        variable = self._variable(name, "get")
        if variable.causality == "parameter":
            return deepcopy(self.parameters[name])
        first, end = self._ranges[variable.causality][name]
        if variable.causality == "input":
            values: Sequence[Any] = self.inputs
        else:
            values = self.flags if variable.dtype == _FLAG else self.outputs
        scalars = list(values[first:end])
        return scalars if variable.shape else scalars[0]

    # -- life cycle --------------------------------------------------------------------------------

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Take the arrays of the engine."""
        self._input_data = inputs.arrays.get(_FLOAT, np.empty(0)).data
        self._output_data = outputs.arrays.get(_FLOAT, np.empty(0)).data
        self._flag_data = outputs.arrays.get(_FLAG, np.empty(0, _FLAG)).data
        self._recorded_others = recorded_others(outputs)

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Set the initial state and outputs."""
        self.start_time, self._initializing = start_time, True
        if self.random_number_count:
            self.noise = CounterBasedNoise(
                self.random_number_count, type(self).__name__, self.name, self.parameters["seed"]
            )
        self.apply_parameters()
        self.initialise()

    def exit_initialization_mode(self) -> None:
        """End the repetition of `initialise`."""
        self._initializing = False

    def set_inputs(self) -> None:
        """Read the inputs; in initialization mode the outputs follow them."""
        self.inputs = self._read(self._input_data)
        if self._initializing:
            self.initialise()

    def do_step(self, time: float, step_size: float) -> None:
        """Advance from `time` (s) by `step_size` (s). Raises ComponentError if that fails."""
        try:
            self.advance(time + step_size, step_size)
        except (ArithmeticError, ValueError, OSError) as error:
            raise ComponentError(
                self.name, "do_step", f"{type(error).__name__}: {error}", time
            ) from error

    def get_outputs(self) -> None:
        """Write the outputs."""
        self._write(self._output_data, 0, *self.outputs)
        self._write_flags(self._flag_data, 0, *self.flags)
        for name, recorded in self._recorded_others:
            recorded[:] = self.get(name)

    def prepare_step_calls(
        self, current_time: ctypes.c_double, step_size: float
    ) -> Sequence[PreparedCall]:
        """Return one call that reads the inputs, does a step and writes the outputs."""
        return [PreparedCall(self._exchange_and_step, (current_time, step_size), "do_step")]

    def _exchange_and_step(self, current_time: ctypes.c_double, step_size: float) -> int:
        self.inputs = self._read(self._input_data)
        self.do_step(current_time.value, step_size)
        self.get_outputs()
        return 0

    def get_state(self) -> Any:
        """Return a copy of the state."""
        return {
            name: deepcopy(getattr(self, name))
            for name in (*_STATE_ATTRIBUTES, *self.state_attributes)
        }

    def set_state(self, state: Any) -> None:
        """Restore a state; it stays valid."""
        for name, value in state.items():
            setattr(self, name, deepcopy(value))
        self.apply_parameters()


class SampledSensor(SignalComponent):
    """Sensor with a sample rate and a latency.

    The last real output is the `time` (s) of the sample.

    Sample n is taken at the end of the first step that reaches start + n / `rate` and is published
    `latency` (s) later. Sample 0 is published at the start.
    """

    state_attributes: tuple[str, ...] = ("_number", "_sample_time", "_pending")

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Take a sample.

        Args:
            number: Number of the sample; selects the row of random numbers.
            elapsed: Time since the last sample (s), 0 for the first one.

        Returns:
            Real outputs without `time`, and Boolean outputs. Empty real outputs leave the last
            values and their time.
        """
        raise NotImplementedError

    def initialise(self) -> None:
        """Take and publish sample 0."""
        self._number, self._sample_time = 0, self.start_time
        self._pending = deque[tuple[float, float, Measurement]]()
        self.outputs = (0.0,) * len(self.outputs)
        self._publish(self.start_time, self.measure(0, 0.0))

    def advance(self, now: float, step_size: float) -> None:
        """Take a sample that is due and publish those whose latency has passed."""
        number = int((now - self.start_time) * self.parameters["rate"] + _SAMPLE_TOLERANCE)
        if number > self._number:
            measurement = self.measure(number, now - self._sample_time)
            self._number, self._sample_time = number, now
            self._pending.append(
                (now + self.parameters["latency"] - _TIME_TOLERANCE, now, measurement)
            )
        while self._pending and self._pending[0][0] <= now:
            _, taken, measurement = self._pending.popleft()
            self._publish(taken, measurement)

    def _publish(self, taken: float, measurement: Measurement) -> None:
        values, self.flags = measurement
        if values:
            self.outputs = (*values, taken)


def timing_variables(rate: float, latency: float = 0.0) -> list[Variable]:
    """Declare the parameters `rate` (Hz) and `latency` (s) and the output `time`.

    The latter must be the last real output.
    """
    return [
        real_variable(
            "rate", "Hz", "parameter", rate, "samples per second", minimum=1e-3, variability="fixed"
        ),
        real_parameter("latency", "s", latency, "from the sample to its output"),
        real_variable("time", "s", "output", description="when the sample was taken"),
    ]


def _scalar_count(variables: Sequence[Variable], dtype: np.dtype[Any]) -> int:
    """Return the number of scalars of a dtype."""
    return sum(len(v.scalar_names) for v in variables if v.dtype == dtype)


def _variable_ranges(variables: Sequence[Variable]) -> dict[str, tuple[int, int]]:
    """Return the range (first, end) of each variable among the scalars of its dtype."""
    counts = dict.fromkeys((v.dtype for v in variables), 0)
    ranges = {}
    for variable in variables:
        first = counts[variable.dtype]
        counts[variable.dtype] = first + len(variable.scalar_names)
        ranges[variable.name] = (first, counts[variable.dtype])
    return ranges


def _flat_value(variable: Variable, value: Any) -> Any:
    """Return `value` as a scalar or flat list of the variable's type.

    Raises ComponentError if it is not such a value.
    """
    kind: type = {"Float64": float, "Boolean": bool, "String": str, "Int32": int}[variable.type]
    flat = np.ravel(value).tolist() if variable.shape else [value]
    try:
        values = [kind(x) for x in flat]
    except (TypeError, ValueError):
        values = []
    if len(values) != len(variable.scalar_names):
        count = math.prod(variable.shape)
        expected = f"{count} {'value' if count == 1 else 'values'} of type {variable.type}"
        raise ComponentError(variable.name, "set", f"found {value!r}, expected {expected}")
    return values if variable.shape else values[0]
