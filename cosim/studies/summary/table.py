"""Table of a sweep.

One row per finished run in the order of the design, independent of how and where they were run.
"""

import csv
import json
from collections.abc import Callable, Iterable, Sequence
from itertools import islice
from pathlib import Path
from typing import Any

from ...results.csv_files import text_cell
from ...results.files import writing_atomically
from ..sweep import SweepRow

#: returns an iterator over all rows, which are never all in memory
RowSource = Callable[[], Iterable[SweepRow]]

#: rows written to Parquet at a time
_BATCH_SIZE = 10_000


def table_header(factors: Sequence[str], kpis: Sequence[str]) -> list[str]:
    """Return the names of the columns."""
    return ["run", *factors, "status", "passed", *kpis, "failure"]


def row_values(row: SweepRow, factors: Sequence[str], kpis: Sequence[str]) -> list[Any]:
    """Return the values of a row by column; None for a KPI that the run lacks."""
    record = row.record
    return [
        row.run,
        *(row.point.labels[name] for name in factors),
        "failed" if record.failure else "ok",
        row.passed,
        *(record.kpis.get(name) for name in kpis),
        record.failure,
    ]


def write_csv(rows: RowSource, factors: Sequence[str], kpis: Sequence[str], path: Path) -> None:
    """Write the table as CSV.

    Booleans as 0 and 1, numbers that round-trip, nan and inf, and empty cells for missing values.
    """
    write_csv_rows(
        table_header(factors, kpis), (row_values(row, factors, kpis) for row in rows()), path
    )


def write_csv_rows(names: Sequence[str], lines: Iterable[Sequence[Any]], path: Path) -> None:
    """Write a CSV file atomically.

    Raises:
        InputError: if the folder cannot be written.
        OutputError: if writing fails, as on a full disk.
    """
    with (
        writing_atomically(path) as temporary,
        temporary.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(map(text_cell, names))
        writer.writerows(map(csv_value, line) for line in lines)


def csv_value(value: Any) -> Any:
    """Return a value as it is written to a CSV file."""
    if isinstance(value, bool):
        return int(value)
    if isinstance(value, str):
        return text_cell(value)
    return json.dumps(value) if isinstance(value, list | dict) else value


def write_parquet(rows: RowSource, factors: Sequence[str], kpis: Sequence[str], path: Path) -> None:
    """Write the table as Parquet (extra `parquet`).

    KPIs and purely numeric factors are doubles.
    """
    import pyarrow as pa
    from pyarrow.parquet import ParquetWriter

    texts: set[str] = set()
    for row in rows():
        labels = row.point.labels
        texts.update(name for name in labels if not isinstance(labels[name], int | float))
    kinds = {"run": pa.int64(), "status": pa.string(), "passed": pa.bool_(), "failure": pa.string()}
    names = table_header(factors, kpis)
    schema = pa.schema(
        [
            (name, kinds.get(name) or (pa.string() if name in texts else pa.float64()))
            for name in names
        ]
    )
    with writing_atomically(path) as temporary, ParquetWriter(temporary, schema) as writer:
        lines = (row_values(row, factors, kpis) for row in rows())
        while batch := list(islice(lines, _BATCH_SIZE)):
            columns = []
            for field, values in zip(schema, zip(*batch, strict=True), strict=True):
                column: Sequence[Any] = values
                if field.type == pa.string():
                    column = [str(csv_value(value)) for value in values]
                elif field.type == pa.float64():
                    column = [None if value is None else float(value) for value in values]
                columns.append(pa.array(column, field.type))
            writer.write_batch(pa.record_batch(columns, schema=schema))
