"""Files of a run in progress, from which another process recovers the recording after a crash.

- `header.json`: layout of a row and names of the calls (`RowLayout`)
- `rows`: rows of numbers, each with its time (see `row_store`)
- `texts`: string signals, one line of JSON for each change: the number of a row and its new strings
- `metadata.json`: description of the run

`RowsFile` writes and reads the first three. If the results cannot be written, as on a full disk,
the files are kept: `rows` becomes `rows.COUNT` (see `keep_rows`).
"""

from __future__ import annotations

import io
import json
import os
import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from ..core.json_values import decode_object, encode_value, parse_object
from .journal import current_journal

if TYPE_CHECKING:
    import numpy as np

    from ..core.recording import Recording

Value = TypeVar("Value")

ROWS_FILE, TEXTS_FILE, HEADER_FILE, METADATA_FILE = "rows", "texts", "header.json", "metadata.json"
#: fields of a row: its time (float64), and the numeric signals
TIME, SIGNALS = "time", "signals"
TIME_SIZE = 8


@dataclass(frozen=True)
class Column:
    """Numeric signal in a row.

    Offset after the time (bytes), NumPy dtype such as "<f8", and unit.
    """

    name: str
    dtype: str
    offset: int
    boolean: bool
    unit: str


@dataclass(frozen=True)
class RowLayout:
    """Layout of recorded rows.

    Attributes:
        signals_size: Size of the numeric signals of a row (bytes), without the time before them.
        columns: Numeric signals.
        texts: String signals, each with its index among all signals.
        calls: Component and function of each call of the stepping loop, by the number in the
            marker.
    """

    signals_size: int
    columns: Sequence[Column]
    texts: Sequence[tuple[int, str]]
    calls: Sequence[tuple[str, str]] = ()

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
        """Structured dtype of a row, with the fields `TIME` and `SIGNALS`."""
        import numpy as np

        signals = np.dtype(
            {
                "names": [column.name for column in self.columns],
                "formats": [column.dtype for column in self.columns],
                "offsets": [column.offset for column in self.columns],
                "itemsize": self.signals_size,
            }
        )
        return np.dtype([(TIME, "<f8"), (SIGNALS, signals)])


