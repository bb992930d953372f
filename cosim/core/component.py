"""Interface of everything that steps: FMUs, Python classes and the plant.

The methods of a component are called in the order of the FMI Co-Simulation life cycle:

    bind                                  once: pass the arrays for inputs and outputs
    instantiate                           once: load foreign code, not earlier
    set                                   parameters and start values
    enter_initialization_mode             { set_inputs, get_outputs } may be repeated in this mode
    exit_initialization_mode              then get_outputs: the initial outputs
    { set_inputs, do_step, get_outputs }  once per step; set tunable parameters between steps
    terminate, free                       free is called exactly once, also after a failure

Values are exchanged in typed arrays ("ports") that belong to the engine. A step makes no
conversions, allocations or look-ups.
"""

import ctypes
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import product
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, Protocol

import numpy as np

from .errors import ComponentError, Problem, did_you_mean
from .units import Unit

Causality = Literal[
    "parameter",
    "calculatedParameter",
    "structuralParameter",
    "input",
    "output",
    "local",
    "independent",
]
Variability = Literal["constant", "fixed", "tunable", "discrete", "continuous"]

_NUMBER_TYPES = "Float64 Float32 Int8 UInt8 Int16 UInt16 Int32 UInt32 Int64 UInt64"
DTYPES: Mapping[str, np.dtype[Any]] = {
    **{name: np.dtype(name.lower()) for name in _NUMBER_TYPES.split()},
    "Boolean": np.dtype(np.bool_),
    "Enumeration": np.dtype(np.int64),
    "String": np.dtype(object),
    "Binary": np.dtype(object),
    "Clock": np.dtype(np.bool_),
}


