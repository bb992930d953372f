"""A recorder that also writes string signals to disk as they change, so they survive a crash."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from ..core.json_values import encode_value
from ..process.run_files.folder import HEADER_FILE, ROWS_FILE, TEXTS_FILE
from . import Recorder
from .plan import Plan


class SavingRecorder(Recorder):
    """Recorder whose rows and strings survive the process in `folder` (see `process.run_files.folder`).

    Each line of the file of strings is JSON: the number of a row, and the strings that change in this row.

    Args:
        plan: the compiled system.
        folder: folder of the unfinished run.
    """

    def __init__(self, plan: Plan, folder: Path):
        super().__init__(plan, folder / ROWS_FILE)
        self._header_file = folder / HEADER_FILE
        positions = self._positions.items()
        self._strings = [
            (name, plan.outputs.arrays[p.dtype], p.offset)
            for name, p in positions
            if p.dtype.hasobject
        ]
        self._saved_strings: dict[str, Any] = dict.fromkeys(
            (name for name, _, _ in self._strings), ""
        )
        self._path = folder / TEXTS_FILE
        self._path.write_bytes(b"")
        if self._strings:
            self._string_writers.append(self._save_changed_strings)

    def write_header(self, call_names: Sequence[tuple[str, str]]) -> None:
        """Write the header of the unfinished run.

        Time grid, format of a row, and (component, function) of each call.
        """
        dtype = self.row_store.dtype
        fields: Mapping[str, Any] = dtype.fields or {}
        columns = [
            {
                "name": name,
                "dtype": dtype[name].str,
                "offset": fields[name][1],
                "boolean": self.variables[name].type == "Boolean",
                "unit": self.units[name],
            }
            for name in dtype.names or ()
        ]
        header = {
            **self._plan.grid.integer_coefficients,
            "last_point": self._plan.grid.count,
            "end": float(self._plan.grid.end),
            "steps_per_row": self.every,
            "row_size": dtype.itemsize,
            "columns": columns,
            "calls": call_names,
            "texts": [
                (i, name)
                for i, name in enumerate(self.variables)
                if name not in (dtype.names or ())
            ],
        }
        self._header_file.write_text(json.dumps(header), encoding="utf-8")

    def _save_changed_strings(self, row: int) -> None:
        """Write a line in one unbuffered call, so that it is complete even if this process is killed.

        The file is not left open, because foreign code could truncate it.
        """
        strings = {name: array[index] for name, array, index in self._strings}
        if changed := {
            name: value for name, value in strings.items() if value != self._saved_strings[name]
        }:
            self._saved_strings |= changed
            with self._path.open("ab", buffering=0) as file:
                file.write(json.dumps([row, changed], default=encode_value).encode() + b"\n")
