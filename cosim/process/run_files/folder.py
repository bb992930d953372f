"""A run's folder while it is going on: rows as they are recorded, and what is needed to read them.

`header.json` says what a row is and which calls are made, `rows` holds the rows (see `engine.rows`), `texts` what is no number
in them (see `text_rows`). After a crash another process makes a recording of it.
"""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ...core.json_values import decode_object
from ..journal import current_journal

if TYPE_CHECKING:
    import numpy as np

    from ...core.recording import Recording

Value = TypeVar("Value")

ROWS_FILE, TEXTS_FILE, HEADER_FILE, METADATA_FILE = "rows", "texts", "header.json", "metadata.json"


@dataclass(frozen=True)
class Column:
    """One recorded signal: its place in a row (bytes), its dtype, and what a user wants to know."""

    name: str
    dtype: str
    offset: int
    boolean: bool
    unit: str


@dataclass(frozen=True)
class RowsHeader:
    """What the rows of an unfinished run mean.

    Row k holds the values of communication point n = k * `every`, at (`origin` + n * `stride`) / `denominator` s. `calls` names
    (component, function) by the number in the marker, `texts` the recorded signals that are no numbers and so not in the rows,
    each with its place among all columns.
    """

    origin: int
    stride: int
    denominator: int
    steps_per_row: int
    row_size: int
    columns: Sequence[Column]
    calls: Sequence[tuple[str, str]]
    texts: Sequence[tuple[int, str]]

    @property
    def names(self) -> list[str]:
        """All columns in the order in which they were asked for."""
        return self.merge_columns([column.name for column in self.columns], [name for _, name in self.texts])

    def merge_columns(self, numbers: Iterable[Value], texts: Iterable[Value]) -> list[Value]:
        """What belongs to the columns of numbers and to those of texts, in the order of all columns."""
        whole = list(numbers)
        for (place, _), text in zip(self.texts, texts, strict=True):
            whole.insert(place, text)
        return whole

    @property
    def dtype(self) -> np.dtype[Any]:
        """A row as a structured dtype."""
        import numpy as np

        return np.dtype(
            {
                "names": [column.name for column in self.columns],
                "formats": [column.dtype for column in self.columns],
                "offsets": [column.offset for column in self.columns],
                "itemsize": self.row_size,
            }
        )

    def time_at(self, n: int) -> float:
        """Time of communication point n."""
        return (self.origin + n * self.stride) / self.denominator

    def times(self, rows: int) -> np.ndarray:
        """Times of the first rows (s), shape (rows,)."""
        from ...core.time_grid import TimeGrid

        start, step = Fraction(self.origin, self.denominator), Fraction(self.stride, self.denominator)
        grid = TimeGrid(start, step, rows * self.steps_per_row, self.denominator, self.origin, self.stride)
        return grid.times(range(0, rows * self.steps_per_row, self.steps_per_row))


def read_header(folder: Path | None) -> RowsHeader | None:
    """The header of a run; None when it did not come that far."""
    if folder is None:
        return None
    try:
        data: dict[str, Any] = json.loads((folder / HEADER_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    columns = [Column(**column) for column in data.pop("columns")]
    pairs = {key: [tuple(pair) for pair in data[key]] for key in ("calls", "texts")}
    return RowsHeader(**data | {"columns": columns} | pairs)


class TextReader:
    """Follows the texts of an unfinished run row by row, as far as they are written."""

    def __init__(self, folder: Path, header: RowsHeader):
        self._file = (folder / TEXTS_FILE).open("rb") if header.texts else io.BytesIO()
        self._names = [name for _, name in header.texts]
        self._rewind()

    def _rewind(self) -> None:
        self._file.seek(0)
        self._row, self._pending_change = -1, (-1, dict[str, Any]())
        self._texts: dict[str, Any] = dict.fromkeys(self._names, "")

    def read_row(self, number: int) -> list[Any]:
        """The texts in a row; rows are best asked for one after the other."""
        if number < self._row:
            self._rewind()
        self._row = number
        while self._pending_change[0] <= number:
            self._texts |= self._pending_change[1]
            line = self._file.readline()
            if not line.endswith(b"\n"):
                self._file.seek(-len(line), os.SEEK_CUR)
                self._pending_change = (-1, {})
                break
            first, texts = json.loads(line, object_hook=decode_object)
            self._pending_change = (first, texts)
        return list(self._texts.values())


def write_metadata(metadata: dict[str, Any]) -> None:
    """Keep what describes the run, if a supervisor wants to see it."""
    journal = current_journal()
    if journal and journal.folder:
        (journal.folder / METADATA_FILE).write_text(json.dumps(metadata, default=str), encoding="utf-8")


def read_metadata(folder: Path) -> dict[str, Any]:
    """What describes the run, as far as it is known."""
    try:
        return dict(json.loads((folder / METADATA_FILE).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return {}


@contextmanager
def keeping_run_files(folder: Path, csv: Path | None = None) -> Iterator[None]:
    """While the block lasts, the run of this process keeps its files in `folder`, if a supervisor wants to see them."""
    journal = current_journal()
    if journal is None:
        yield
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    journal.set_run_files(folder, csv)
    yield
    remove_run_files()


def remove_run_files() -> None:
    """The rows of this process's run are where the user wants them: its folder is not needed any more."""
    journal = current_journal()
    if journal and journal.folder:
        shutil.rmtree(journal.folder, ignore_errors=True)


def recover_recording(folder: Path | None, rows: int) -> Recording:
    """The first `rows` rows of an unfinished run as a recording; fewer if foreign code has made their file shorter."""
    import numpy as np

    from ...core.recording import Recording
    from .row_store import read_rows

    header = read_header(folder)
    if folder is None or header is None:
        return Recording.empty()
    columns, rows = header.columns, _count_readable_rows(folder, header, rows)
    data = read_rows(folder / ROWS_FILE, header.dtype, rows)
    numbers = [data[column.name].astype(bool) if column.boolean else data[column.name] for column in columns]
    reader = TextReader(folder, header)
    texts = np.empty((rows, len(header.texts)), object)
    for row in range(rows if header.texts else 0):
        texts[row] = reader.read_row(row)
    units = header.merge_columns([column.unit for column in columns], [""] * len(header.texts))
    values = header.merge_columns(numbers, texts.T)
    signals = dict(zip(header.names, values, strict=True))
    return Recording(header.times(rows), signals, dict(zip(header.names, units, strict=True)))


def _count_readable_rows(folder: Path, header: RowsHeader, rows: int) -> int:
    """How many of so many rows can be read."""
    try:
        return min(rows, (folder / ROWS_FILE).stat().st_size // header.row_size) if header.row_size else rows
    except OSError:
        return 0
