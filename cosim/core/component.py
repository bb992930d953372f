"""The one contract of the importer: what an FMU, a Python class and the plant all are.

A component lives through the FMI Co-Simulation life cycle:

    bind                                            once: the arrays that carry its inputs and outputs
    instantiate                                     once: foreign code is loaded here, not before
    set                                             parameters and start values
    enter_initialization_mode                       { set_inputs, get_outputs } may be repeated here
    exit_initialization_mode                        get_outputs: the initial outputs
    { set_inputs, do_step, get_outputs }            once per step; set of tunable parameters between steps
    terminate, free                                 free is always called, exactly once, also after a failure

Values travel in typed arrays ("ports") that the engine owns: on the hot path nothing is converted, allocated or looked up.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from .errors import ComponentError, did_you_mean
from .units import Unit

Causality = Literal["parameter", "calculatedParameter", "structuralParameter", "input", "output", "local", "independent"]
Variability = Literal["constant", "fixed", "tunable", "discrete", "continuous"]

DTYPES: Mapping[str, np.dtype[Any]] = {
    "Float64": np.dtype(np.float64),
    "Float32": np.dtype(np.float32),
    "Int8": np.dtype(np.int8),
    "UInt8": np.dtype(np.uint8),
    "Int16": np.dtype(np.int16),
    "UInt16": np.dtype(np.uint16),
    "Int32": np.dtype(np.int32),
    "UInt32": np.dtype(np.uint32),
    "Int64": np.dtype(np.int64),
    "UInt64": np.dtype(np.uint64),
    "Boolean": np.dtype(np.bool_),
    "Enumeration": np.dtype(np.int64),
    "String": np.dtype(object),
    "Binary": np.dtype(object),
    "Clock": np.dtype(np.bool_),
}


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable of a component as FMI describes it.

    `type` is an FMI 3.0 type name (FMI 2.0 Real is Float64, Integer is Int32). `shape` is () for a scalar; an array
    occupies consecutive slots in row-major order. `dtype` is how a value lies in memory; it differs from the usual one
    of the type only where FMI 2.0 demands it (Boolean and Enumeration are C int there). `items` are the names and values of an
    enumeration; a `relative` quantity is a difference, to which the offset of a unit does not apply.
    """

    name: str
    type: str = "Float64"
    causality: Causality = "local"
    variability: Variability = "continuous"
    start: Any = None
    unit: Unit | None = None
    shape: tuple[int, ...] = ()
    description: str = ""
    minimum: float | None = None
    maximum: float | None = None
    items: tuple[tuple[str, int], ...] = ()
    relative_quantity: bool = False
    dtype: np.dtype[Any] = field(default=None)  # type: ignore[arg-type]

    def __post_init__(self) -> None:
        if self.type not in DTYPES:
            raise ValueError(
                f'variable "{self.name}": type is "{self.type}", expected one of FMI 3.0{did_you_mean(self.type, DTYPES)}'
            )
        if self.dtype is None:
            object.__setattr__(self, "dtype", DTYPES[self.type])

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of the scalars this variable consists of: itself, or "name[1]", "name[2]" or "name[1,2]" for arrays."""
        if not self.shape:
            return (self.name,)
        indices = product(*(range(1, n + 1) for n in self.shape))
        return tuple(f"{self.name}[{','.join(map(str, index))}]" for index in indices)


class StepResult(NamedTuple):
    """How a step ended when it did not simply reach its end."""

    time_reached: float
    event_needed: bool = False
    terminate_requested: bool = False


class NativeGetSet(NamedTuple):
    """A get or set of FMI in C: addresses of function, instance, value references and values, and how many there are."""

    version: int
    function: int
    instance: int
    value_references: int
    value_reference_count: int
    values: int
    value_count: int


class NativeDoStep(NamedTuple):
    """A doStep of FMI in C; `flags` is where FMI 3.0 says event needed, terminate and early return, `reached` where how far."""

    version: int
    function: int
    instance: int
    step_size: float
    flags: int = 0
    last_successful_time: int = 0


class NativeFlagCheck(NamedTuple):
    """A look at the flags of a doStep: discard (2) when one of them is set."""

    flags: int


#: the FMI statuses OK and warning; whatever else an FMU returns is bad, numbers that are no status among them
SUCCESS_STATUSES = (0, 1)


class PreparedCall(NamedTuple):
    """A call made ready beforehand: a function that returns an FMI status (0 OK, 1 warning), and its arguments.

    `native` is the same call for an executor in C, `kept` what has to live as long as the call.
    """

    function: Callable[..., int]
    arguments: tuple[Any, ...]
    name: str
    native: NativeGetSet | NativeDoStep | NativeFlagCheck | None = None
    keep_alive: tuple[Any, ...] = ()


class Ports(NamedTuple):
    """Variables in order, and one contiguous array per dtype in which their values lie in that order."""

    variables: Sequence[Variable]
    arrays: Mapping[np.dtype[Any], np.ndarray]


class Component(Protocol):
    """One steppable part of a system.

    `variables` is fixed after construction. Every method raises `cosim.core.errors.ComponentError` when it fails.
    """

    variables: Sequence[Variable]
    #: bound with all inputs and outputs, not only with those that are connected or recorded
    binds_everything: bool
    #: what components have in common that may not step at the same time: the same code, which may have state of its own
    shared_code: object = None
    #: get_state and set_state work (FMI: canGetAndSetFMUState)
    has_state: bool

    def set(self, name: str, value: Any) -> None:
        """Set one variable (arrays whole, as nested lists) to a Python value: off the hot path."""

    def get(self, name: str) -> Any:
        """The present value of one variable as Python value (arrays as flat lists): off the hot path."""

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None: ...

    def exit_initialization_mode(self) -> None: ...

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """From now on inputs are read from and outputs written to these arrays."""

    def instantiate(self) -> None:
        """Create the instance and acquire its resources (FMI: fmi3InstantiateCoSimulation); called once, after `bind`."""
        return

    def set_inputs(self) -> None:
        """Take over the values in the bound input arrays."""

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Advance from `time` (s) to `time + step_size`. None: reached, nothing else to report."""

    def get_outputs(self) -> None:
        """Write the present values into the bound output arrays."""

    def prepare_step_calls(self, current_time: ctypes.c_double, step_size: float) -> Sequence[PreparedCall] | None:
        """set_inputs, do_step and get_outputs as calls that need nothing but to be made, for a step from the time in `clock`.

        None: the component offers no such calls. Asked for once, in step mode.
        """
        return None

    def interpret_status(self, function: str, status: int) -> StepResult:
        """What a call of `turn` means that returned a status worse than a warning. Raises ComponentError for a failure."""
        raise ComponentError(type(self).__name__, function, f"status {status}")

    def get_state(self) -> Any:
        """A snapshot that only this component can read."""

    def set_state(self, state: Any) -> None:
        """Return to a snapshot, bit for bit; it stays valid and may be restored again."""

    def free_state(self, state: Any) -> None: ...

    def terminate(self) -> None: ...

    def free(self) -> None: ...
