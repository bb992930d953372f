"""Input profiles: a component whose outputs are read from a table over time.

The scenario puts all input tables into a separate last stage. Row n of the results therefore
contains the profile at communication point n, and every other component reads the profile at n in
its step from n.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from ..core.component import DTYPES, Component, Ports, Variable
from ..core.errors import InputError, Problem, did_you_mean
from ..core.json_values import parse_binary
from ..results.csv_files import read_rows

Interpolation = Literal["linear", "hold"]

#: units in the last place by which a row's time may exceed the computed end of a step
_MAX_ULPS = 4
_BOOLEANS = {"true": True, "1": True, "1.0": True, "false": False, "0": False, "0.0": False}


class InputTable(Component):
    """Component with one output per column of a table over time.

    Before the first row and after the last row the nearest row applies.
    """

    binds_everything = False
    runs_foreign_code = False
    has_state = True

    def __init__(
        self,
        time: np.ndarray,
        columns: Mapping[str, np.ndarray],
        interpolation: Interpolation = "linear",
        types: Mapping[str, str] | None = None,
    ):
        """Create the component.

        Args:
            time: Increasing times of the rows (s), shape (rows,).
            columns: Values of each output, shape (rows,), in the dtype of its type.
            interpolation: "linear" interpolates floating-point numbers between rows; "hold" keeps a
                row's value until the time of the next row. Values of other types are always held.
            types: FMI 3.0 type names of outputs that are not Float64.
        """
        self._time, self._columns, self._interpolation = time, columns, interpolation
        self._current_time = float(time[0])
        self._cells: Sequence[tuple[np.ndarray, int, np.ndarray]] = ()
        self.variables = [
            _output_variable(name, (types or {}).get(name, "Float64")) for name in columns
        ]

    def set(self, name: str, value: Any) -> None:
        """Refuse the value: an input table has only outputs."""
        raise AttributeError(
            f'an input profile has no settable variables, found "{name}" = {value!r}'
        )

    def get(self, name: str) -> Any:
        """Return the present value of a column."""
        return self._value_at(self._current_time, self._columns[name])

    def enter_initialization_mode(self, start_time: float, _stop_time: float) -> None:
        """Move to the start time (s)."""
        self._current_time = start_time

    def bind(self, _inputs: Ports, outputs: Ports) -> None:
        """Write the columns of the bound outputs to their arrays from now on."""
        self._cells = [
            (array, part.start, self._columns[variable.name])
            for variable, array, part in outputs.elements()
        ]

    def do_step(self, time: float, step_size: float) -> None:
        """Move to the end of the step, or to a row's time that differs from it only by rounding."""
        end = time + step_size
        latest = end + _MAX_ULPS * np.spacing(max(abs(time), abs(end)))
        row = int(np.searchsorted(self._time, latest, side="right")) - 1
        self._current_time = max(end, float(self._time[row])) if row >= 0 else end

    def get_outputs(self) -> None:
        """Write the present values into the bound output arrays."""
        for values, index, column in self._cells:
            values[index] = self._value_at(self._current_time, column)

    def _value_at(self, time: float, column: np.ndarray) -> Any:
        if self._interpolation == "linear" and column.dtype.kind == "f":
            return float(np.interp(time, self._time, column))
        return column[max(0, int(np.searchsorted(self._time, time, side="right")) - 1)]

    def get_state(self) -> float:
        """Return the current time (s), which is the whole state."""
        return self._current_time

    def set_state(self, state: float) -> None:
        """Return to a time (s) that `get_state` returned."""
        self._current_time = state


def _output_variable(name: str, kind: str) -> Variable:
    return Variable(name, kind, "output", "continuous" if kind.startswith("Float") else "discrete")


def read_input_table(
    path: Path,
    targets: Mapping[str, Variable | None],
    interpolation: Interpolation,
) -> InputTable:
    """Read an input table from a CSV file with a header and a first column `time` (s).

    Args:
        path: The CSV file, in UTF-8.
        targets: Columns that become outputs, with the variable whose type their values have; None:
            Float64. Other columns are ignored.
        interpolation: Interpolation between rows, see `InputTable`.

    Raises:
        InputError: The file or a column is missing, a column occurs twice, a cell is not a value of
            the column's type, or time does not increase.
    """
    header, rows = read_rows(path)
    problems = [
        Problem(f'profile "{path}" {text}') for text in _header_violations(header, list(targets))
    ]
    if problems:
        raise InputError(problems)
    used = {
        name: (header.index(name), variable) for name, variable in {"time": None, **targets}.items()
    }
    try:
        time, *values = _read_columns(rows, len(header), used)
    except ValueError as error:
        raise InputError(Problem(f'profile "{path}":{error}')) from None
    return make_input_table(time, dict(zip(targets, values, strict=True)), targets, interpolation)


