"""Folder of a run in progress, from which another process recovers the recording after a crash.

- `header.json`: layout of a row and names of the calls
- `rows`: rows of numbers (see `row_store`)
- `texts`: string signals, written when they change (see `engine.saving_recorder`)
- `metadata.json`: description of the run

If the results cannot be written, as on a full disk, the files are kept: `rows` becomes `rows.COUNT`
(see `keep_rows`).
"""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ...core.json_values import decode_object, parse_object
from ...core.paths import file_to_replace
from ..journal import current_journal

if TYPE_CHECKING:
    import numpy as np

    from ...core.recording import Recording

Value = TypeVar("Value")

ROWS_FILE, TEXTS_FILE, HEADER_FILE, METADATA_FILE = "rows", "texts", "header.json", "metadata.json"
#: prefix of the copies of the CSV file
LIVE_COPY_PREFIX = "live-"


@dataclass(frozen=True)
class Column:
    """Numeric signal in a row: offset (bytes), NumPy dtype such as "<f8", and unit."""

    name: str
    dtype: str
    offset: int
    boolean: bool
    unit: str


@dataclass(frozen=True)
class RowsHeader:
    """Layout of the rows of an unfinished run.

    Row k belongs to communication point n = k * `steps_per_row`. Its time is (`origin` + n *
    `stride`) / `denominator` (s); that of the last point is `end`, because the last step may be
    shorter.

    Attributes:
        origin: See above.
        stride: See above.
        denominator: See above.
        steps_per_row: Macro steps per row.
        row_size: Size of a row (bytes).
        columns: Numeric signals.
        calls: Component and function of each call, by the number in the marker.
        texts: String signals, each with its index among all signals.
        last_point: Number of the last communication point; -1: unknown.
        end: Time of the last communication point (s).
    """

    origin: int
    stride: int
    denominator: int
    steps_per_row: int
    row_size: int
    columns: Sequence[Column]
    calls: Sequence[tuple[str, str]]
    texts: Sequence[tuple[int, str]]
    last_point: int = -1
    end: float = 0.0

    @property
    def names(self) -> list[str]:
        """Names of all signals in recorded order."""
        return self.merge_columns(
            [column.name for column in self.columns], [name for _, name in self.texts]
        )

    def merge_columns(self, numbers: Iterable[Value], texts: Iterable[Value]) -> list[Value]:
        """Merge one value per numeric signal and one per string signal into recorded order."""
        merged = list(numbers)
        for (index, _), text in zip(self.texts, texts, strict=True):
            merged.insert(index, text)
        return merged

    @property
    def dtype(self) -> np.dtype[Any]:
        """Structured dtype of a row."""
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
        """Return the time of communication point n (s)."""
        return (
            self.end if n == self.last_point else (self.origin + n * self.stride) / self.denominator
        )

    def times(self, rows: int) -> np.ndarray:
        """Return the times of the first `rows` rows (s), shape (rows,)."""
        from ...core.time_grid import TimeGrid

        start, step = (
            Fraction(self.origin, self.denominator),
            Fraction(self.stride, self.denominator),
        )
        grid = TimeGrid(
            start, step, rows * self.steps_per_row, self.denominator, self.origin, self.stride
        )
        times = grid.times(range(0, rows * self.steps_per_row, self.steps_per_row))
        if rows and (rows - 1) * self.steps_per_row == self.last_point:
            times[-1] = self.end
        return times


def read_header(folder: Path | None) -> RowsHeader | None:
    """Read the header in the folder of a run; None if it was not written."""
    if folder is None:
        return None
    try:
        data = parse_object((folder / HEADER_FILE).read_text(encoding="utf-8"))
        columns = [Column(**column) for column in data.pop("columns")]
        pairs = {key: [tuple(pair) for pair in data[key]] for key in ("calls", "texts")}
        return RowsHeader(**data | {"columns": columns} | pairs)
    except (OSError, ValueError, TypeError, LookupError):
        return None


class TextReader:
    """Reader of the string signals of an unfinished run."""

    def __init__(self, folder: Path, header: RowsHeader):
        self._file = (folder / TEXTS_FILE).open("rb") if header.texts else io.BytesIO()
        self._names = [name for _, name in header.texts]
        self._rewind()

    def _rewind(self) -> None:
        """Return to the first row."""
        self._file.seek(0)
        self._row, self._pending_change = -1, (-1, dict[str, Any]())
        self._texts: dict[str, Any] = dict.fromkeys(self._names, "")

    def close(self) -> None:
        """Close the file of the strings."""
        self._file.close()

    def read_row(self, number: int) -> list[Any]:
        """Return the string signals of a row; fast if rows are read in ascending order."""
        if number < self._row:
            self._rewind()
        self._row = number
        while self._pending_change[0] <= number:
            self._texts |= self._pending_change[1]
            line = self._file.readline()
            if not line.endswith(b"\n"):  # end of file, or a line that is being written
                self._file.seek(-len(line), os.SEEK_CUR)
                self._pending_change = (-1, {})
                break
            self._pending_change = self._parse_change(line)
        return list(self._texts.values())

    def _parse_change(self, line: bytes) -> tuple[int, dict[str, Any]]:
        """Return the row of a change and its texts.

        A line that foreign code has damaged changes nothing.
        """
        try:
            row, texts = json.loads(line, object_hook=decode_object)
            return int(row), {name: text for name, text in texts.items() if name in self._texts}
        except (ValueError, TypeError, AttributeError, RecursionError):
            return self._pending_change[0], {}


