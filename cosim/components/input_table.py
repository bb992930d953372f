"""Input profiles: a table over time as a component.

It stands in a last stage of its own, so the values of row n are those of the profile at communication point n and
every other component reads, in its step from n, the profile at n.
"""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.component import Component, Ports, Variable
from ..core.errors import InputError, Problem, did_you_mean
from ..core.paths import open_text

Interpolation = Literal["linear", "hold"]

#: units in the last place by which a time and a sum of two others may differ
_MAX_ULPS = 4


class InputTable(Component):
    """Columns over time (s); before the first and after the last row the nearest row holds.

    "linear" interpolates between rows; "hold" keeps each row's value until the next row's time, which already has the new one.
    """

    binds_everything = False
    has_state = True

    def __init__(self, time: np.ndarray, columns: Mapping[str, np.ndarray], interpolation: Interpolation = "linear"):
        self._time, self._columns, self._interpolation = time, columns, interpolation
        self._current_time = float(time[0])
        self._output_columns: Sequence[np.ndarray] = ()
        self.variables = [Variable(name, causality="output") for name in columns]

    def set(self, name: str, value: Any) -> None:
        raise AttributeError(f"a profile has nothing to set, found {name}")

    def get(self, name: str) -> float:
        return self._value_at(self._current_time, self._columns[name])

    def enter_initialization_mode(self, start_time: float, stop_time: float) -> None:
        self._current_time = start_time

    def exit_initialization_mode(self) -> None: ...

    def bind(self, inputs: Ports, outputs: Ports) -> None:
        self._output_columns = [self._columns[variable.name] for variable in outputs.variables]
        self._values = outputs.arrays.get(np.dtype(np.float64), np.empty(0))

    def set_inputs(self) -> None: ...

    def do_step(self, time: float, step_size: float) -> None:
        """To the end of the step; if only rounding keeps that from being a row's time, it is the row's."""
        now = time + step_size
        row = int(np.searchsorted(self._time, now + _MAX_ULPS * np.spacing(max(abs(time), abs(now))), side="right")) - 1
        self._current_time = max(now, float(self._time[row])) if row >= 0 else now

    def get_outputs(self) -> None:
        for i, column in enumerate(self._output_columns):
            self._values[i] = self._value_at(self._current_time, column)

    def _value_at(self, now: float, column: np.ndarray) -> float:
        if self._interpolation == "linear":
            return float(np.interp(now, self._time, column))
        return float(column[max(0, int(np.searchsorted(self._time, now, side="right")) - 1)])

    def get_state(self) -> float:
        return self._current_time

    def set_state(self, state: float) -> None:
        self._current_time = state

    def free_state(self, state: float) -> None: ...

    def terminate(self) -> None: ...

    def free(self) -> None: ...


def read_input_table(path: Path, columns: Sequence[str], interpolation: Interpolation, where: str = "") -> InputTable:
    """A CSV file with a header and a first column `time`; only the named columns are kept.

    Raises InputError for a missing file or column, for cells that are no finite numbers and for time that does not increase.
    """
    try:
        with open_text(path, encoding="utf-8-sig", newline="") as file:
            header, *rows = list(csv.reader(file))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or "no header row"
        raise InputError(Problem(f'cannot read profile "{path}": {reason}', where)) from None
    problems = [
        Problem(f'profile "{path}" has no column "{name}"{did_you_mean(name, header[1:])}', where)
        for name in columns
        if name not in header[1:]
    ]
    several = [name for name in columns if header[1:].count(name) > 1]
    problems += [Problem(f'profile "{path}" has several columns "{name}"', where) for name in several]
    if header[:1] != ["time"]:
        problems.append(Problem(f'the first column of profile "{path}" must be "time", found "{(header or [""])[0]}"', where))
    try:
        values = np.array([[float(cell) for cell in row] for row in rows]).reshape(len(rows), len(header))
    except ValueError:
        raise InputError([*problems, Problem(f'profile "{path}" holds rows that are not {len(header)} numbers', where)]) from None
    if not rows or not np.isfinite(values).all() or (np.diff(values[:, 0]) <= 0).any():
        problems.append(Problem(f'profile "{path}" needs rows of finite numbers with increasing time', where))
    if problems:
        raise InputError(problems)
    return InputTable(values[:, 0], {name: values[:, header.index(name)] for name in columns}, interpolation)