def make_input_table(
    time: Sequence[float],
    columns: Mapping[str, Sequence[Any]],
    targets: Mapping[str, Variable | None],
    interpolation: Interpolation,
) -> InputTable:
    """Return the table of values that `parse_cell` has accepted; see `read_input_table`."""
    types = {name: variable.type for name, variable in targets.items() if variable}
    arrays = {name: np.empty(len(time), DTYPES[types.get(name, "Float64")]) for name in columns}
    for name, values in columns.items():
        arrays[name][:] = values
    return InputTable(np.array(time, np.float64), arrays, interpolation, types)


def _read_columns(
    rows: Sequence[Sequence[str]], cell_count: int, used: Mapping[str, tuple[int, Variable | None]]
) -> list[list[Any]]:
    """Return the values of the used columns, the first one `time`.

    Raise ValueError with the line of the first invalid cell.
    """
    columns: list[list[Any]] = [[] for _ in used]
    last_time = -math.inf
    for line, row in ((line, row) for line, row in enumerate(rows, start=2) if row):
        if len(row) != cell_count:
            raise ValueError(f"{line}: found {','.join(row)[:80]!r}, expected {cell_count} values")
        for values, (name, (index, variable)) in zip(columns, used.items(), strict=True):
            try:
                values.append(parse_cell(row[index], variable))
            except ValueError as error:
                raise ValueError(f'{line}: column "{name}": {error}') from None
        if columns[0][-1] <= last_time:
            raise ValueError(f"{line}: expected a time above that of the row before")
        last_time = columns[0][-1]
    if not columns[0]:
        raise ValueError("2: found no rows, expected at least one")
    return columns


def parse_cell(text: str, variable: Variable | None) -> Any:
    """Return the value of a cell of a table.

    Args:
        text: A number; 0, 1, true or false for a Boolean; the name or number of an item for an
            Enumeration; hexadecimal digits for a Binary.
        variable: Variable whose type the value has; None: Float64.

    Raises:
        ValueError: The text is not a value of the type.
    """
    kind = variable.type if variable else "Float64"
    if kind == "String":
        return text
    if kind == "Binary":
        return parse_binary(text)
    word = text.strip()
    if kind == "Boolean" and word.lower() in _BOOLEANS:
        return _BOOLEANS[word.lower()]
    if kind.startswith("Float"):
        return _parse_float(word)
    if variable and word in dict(variable.items):
        return dict(variable.items)[word]
    limits = np.iinfo(variable.dtype) if variable and variable.dtype.kind in "iu" else None
    number = _parse_integer(word)
    if (
        limits is None
        or number is None
        or kind == "Boolean"
        or not limits.min <= number <= limits.max
    ):
        raise ValueError(f"found {text[:80]!r}, expected a value of type {kind}")
    return number


def _parse_float(word: str) -> float:
    try:
        number = math.nan if "_" in word else float(word)  # Python reads "1_0" as 10
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"found {word[:80]!r}, expected a finite number")
    return number


def _parse_integer(word: str) -> int | None:
    """Return all digits of an integer, which may be written as "3.0"; None for any other text."""
    whole, _, fraction = word.partition(".")
    try:
        return None if fraction.strip("0") or "_" in whole else int(whole)
    except ValueError:
        return None


def _header_violations(header: Sequence[str], columns: Sequence[str]) -> Iterator[str]:
    if header[:1] != ["time"]:
        yield (
            f'has the first column "{(header or [""])[0]}", expected "time" and columns separated '
            "by commas"
        )
        return
    names = header[1:]
    for name in columns:
        if name not in names:
            yield f'has no column "{name}"{did_you_mean(name, names)}'
    for name in columns:
        if (count := names.count(name)) > 1:
            yield f'has {count} columns "{name}", expected one'
