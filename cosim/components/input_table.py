"""Input profiles: a component whose outputs are read from a table over time.

The scenario puts all input tables into a separate last stage. Row n of the results therefore contains the profile at
communication point n, and every other component reads the profile at n in its step from n.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import islice
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.component import Component, Ports, Variable
from ..core.csv_text import read_rows
from ..core.errors import InputError, Problem, did_you_mean

Interpolation = Literal["linear", "hold"]

#: units in the last place by which a row's time may exceed the computed end of a step
_MAX_ULPS = 4


class InputTable(Component):
    """Component with one output per column of a table over time.

    Before the first row and after the last row the nearest row applies.
    """

    binds_everything = False
    runs_foreign_code = False
    has_state = True

    def __init__(self, time: np.ndarray, columns: Mapping[str, np.ndarray], interpolation: Interpolation = "linear"):
        """Create the component.

        Args:
            time: Increasing times of the rows (s), shape (rows,).
            columns: Values of each output, shape (rows,).
            interpolation: "linear" interpolates between rows; "hold" keeps a row's value until the time of the next row.
        """
        self._time, self._columns, self._interpolation = time, columns, interpolation
        self._current_time = float(time[0])
        self._output_columns: Sequence[np.ndarray] = ()
        self.variables = [Variable(name, causality="output") for name in columns]

    def set(self, name: str, value: Any) -> None:
        """Refuse the value: an input table has only outputs."""
        raise AttributeError(f'an input profile has no settable variables, found "{name}" = {value!r}')

    def get(self, name: str) -> float:
        """Return the present value of a column."""
        return self._value_at(self._current_time, self._columns[name])

    def enter_initialization_mode(self, start_time: float, _stop_time: float) -> None:
        """Move to the start time (s)."""
        self._current_time = start_time

    def exit_initialization_mode(self) -> None:
        """Do nothing."""

    def bind(self, _inputs: Ports, outputs: Ports) -> None:
        """Write the columns of the bound outputs to their Float64 array from now on."""
        self._output_columns = [self._columns[variable.name] for variable in outputs.variables]
        self._values = outputs.arrays.get(np.dtype(np.float64), np.empty(0))

    def set_inputs(self) -> None:
        """Do nothing: an input table has no inputs."""

    def do_step(self, time: float, step_size: float) -> None:
        """Move to the end of the step, or to a row's time that differs from it only by rounding."""
        end = time + step_size
        row = int(np.searchsorted(self._time, end + _MAX_ULPS * np.spacing(max(abs(time), abs(end))), side="right")) - 1
        self._current_time = max(end, float(self._time[row])) if row >= 0 else end

    def get_outputs(self) -> None:
        """Write the present values into the bound output array."""
        for i, column in enumerate(self._output_columns):
            self._values[i] = self._value_at(self._current_time, column)

    def _value_at(self, time: float, column: np.ndarray) -> float:
        if self._interpolation == "linear":
            return float(np.interp(time, self._time, column))
        return float(column[max(0, int(np.searchsorted(self._time, time, side="right")) - 1)])

    def get_state(self) -> float:
        """Return the current time (s), which is the whole state."""
        return self._current_time

    def set_state(self, state: float) -> None:
        """Return to a time (s) that `get_state` returned."""
        self._current_time = state

    def free_state(self, state: float) -> None:
        """Do nothing: a state is a number."""

    def terminate(self) -> None:
        """Do nothing."""

    def free(self) -> None:
        """Do nothing: an input table has no resources."""


def read_input_table(path: Path, columns: Sequence[str], interpolation: Interpolation, where: str = "") -> InputTable:
    """Read an input table from a CSV file with a header and a first column `time` (s).

    Args:
        path: The CSV file, in UTF-8.
        columns: Names of the columns that become outputs; other columns are ignored.
        interpolation: Interpolation between rows, see `InputTable`.
        where: Place in the scenario that refers to the file, for messages.

    Raises:
        InputError: The file or a column is missing, a column occurs twice, a cell is not a finite number, or time does not
            increase.
    """
    header, rows = read_rows(path)
    problems = [Problem(f'profile "{path}" {text}', where) for text in _header_violations(header, columns)]
    if not problems:
        values = np.empty((sum(map(bool, rows)), len(header)))
        problems = [Problem(f'profile "{path}":{text}', where) for text in islice(_read_values(rows, values), 1)]
    if problems:
        raise InputError(problems)
    return InputTable(values[:, 0], {name: values[:, header.index(name)] for name in columns}, interpolation)


def _read_values(rows: Sequence[Sequence[str]], values: np.ndarray) -> Iterator[str]:
    """Convert the rows that are not empty; yield line and description of each one that is not valid."""
    filled = [(line, row) for line, row in enumerate(rows, start=2) if row]
    for (line, row), target in zip(filled, values, strict=True):
        try:
            target[:] = [float(cell) for cell in row]
        except ValueError:
            yield f"{line}: found {','.join(row)[:80]!r}, expected {len(target)} numbers"
    if not filled:
        yield "2: found no rows, expected at least one"
    valid = np.isfinite(values).all(axis=1) & (np.diff(values[:, 0], prepend=-np.inf) > 0)
    for line in (line for (line, _), ok in zip(filled, valid, strict=True) if not ok):
        yield f"{line}: expected finite numbers, and a time above that of the row before"


def _header_violations(header: Sequence[str], columns: Sequence[str]) -> Iterator[str]:
    if header[:1] != ["time"]:
        yield f'has the first column "{(header or [""])[0]}", expected "time" and columns separated by commas'
        return
    names = header[1:]
    for name in columns:
        if name not in names:
            yield f'has no column "{name}"{did_you_mean(name, names)}'
    for name in columns:
        if (count := names.count(name)) > 1:
            yield f'has {count} columns "{name}", expected one'