class RowsFile:
    """Recorded rows and strings in the folder of a run: one process writes them, others read them.

    Args:
        folder: Folder of the run.
        layout: Layout of a row.
    """

    def __init__(self, folder: Path, layout: RowLayout):
        self._folder, self.layout = folder, layout
        #: file of the rows, and their number if they were kept (see `keep_rows`)
        kept: tuple[Path, int | None] | None = find_kept_rows(folder)
        self.path, self.kept_rows = kept or (folder / ROWS_FILE, None)

    @classmethod
    def open(cls, folder: Path) -> RowsFile | None:
        """Open the rows of a run; None if they have no header, or a damaged one."""
        try:
            data = parse_object((folder / HEADER_FILE).read_text(encoding="utf-8"))
            columns = [Column(**column) for column in data["columns"]]
            for key in ("calls", "texts"):
                data[key] = [tuple(pair) for pair in data[key]]
            return cls(folder, RowLayout(**data | {"columns": columns}))
        except (OSError, ValueError, TypeError, LookupError):
            return None

    def write_header(self, calls: Sequence[tuple[str, str]]) -> None:
        """Write the layout of the rows, after the first one was recorded."""
        header = asdict(replace(self.layout, calls=calls))
        (self._folder / HEADER_FILE).write_text(json.dumps(header), encoding="utf-8")

    def write_texts(self, row: int, texts: Mapping[str, Any]) -> None:
        """Append strings that change in a row.

        One unbuffered call writes a complete line even if this process is killed. The file is not
        left open, because foreign code could truncate it.
        """
        with (self._folder / TEXTS_FILE).open("ab", buffering=0) as file:
            file.write(json.dumps([row, texts], default=encode_value).encode() + b"\n")

    def read_texts(self, rows: int) -> list[np.ndarray]:
        """Return the string signals of the first `rows` rows, each of shape (rows,).

        A line that is incomplete, or that foreign code has damaged, changes nothing.
        """
        changes: dict[str, list[tuple[int, Any]]] = {name: [] for _, name in self.layout.texts}
        file = self._folder / TEXTS_FILE
        for line in file.read_bytes().splitlines() if changes else ():
            with suppress(ValueError, TypeError, AttributeError, RecursionError):
                row, texts = json.loads(line, object_hook=decode_object)
                for name in texts.keys() & changes:
                    changes[name].append((int(row), texts[name]))
        return [text_column(each, rows) for each in changes.values()]

    def count_rows(self) -> int:
        """Return the number of complete rows in a file whose writer was killed.

        Space after the last row contains zeros, and the time of a row is written last. A row at
        the time 0 is therefore found only if a later one follows, or if it is the first one.
        """
        import numpy as np

        complete = np.flatnonzero(self._map(self._readable_rows())[TIME])
        return int(complete[-1]) + 1 if len(complete) else min(1, self._readable_rows())

    def _readable_rows(self) -> int:
        try:
            return self.path.stat().st_size // (TIME_SIZE + self.layout.signals_size)
        except OSError:
            return 0

    def _map(self, rows: int) -> np.ndarray:
        from .row_store import map_rows

        if not rows:  # there may be no file
            return map_rows(io.BytesIO(), self.layout.dtype, 0, 0)
        with self.path.open("rb") as file:
            return map_rows(file, self.layout.dtype, 0, rows)

    def recording(self, rows: int) -> Recording:
        """Read the first `rows` rows, or fewer if foreign code has truncated their file."""
        from ..core.recording import Recording

        layout, rows = self.layout, min(rows, self._readable_rows())
        data = self._map(rows)
        numbers = []
        for column in layout.columns:
            values = data[SIGNALS][column.name]
            numbers.append(values.astype(bool) if column.boolean else values)
        units = layout.merge_columns([c.unit for c in layout.columns], [""] * len(layout.texts))
        signals = dict(
            zip(layout.names, layout.merge_columns(numbers, self.read_texts(rows)), strict=True)
        )
        return Recording(data[TIME], signals, dict(zip(layout.names, units, strict=True)))


def text_column(changes: Sequence[tuple[int, Any]], rows: int) -> np.ndarray:
    """Return a string signal, shape (rows,), from its values and the rows in which each begins."""
    import numpy as np

    values = np.full(rows, "", object)
    for (begin, value), (end, _) in pairwise([*changes, (rows, "")]):
        values[begin:end] = value
    return values


def recover_recording(folder: Path | None, rows: int) -> Recording:
    """Read the recording of an unfinished run.

    Args:
        folder: Folder of the run; None if it had none.
        rows: Number of recorded rows, unless the rows were kept with their number.

    Returns:
        A recording with fewer rows if foreign code has truncated the file, empty if there is no
        header.
    """
    from ..core.recording import Recording

    rows_file = RowsFile.open(folder) if folder else None
    if rows_file is None:
        return Recording.empty()
    return rows_file.recording(rows if rows_file.kept_rows is None else rows_file.kept_rows)


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
    folder: Path, metadata: Mapping[str, Any] | None = None, writes_csv: bool = False
) -> Iterator[None]:
    """Keep the files of a run in `folder` during the block, if this process has a supervisor.

    Remove them if it succeeds.

    Args:
        folder: Folder that is created; an existing one is replaced.
        metadata: Description of the run; None for none.
        writes_csv: The results will be written beside the folder, which requires disk space.
    """
    journal = current_journal()
    if journal is None:
        yield
        return
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    journal.set_folder(folder, writes_csv)
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
    """Keep the rows of a run whose results cannot be written, for `cosim recover`.

    The name of their file contains their number, because a full disk has no space for another file.

    Args:
        folder: Folder of the run.
        rows: Number of recorded rows.
        metadata: Description of the run, in types that JSON supports; kept unless the disk has no
            space for it.

    Raises:
        OSError: The file cannot be renamed, or the run has no header.
    """
    rows_file = RowsFile.open(folder)
    if rows_file is None:
        raise FileNotFoundError(folder / HEADER_FILE)
    file, row_size = rows_file.path, TIME_SIZE + rows_file.layout.signals_size
    os.truncate(file, min(file.stat().st_size, rows * row_size))
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
