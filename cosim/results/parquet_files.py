"""Recordings for pandas: data frames (extra `dataframe`) and Parquet files (extra `parquet`).

A Parquet file keeps the types of the signals and has about a fifth of the size of CSV.
"""

from pathlib import Path
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.recording import Recording
from .files import iterate_chunks, writing_atomically

ROWS_PER_GROUP = 1 << 17


def require_parquet() -> None:
    """Raise InputError if the package pyarrow is not installed."""
    try:
        import pyarrow.parquet  # noqa: F401
    except ImportError:
        raise InputError(
            'Parquet files need the package pyarrow: pip install "fmi-cosim[parquet]"'
        ) from None


def write_parquet(recording: Recording, path: str | Path) -> None:
    """Write a Parquet file in bounded memory.

    An existing file is replaced only when the new one is complete.

    The first column is `time` (s). The metadata of each field contains its unit.

    Args:
        recording: The recording.
        path: The Parquet file.

    Raises:
        InputError: The file cannot be written, or the package pyarrow is not installed.
        OutputError: The disk is full or defective.
    """
    require_parquet()
    import pyarrow as pa
    from pyarrow.parquet import ParquetWriter

    columns = {"time": recording.time, **recording.columns}
    units = {"time": "s", **recording.units}
    fields = []
    for name, values in columns.items():
        kind = pa.string() if values.dtype == object else pa.from_numpy_dtype(values.dtype)
        fields.append(pa.field(name, kind, metadata={"unit": units[name]}))
    schema = pa.schema(fields)
    with writing_atomically(path) as temporary, ParquetWriter(temporary, schema) as writer:
        for piece in iterate_chunks(list(columns.values()), ROWS_PER_GROUP):
            parts = (np.ascontiguousarray(column[piece]) for column in columns.values())
            arrays = [pa.array(part, field.type) for part, field in zip(parts, schema, strict=True)]
            writer.write_batch(pa.record_batch(arrays, schema=schema))


def require_pandas() -> Any:
    """Return the package pandas; InputError if it is not installed."""
    try:
        import pandas as pd
    except ImportError:
        raise InputError(
            'data frames need the package pandas: pip install "fmi-cosim[dataframe]"'
        ) from None
    return pd


def to_dataframe(recording: Recording) -> Any:
    """Return a data frame with a column for each signal; the index is the time (s).

    The attribute `attrs["units"]` holds the unit of each signal.

    Raises:
        InputError: The package pandas is not installed.
    """
    pd = require_pandas()
    frame = pd.DataFrame(dict(recording.columns), index=pd.Index(recording.time, name="time"))
    frame.attrs["units"] = dict(recording.units)
    return frame