def write_metadata(folder: Path, metadata: Mapping[str, Any]) -> None:
    """Write the description of the run to its folder."""
    (folder / METADATA_FILE).write_text(json.dumps(metadata, default=str), encoding="utf-8")


def read_metadata(folder: Path) -> dict[str, Any]:
    """Read the description of a run; empty if it was not written."""
    try:
        return parse_object((folder / METADATA_FILE).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


@contextmanager
def keeping_run_files(
    folder: Path, csv: Path | None = None, metadata: Mapping[str, Any] | None = None
) -> Iterator[None]:
    """Keep the files of a run in `folder` during the block, if this process has a supervisor.

    Remove them if it succeeds.

    Args:
        folder: Folder that is created; an existing one is replaced.
        csv: CSV file that the supervisor updates during the run; None for none. A FIFO or device is
            only written at the end of the run.
        metadata: Description of the run; None for none.
    """
    journal = current_journal()
    if journal is None:
        yield
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    journal.set_run_files(folder, file_to_replace(csv) if csv else None)
    if metadata:
        write_metadata(folder, metadata)
    yield
    remove_run_files()


def run_folder() -> Path | None:
    """Return the folder of the run of this process; None without a supervisor."""
    journal = current_journal()
    return journal.folder if journal else None


def remove_run_files() -> None:
    """Remove the folder of the run of this process, after its results were written."""
    if folder := run_folder():
        shutil.rmtree(folder, ignore_errors=True)


def keep_rows(folder: Path, rows: int, metadata: Mapping[str, Any]) -> None:
    """Keep the rows of a run whose results cannot be written, so that they can be recovered after its processes have ended.

    The name of their file contains their number, because a full disk has no space for another file.

    Args:
        folder: Folder of the run.
        rows: Number of recorded rows.
        metadata: Description of the run, in types that JSON supports; kept unless the disk has no space for it.

    Raises:
        OSError: The file cannot be renamed, or the run has no header.
    """
    header = read_header(folder)
    if header is None:
        raise FileNotFoundError(folder / HEADER_FILE)
    file = folder / ROWS_FILE
    os.truncate(file, min(file.stat().st_size, rows * header.row_size))
    file.rename(folder / f"{ROWS_FILE}.{rows}")
    temporary = folder / f"{METADATA_FILE}.part"
    with suppress(OSError):
        temporary.write_text(json.dumps(metadata), encoding="utf-8")
        temporary.replace(folder / METADATA_FILE)


def find_kept_rows(folder: Path) -> tuple[Path, int] | None:
    """Return the file with the rows that were kept in the folder of a run, and their number.

    None if there is none.
    """
    for file in folder.glob(f"{ROWS_FILE}.*"):
        if (count := file.suffix[1:]).isdecimal():
            return file, int(count)
    return None


def remove_live_copies(folder: Path) -> None:
    """Remove the copies of the CSV file, except the one that is the result file, to free their space."""
    for copy in folder.glob(f"{LIVE_COPY_PREFIX}*"):
        copy.unlink(missing_ok=True)


def recover_recording(folder: Path | None, rows: int, rows_file: Path | None = None) -> Recording:
    """Read the recording of an unfinished run.

    Args:
        folder: Folder of the run; None if it had none.
        rows: Number of recorded rows.
        rows_file: File of the rows; None for `ROWS_FILE` in the folder.

    Returns:
        A recording with fewer rows if foreign code has truncated the file, empty if there is no
        header.
    """
    import numpy as np

    from ...core.recording import Recording
    from .row_store import read_rows

    header = read_header(folder)
    if folder is None or header is None:
        return Recording.empty()
    rows_file = rows_file or folder / ROWS_FILE
    columns, rows = header.columns, _count_readable_rows(rows_file, header, rows)
    data = read_rows(rows_file, header.dtype, rows)
    numbers = [
        data[column.name].astype(bool) if column.boolean else data[column.name]
        for column in columns
    ]
    texts = np.empty((rows, len(header.texts)), object)
    with closing(TextReader(folder, header)) as reader:
        for row in range(rows if header.texts else 0):
            texts[row] = reader.read_row(row)
    units = header.merge_columns([column.unit for column in columns], [""] * len(header.texts))
    values = header.merge_columns(numbers, texts.T)
    signals = dict(zip(header.names, values, strict=True))
    return Recording(header.times(rows), signals, dict(zip(header.names, units, strict=True)))


def _count_readable_rows(rows_file: Path, header: RowsHeader, rows: int) -> int:
    """Return the number of rows, up to `rows`, that the file contains."""
    try:
        return min(rows, rows_file.stat().st_size // header.row_size) if header.row_size else rows
    except OSError:
        return 0
