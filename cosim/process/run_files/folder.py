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

from ..journal import current

if TYPE_CHECKING:
    import numpy as np

    from ...core.recording import Recording

T = TypeVar("T")

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
class Header:
    """What the rows of an unfinished run mean.

    Row k holds the values of communication point n = k * `every`, at (`origin` + n * `stride`) / `denominator` s. `calls` names
    (component, function) by the number in the marker, `texts` the recorded signals that are no numbers and so not in the rows,
    each with its place among all columns.
    """

    origin: int
    stride: int
    denominator: int
    every: int
    row_size: int
    columns: Sequence[Column]
    calls: Sequence[tuple[str, str]]
    texts: Sequence[tuple[int, str]]

    @property
    def names(self) -> list[str]:
        """All columns in the order in which they were asked for."""
        return self.complete([column.name for column in self.columns], [name for _, name in self.texts])

    def complete(self, numbers: Iterable[T], texts: Iterable[T]) -> list[T]:
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

    def seconds(self, n: int) -> float:
        """Time of communication point n."""
        return (self.origin + n * self.stride) / self.denominator

    def times(self, rows: int) -> np.ndarray:
        """Times of the first rows (s), shape (rows,)."""
        from ...core.time_grid import Grid

        start, step = Fraction(self.origin, self.denominator), Fraction(self.stride, self.denominator)
        grid = Grid(start, step, rows * self.every, self.denominator, self.origin, self.stride)
        return grid.times(range(0, rows * self.every, self.every))


def read_header(folder: Path | None) -> Header | None:
    """The header of a run; None when it did not come that far."""
    if folder is None:
        return None
    try:
        data: dict[str, Any] = json.loads((folder / HEADER_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    columns = [Column(**column) for column in data.pop("columns")]
    pairs = {key: [tuple(pair) for pair in data[key]] for key in ("calls", "texts")}
    return Header(**data | {"columns": columns} | pairs)


class TextReader:
    """Follows the texts of an unfinished run row by row, as far as they are written."""

    def __init__(self, folder: Path, header: Header):
        self._file = (folder / TEXTS_FILE).open("rb") if header.texts else io.BytesIO()
        self._names = [name for _, name in header.texts]
        self._rewind()

    def _rewind(self) -> None:
        self._file.seek(0)
        self._row, self._change = -1, (-1, dict[str, Any]())
        self._texts: dict[str, Any] = dict.fromkeys(self._names, "")

    def row(self, number: int) -> list[Any]:
        """The texts in a row; rows are best asked for one after the other."""
        if number < self._row:
            self._rewind()
        self._row = number
        while self._change[0] <= number:
            self._texts |= self._change[1]
            line = self._file.readline()
            if not line.endswith(b"\n"):
                self._file.seek(-len(line), os.SEEK_CUR)
                self._change = (-1, {})
                break
            first, texts = json.loads(line, object_hook=_restored)
            self._change = (first, texts)
        return list(self._texts.values())


def _restored(value: dict[str, Any]) -> Any:
    return bytes.fromhex(value["bytes"]) if value.keys() == {"bytes"} else value


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
    """The first `rows` rows of an unfinished run as a recording; fewer if foreign code has made their file shorter."""
    import numpy as np

    from ...core.recording import Recording
    from .row_store import read_rows

    header = read_header(folder)
    if folder is None or header is None:
        return Recording.empty()
    columns, rows = header.columns, _there(folder, header, rows)
    data = read_rows(folder / ROWS_FILE, header.dtype, rows)
    numbers = [data[column.name].astype(bool) if column.boolean else data[column.name] for column in columns]
    reader = TextReader(folder, header)
    texts = np.empty((rows, len(header.texts)), object)
    for row in range(rows if header.texts else 0):
        texts[row] = reader.row(row)
    units = header.complete([column.unit for column in columns], [""] * len(header.texts))
    values = header.complete(numbers, texts.T)
    signals = dict(zip(header.names, values, strict=True))
    return Recording(header.times(rows), signals, dict(zip(header.names, units, strict=True)))


def _there(folder: Path, header: Header, rows: int) -> int:
    """How many of so many rows can be read."""
    try:
        return min(rows, (folder / ROWS_FILE).stat().st_size // header.row_size) if header.row_size else rows
    except OSError:
        return 0
