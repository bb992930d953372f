"""Inputs of a Model Exchange FMU that change linearly within a communication step."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from ....core.component import SUCCESS_STATUSES, Ports
from ..c_functions import FunctionTable, as_pointer, as_size

_FLOAT64 = np.dtype(np.float64)


class LinearInputs:
    """Inputs with the value start + slope * (time - begin) in a communication step that begins at `begin` (s).

    Attributes:
        begin: Begin of the communication step (s).
        references: Value references of the inputs.
        array: Bound array with the values at the begin of the step.
        indices: Indices of the inputs in `array`.
        slopes: Time derivatives of the inputs (per s), a part of `array`.
        values: Present values of the inputs.
    """

    def __init__(self, ports: Ports, value_references: Mapping[str, int]):
        """Find the inputs for which the ports contain slopes, which follow all other variables of type Float64."""
        variables = [variable for variable in ports.variables if variable.dtype == _FLOAT64]
        positions, count = {}, 0
        for variable in variables:
            positions[variable.name] = range(count, count := count + len(variable.scalar_names))
        inputs = [variable.derivative_of for variable in variables if variable.derivative_of]
        self.begin = 0.0
        self.references = np.array([value_references[name] for name in inputs], np.uint32)
        self.indices = np.array([index for name in inputs for index in positions[name]], np.int64)
        self.array = ports.arrays.get(_FLOAT64, np.zeros(0))
        self.slopes = self.array[len(self.array) - len(self.indices) :]
        self.values = np.zeros(len(self.indices))

    def prepare(self, major: int, library: FunctionTable, handle: int, function: str) -> None:
        """Prepare the call of the function that sets inputs of the FMU instance."""
        self._function = library[function]
        self._arguments = (
            as_pointer(handle),
            as_pointer(self.references.ctypes.data),
            as_size(len(self.references)),
            as_pointer(self.values.ctypes.data),
            *((as_size(len(self.values)),) if major > 2 else ()),
        )

    def set(self, time: float) -> int:
        """Set the inputs to their values at `time` (s), and return the status of the FMU.

        OK if there are none.
        """
        if not len(self.references):
            return SUCCESS_STATUSES[0]
        self.values[:] = self.array[self.indices] + self.slopes * (time - self.begin)
        status: int = self._function(*self._arguments)
        return status