@dataclass(frozen=True, slots=True)
class Variable:
    """One variable of a component as FMI describes it.

    Attributes:
        name: Name as in the model description.
        type: FMI 3.0 type name; FMI 2.0 Real is Float64, Integer is Int32.
        causality: FMI causality.
        variability: FMI variability.
        start: Start value, an array as nested lists; None if unknown.
        unit: Unit of the value; None if unknown.
        shape: () for a scalar; an array occupies consecutive elements in row-major order.
        description: Text of the model description.
        minimum: Smallest permitted value; None if unlimited.
        maximum: Largest permitted value; None if unlimited.
        items: Names and values of an enumeration.
        relative_quantity: The value is a difference, to which the offset of a unit does not apply.
        dtype: NumPy type of a value in memory, by default that of `type`. FMI 2.0 stores Boolean
            and Enumeration as C int.
        derivative_of: Name of the input or output whose time derivative (per s) this value is; only
            in `bind`, see `Component.interpolates_inputs`.
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
    dtype: np.dtype[Any] = field(default=None)  # type: ignore[arg-type]  # None only until __post_init__
    derivative_of: str = ""

    def __post_init__(self) -> None:
        if self.type not in DTYPES:
            raise ValueError(
                f'variable "{self.name}": type is "{self.type}", expected one of FMI '
                f"3.0{did_you_mean(self.type, DTYPES)}"
            )
        if self.dtype is None:
            object.__setattr__(self, "dtype", DTYPES[self.type])

    @property
    def scalar_names(self) -> tuple[str, ...]:
        """Names of the elements: the name of a scalar, else "name[1]", "name[2]" or "name[1,2]"."""
        if not self.shape:
            return (self.name,)
        return tuple([self.name + subscript for subscript in _subscripts(self.shape)])


@lru_cache(16)
def _subscripts(shape: tuple[int, ...]) -> Sequence[str]:
    """Return "[1]", "[2]" or "[1,2]" for each element of an array."""
    indices = product(*(range(1, n + 1) for n in shape))
    return [f"[{','.join(map(str, index))}]" for index in indices]


def count_scalars(variables: Iterable[Variable]) -> int:
    """Return the number of scalars of variables, without making their names.

    An array counts with all its elements.
    """
    return sum(math.prod(variable.shape) for variable in variables)


def scalars_of(variables: Iterable[Variable], *causalities: str) -> dict[str, Variable]:
    """Return the variables of these causalities, or all, by the names of their scalars."""
    scalars: dict[str, Variable] = {}
    for variable in variables:
        if not causalities or variable.causality in causalities:
            scalars |= dict.fromkeys(variable.scalar_names, variable)
    return scalars


class StepResult(NamedTuple):
    """Outcome of a step that ended early, needs event handling or requests termination.

    `time_reached` in s.
    """

    time_reached: float
    event_needed: bool = False
    terminate_requested: bool = False


class NativeGetSet(NamedTuple):
    """Call of a C function fmiXGet... or fmiXSet....

    All members but `version` (2 or 3) and the counts are addresses.
    """

    version: int
    function: int
    instance: int
    value_references: int
    value_reference_count: int
    values: int
    value_count: int


class NativeDoStep(NamedTuple):
    """Call of the C function fmiXDoStep.

    `flags` is the address of the three Booleans eventHandlingNeeded, terminateSimulation and
    earlyReturn of FMI 3.0, `last_successful_time` that of lastSuccessfulTime.
    """

    version: int
    function: int
    instance: int
    step_size: float
    flags: int = 0
    last_successful_time: int = 0


class NativeFlagCheck(NamedTuple):
    """Check of the three Booleans at the address `flags` after fmi3DoStep.

    Yields the status 2 (discard) if one is set.
    """

    flags: int


#: FMI statuses OK and warning; any other number that an FMU returns is a failure
SUCCESS_STATUSES = (0, 1)


class PreparedCall(NamedTuple):
    """A function that returns an FMI status, with its arguments.

    Attributes:
        function: Returns an FMI status (0 OK, 1 warning).
        arguments: Arguments of the function.
        name: Name of the function in messages.
        native: The same call for the native executor; None if the executor has to call `function`.
        keep_alive: Objects whose memory the native call uses.
    """

    function: Callable[..., int]
    arguments: tuple[Any, ...]
    name: str
    native: NativeGetSet | NativeDoStep | NativeFlagCheck | None = None
    keep_alive: tuple[Any, ...] = ()


class Ports(NamedTuple):
    """Variables, and one contiguous array per dtype with their values in the same order."""

    variables: Sequence[Variable]
    arrays: Mapping[np.dtype[Any], np.ndarray]

    def elements(self) -> Iterator[tuple[Variable, np.ndarray, slice]]:
        """Yield each variable with its array and its part of the array."""
        begins = dict.fromkeys(self.arrays, 0)
        for variable in self.variables:
            begin = begins[variable.dtype]
            end = begins[variable.dtype] = begin + len(variable.scalar_names)
            yield variable, self.arrays[variable.dtype], slice(begin, end)


class Component(Protocol):
    """One steppable part of a system.

    Every method raises `cosim.core.errors.ComponentError` when it fails.

    Attributes:
        variables: All variables; fixed after construction.
        binds_everything: `bind` gets all inputs and outputs, not only those that are connected or
            recorded. The outputs are followed by the recorded variables of other causalities.
        shared_code: Components with an equal value other than None never step at the same time,
            because their common code may have static variables.
        runs_foreign_code: Code that is not cosim's runs in this process, where it may change the
            state of the process.
        continuous_states: Names of the derivatives by the names of the states, if
            `get_directional_derivative` accepts both.
        variable_step: Steps may have different sizes (FMI: canHandleVariableCommunicationStepSize).
        has_state: `get_state` and `set_state` are supported (FMI: canGetAndSetFMUState).
        dependencies: Names of the inputs on which an output depends directly, by the name of the
            output (FMI: ModelStructure). An output without an entry may depend on every input.
        initial_dependencies: The same in initialization mode.
        interpolates_inputs: Inputs may change linearly within a step (FMI 2.0:
            canInterpolateInputs). The inputs of `bind` end with the time derivatives of those that
            do, see `Variable.derivative_of`.
        gives_output_slopes: First time derivatives of outputs are available (FMI:
            maxOutputDerivativeOrder). The outputs of `bind` end with those that are used.
        input_limits: Lower and upper limit to which the component limits an input, by the name of
            the scalar.
        warnings: Probable mistakes in the arguments; the subject of each begins with "arguments".
    """

    variables: Sequence[Variable]
    binds_everything: bool
    shared_code: object = None
    runs_foreign_code: bool = True
    continuous_states: Mapping[str, str] = MappingProxyType({})
    variable_step: bool = True
    has_state: bool
    dependencies: Mapping[str, frozenset[str]] = MappingProxyType({})
    initial_dependencies: Mapping[str, frozenset[str]] = MappingProxyType({})
    interpolates_inputs: bool = False
    gives_output_slopes: bool = False
    input_limits: Mapping[str, tuple[float, float]] = MappingProxyType({})
    warnings: Sequence[Problem] = ()

    def set(self, name: str, value: Any) -> None:
        """Set a variable to a Python value, an array to nested lists.

        Not called while stepping through a macro step.
        """

    def get(self, name: str) -> Any:
        """Return the present value of a variable, an array as flat list.

        Not called while stepping through a macro step.
        """

    def unit_source(self, name: str) -> str:  # noqa: ARG002
        """Return where the unit of a variable is declared, for messages.

        Such as "Pilot.units (pilot.py:7)"; "" if it is unknown.
        """
        return ""

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        """Enter the initialization mode of FMI; times in s."""

    def exit_initialization_mode(self) -> None:
        """Exit the initialization mode of FMI and enter step mode."""
        return

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        """Read inputs from and write outputs to these arrays from now on."""

    def instantiate(self) -> None:
        """Create the instance and acquire its resources (FMI: fmi3InstantiateCoSimulation).

        Called once, after `bind`.
        """
        return

    def set_inputs(self) -> None:
        """Read the values in the bound input arrays."""
        return

    def do_step(self, time: float, step_size: float) -> StepResult | None:
        """Advance from `time` (s) to `time + step_size`.

        Args:
            time: Start of the step (s).
            step_size: Length of the step (s).

        Returns:
            None if the step reached its end, needs no event handling and requests no termination.
        """

    def get_outputs(self) -> None:
        """Write the present values into the bound output arrays."""

    def get_directional_derivative(
        self,
        outputs: Sequence[str],  # noqa: ARG002
        input_name: str,  # noqa: ARG002
    ) -> Sequence[float] | None:
        """Return the present partial derivatives of outputs with respect to one input.

        Args:
            outputs: Names of scalar outputs or derivatives, or of elements of arrays.
            input_name: Name of a scalar input or state, or of an element of an array.

        Returns:
            None if the component does not offer them for these variables.
        """
        return None

    def prepare_step_calls(
        self,
        current_time: ctypes.c_double,  # noqa: ARG002
        step_size: float,  # noqa: ARG002
    ) -> Sequence[PreparedCall] | None:
        """Return `set_inputs`, `do_step` and `get_outputs` of one step as prepared calls.

        Called before the first step, and again before a step of another size.

        Args:
            current_time: Memory from which the calls read the start of the step (s).
            step_size: Length of the step (s).

        Returns:
            None if the component only offers the three methods.
        """
        return None

    def interpret_status(self, function: str, status: int) -> StepResult:
        """Return the meaning of a status worse than a warning that a prepared call returned.

        Args:
            function: Name of the prepared call.
            status: The returned status.

        Raises:
            ComponentError: The status is a failure.
        """
        raise ComponentError(type(self).__name__, function, f"status {status}")

    def get_state(self) -> Any:
        """Return a snapshot that only this component can read."""
        return None

    def set_state(self, state: Any) -> None:  # noqa: ARG002
        """Restore a snapshot bit for bit; it may be restored again."""
        return

    def free_state(self, state: Any) -> None:  # noqa: ARG002
        """Release the memory of a snapshot."""
        return

    def terminate(self) -> None:
        """End the simulation (FMI: terminate)."""
        return

    def free(self) -> None:
        """Free the instance and its resources."""
        return
