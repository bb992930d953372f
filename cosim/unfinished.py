"""A run's folder while it is going on: rows as they are recorded, and what is needed to read them.

`header.json` says what a row is and which calls are made, `rows` holds the rows (see `engine.rows`). After a crash another
process makes a recording of it.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .journal import current

if TYPE_CHECKING:
    from .engine import Executor
    from .recording import Recording

ROWS_FILE, HEADER_FILE, METADATA_FILE = "rows", "header.json", "metadata.json"


@dataclass(frozen=True)
class Column:
    """One recorded signal: its place in a row (bytes), its dtype, and what a user wants to know."""

    name: str
    dtype: str
    offset: int
    boolean: bool
    unit: str


@dataclass(frozen=True)
class Header:
    """What the rows of an unfinished run mean.

    Row k holds the values of communication point n = k * `every`, at (`origin` + n * `stride`) / `denominator` s. `calls` names
    (component, function) by the number in the marker, `texts` the recorded signals that are no numbers and so not in the rows.
    """

    origin: int
    stride: int
    denominator: int
    every: int
    row_size: int
    columns: Sequence[Column]
    calls: Sequence[tuple[str, str]]
    texts: Sequence[str]

    def seconds(self, n: int) -> float:
        """Time of communication point n."""
        return (self.origin + n * self.stride) / self.denominator


def write_header(folder: Path, executor: Executor) -> None:
    """Describe the run that is about to step."""
    recorder, grid = executor.recorder, executor.plan.grid
    dtype = recorder.store.dtype
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
        **grid.integers,
        "every": recorder.every,
        "row_size": dtype.itemsize,
        "columns": columns,
        "calls": executor.calls,
        "texts": [name for name in recorder.variables if name not in (dtype.names or ())],
    }
    (folder / HEADER_FILE).write_text(json.dumps(header), encoding="utf-8")


def read_header(folder: Path | None) -> Header | None:
    """The header of a run; None when it did not come that far."""
    if folder is None:
        return None
    try:
        data: dict[str, Any] = json.loads((folder / HEADER_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    columns = [Column(**column) for column in data.pop("columns")]
    return Header(**data | {"columns": columns, "calls": [(component, name) for component, name in data["calls"]]})


def write_metadata(metadata: dict[str, Any]) -> None:
    """Keep what describes the run, if a supervisor wants to see it."""
    journal = current()
    if journal and journal.folder:
        (journal.folder / METADATA_FILE).write_text(json.dumps(metadata, default=str), encoding="utf-8")


def read_metadata(folder: Path) -> dict[str, Any]:
    """What describes the run, as far as it is known."""
    try:
        return dict(json.loads((folder / METADATA_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


@contextmanager
def unfinished(folder: Path, csv: Path | None = None) -> Iterator[None]:
    """While the block lasts, the run of this process keeps its files in `folder`, if a supervisor wants to see them."""
    journal = current()
    if journal is None:
        yield
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    journal.put_files(folder, csv)
    yield
    saved()


def saved() -> None:
    """The rows of this process's run are where the user wants them: its folder is not needed any more."""
    journal = current()
    if journal and journal.folder:
        shutil.rmtree(journal.folder, ignore_errors=True)


def recover(folder: Path | None, rows: int) -> Recording:
    """The first `rows` rows of an unfinished run as a recording; texts are lost."""
    import numpy as np

    from .engine import read_rows
    from .recording import Recording

    header = read_header(folder)
    if folder is None or header is None:
        return Recording.empty()
    columns = header.columns
    dtype = np.dtype(
        {
            "names": [column.name for column in columns],
            "formats": [column.dtype for column in columns],
            "offsets": [column.offset for column in columns],
            "itemsize": header.row_size,
        }
    )
    data = read_rows(folder / ROWS_FILE, dtype, rows)
    time = np.array([header.seconds(row * header.every) for row in range(rows)], np.float64)
    values = {column.name: data[column.name].astype(bool) if column.boolean else data[column.name] for column in columns}
    return Recording(time, values, {column.name: column.unit for column in columns})
