"""Messages between the importer process and a worker process: lines of JSON through pipes.

JSON, unlike pickle, cannot make the receiver execute code of the sender. Foreign code in the worker
process may have written the values of an answer. Therefore each function that converts one raises
one of `INVALID_ANSWER_ERRORS` for a value that is not of the expected form.
"""

import json
import os
import select
from collections.abc import Iterable
from typing import Any

import numpy as np

from ....core.component import StepResult, Variable
from ....core.errors import ComponentError, InputError
from ....core.json_values import decode_object, encode_value

#: the command to execute a prepared step, and the answer that it succeeded without a result: the
#: same empty line
STEP_COMMAND = STEP_DONE = b"\n"

#: bytes of one read
READ_SIZE = 1 << 16

#: polls without sleeping before a blocking wait (0.3 us each)
SPIN_COUNT = 40
#: largest number of waits without spinning after spinning was unsuccessful
MAX_SPIN_BACKOFF = 512


def encode_line(message: Any) -> bytes:
    """Return a message as one line of JSON; bytes and NumPy arrays are allowed in it."""
    return json.dumps(message, default=encode_value).encode() + b"\n"


def decode_line(line: bytes) -> Any:
    """Return the message in a line.

    Raises:
        ValueError: The line is not JSON.
    """
    return json.loads(line, object_hook=decode_object)


class SpinningPoller:
    """Poller that spins briefly before it sleeps.

    Sleeping and waking up take longer than most answers. Spinning is unsuccessful if the other
    process computes longer or has no free processor. The next waits then sleep at once. Their
    number doubles with each further unsuccessful spin.
    """

    def __init__(self, descriptors: Iterable[int]):
        self._poll = select.poll()
        for descriptor in descriptors:
            self._poll.register(descriptor, select.POLLIN)
        self.unregister = self._poll.unregister
        self._spins_to_skip, self._next_backoff = 0, 1

    def wait(self, milliseconds: float) -> list[tuple[int, int]]:
        """Wait until a descriptor is ready or the time has passed.

        Returns:
            Pairs (descriptor, event) as from `select.poll`.
        """
        return self._spin() or self._poll.poll(milliseconds)

    def read(self, reader: int) -> bytes:
        """Read the available bytes of a pipe, waiting for at least one."""
        self._spin()
        return os.read(reader, READ_SIZE)

    def _spin(self) -> list[tuple[int, int]]:
        if self._spins_to_skip:
            self._spins_to_skip -= 1
            return []
        poll = self._poll.poll
        for _ in range(SPIN_COUNT):
            if ready := poll(0):
                self._next_backoff = 1
                return ready
        self._spins_to_skip = self._next_backoff
        self._next_backoff = min(2 * self._next_backoff, MAX_SPIN_BACKOFF)
        return []


def read_line(reader: int, poller: SpinningPoller) -> bytes:
    """Read the next line; empty if the other end of the pipe is closed."""
    line = poller.read(reader)
    while line[-1:] != b"\n" and line:
        line += os.read(reader, READ_SIZE)
    return line


def write_line(writer: int, line: bytes) -> None:
    """Write a whole line."""
    while (written := os.write(writer, line)) < len(line):
        line = line[written:]


INVALID_ANSWER_ERRORS = (
    ValueError,
    TypeError,
    LookupError,
    AttributeError,
    ArithmeticError,
    RecursionError,
)

_OBJECT_DTYPE = np.dtype(object)


def no_value(value: Any) -> None:
    """Raise TypeError if a worker sent a value for a command that has no result."""
    if value is not None:
        raise TypeError("a value that no command asked for")


def state_number(value: Any) -> int:
    """Return the number of an FMU state that a worker sent."""
    if type(value) is not int:
        raise TypeError("no number of a state")
    return value


def call_names(value: Any) -> list[str]:
    """Return the names of the FMI calls of a step that a worker sent."""
    if not isinstance(value, list) or not all(isinstance(name, str) for name in value):
        raise TypeError("no names of calls")
    return value


def step_result(value: Any) -> StepResult | None:
    """Return the step result that a worker sent.

    None if the step reached its end and requested nothing.
    """
    if value is None:
        return None
    time, event_needed, terminate_requested = value
    if (
        type(time) not in (int, float)
        or type(event_needed) is not bool
        or type(terminate_requested) is not bool
    ):
        raise TypeError("no outcome of a step")
    return StepResult(float(time), event_needed, terminate_requested)


def variable_value(value: Any, variable: Variable) -> Any:
    """Return the value of a variable that a worker sent: a scalar, or a list for an array."""
    count = len(variable.scalar_names)
    if variable.dtype == _OBJECT_DTYPE:
        string_values(value if variable.shape else [value], count)
        return value
    numbers = np.asarray(value)
    if (
        numbers.dtype.kind not in "biuf"
        or numbers.size != count
        or bool(numbers.ndim) != bool(variable.shape)
    ):
        raise TypeError("no value of the variable")
    return value


def derivative_values(value: Any, count: int) -> list[float] | None:
    """Return `count` directional derivatives that a worker sent.

    None if the FMU does not offer them.
    """
    if value is not None and (
        not isinstance(value, list)
        or len(value) != count
        or {type(each) for each in value} - {float}
    ):
        raise TypeError("no directional derivatives")
    return value


def string_values(value: Any, count: int) -> list[Any]:
    """Return `count` values of String or Binary variables that a worker sent.

    None means an empty list.
    """
    values = [] if value is None else value
    if (
        not isinstance(values, list)
        or len(values) != count
        or not all(isinstance(text, str | bytes) for text in values)
    ):
        raise TypeError("no values of strings")
    return values


def raise_reported_error(message: dict[str, Any], component: str) -> None:
    """Raise the error that a worker's answer reports, if any, with the name of `component`."""
    if "component_error" in message:
        _, function, reason, time = message["component_error"]
        raise ComponentError(
            component, str(function), str(reason), None if time is None else float(time)
        )
    if "input_error" in message:
        raise InputError([str(problem) for problem in list(message["input_error"])])
