"""Texts of rows while a run goes on: numbers lie in a file of rows anyway, texts are written beside it whenever they change."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..core.json_values import encode_value
from ..core.system import Endpoint
from ..process.run_files.folder import HEADER_FILE, ROWS_FILE, TEXTS_FILE
from . import Recorder
from .executor import Executor
from .plan import Plan


class SavingRecorder(Recorder):
    """A recorder whose rows, texts among them, outlive the process in `folder` (see `unfinished`).

    A line of the file of texts is JSON: the number of a row, and the texts that are others from this row on.
    """

    def __init__(self, plan: Plan, columns: Mapping[str, Endpoint], every: int, folder: Path):
        super().__init__(plan, columns, every, folder / ROWS_FILE)
        slots = {name: plan.outputs.positions[endpoint] for name, endpoint in columns.items()}
        self._text_signals = [(name, plan.outputs.arrays[s.dtype], s.offset) for name, s in slots.items() if s.dtype.hasobject]
        self._saved_texts: dict[str, Any] = dict.fromkeys((name for name, _, _ in self._text_signals), "")
        self._file = (folder / TEXTS_FILE).open("wb", buffering=0)
        if self._text_signals:
            self._string_writers.append(self._save_changed_texts)

    def _save_changed_texts(self, row: int) -> None:
        """In one write without a buffer, which nothing that kills this process can take back."""
        texts = {name: array[place] for name, array, place in self._text_signals}
        if changed := {name: text for name, text in texts.items() if text != self._saved_texts[name]}:
            self._saved_texts |= changed
            os.write(self._file.fileno(), json.dumps([row, changed], default=encode_value).encode() + b"\n")


def write_header(folder: Path, executor: Executor) -> None:
    """Describe the run that is about to step."""
    recorder, grid = executor.recorder, executor.plan.grid
    dtype = recorder.row_store.dtype
    columns = [
        {
            "name": name,
            "dtype": dtype[name].str,
            "offset": dtype.fields[name][1],  # type: ignore[index]
            "boolean": recorder.variables[name].type == "Boolean",
            "unit": recorder.units[name],
        }
        for name in dtype.names or ()
    ]
    header = {
        **grid.integer_coefficients,
        "steps_per_row": recorder.every,
        "row_size": dtype.itemsize,
        "columns": columns,
        "calls": executor.call_names,
        "texts": [(i, name) for i, name in enumerate(recorder.variables) if name not in (dtype.names or ())],
    }
    (folder / HEADER_FILE).write_text(json.dumps(header), encoding="utf-8")
