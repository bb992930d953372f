"""Parquet files, read by pyarrow."""

import sys

import numpy as np
import pytest

from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.results import parquet_files
from cosim.results.parquet_files import write_parquet

parquet = pytest.importorskip("pyarrow.parquet")


def recording(rows=5):
    columns = {
        "a.x": np.linspace(0, 1, rows),
        "a.n": np.arange(rows, dtype=np.int32),
        "a.on": np.arange(rows) % 2 == 0,
        "a.text": np.array([f"row {i}, \u00e9" for i in range(rows)], object),
    }
    return Recording(
        np.arange(rows) / 100, columns, {"a.x": "m/s", "a.n": "", "a.on": "", "a.text": ""}
    )


def test_every_column_returns_in_its_own_type(tmp_path):
    given = recording()
    write_parquet(given, tmp_path / "r.parquet")
    table = parquet.read_table(tmp_path / "r.parquet")
    assert table.column_names == ["time", "a.x", "a.n", "a.on", "a.text"]
    assert [str(field.type) for field in table.schema] == [
        "double",
        "double",
        "int32",
        "bool",
        "string",
    ]
    for name, values in {"time": given.time, **given.columns}.items():
        assert table[name].to_pylist() == values.tolist()


def test_units_are_in_the_schema(tmp_path):
    write_parquet(recording(), tmp_path / "r.parquet")
    schema = parquet.read_schema(tmp_path / "r.parquet")
    assert [schema.field(name).metadata[b"unit"] for name in ("time", "a.x", "a.n")] == [
        b"s",
        b"m/s",
        b"",
    ]


def test_rows_are_written_group_by_group(tmp_path, monkeypatch):
    monkeypatch.setattr(parquet_files, "ROWS_PER_GROUP", 100)
    write_parquet(recording(1050), tmp_path / "r.parquet")
    file = parquet.ParquetFile(tmp_path / "r.parquet")
    assert file.num_row_groups == 11
    assert file.read()["a.n"].to_pylist() == list(range(1050))


def test_a_slice_of_structured_rows_is_written_as_it_is(tmp_path):
    rows = np.zeros(10, np.dtype([("x", np.float64), ("n", np.int32)]))
    rows["n"] = range(10)
    write_parquet(Recording(np.arange(10.0), {"n": rows["n"]}, {"n": ""}), tmp_path / "r.parquet")
    assert parquet.read_table(tmp_path / "r.parquet")["n"].to_pylist() == list(range(10))


def test_a_recording_without_rows_gives_a_file(tmp_path):
    write_parquet(recording(0), tmp_path / "r.parquet")
    assert parquet.read_table(tmp_path / "r.parquet").num_rows == 0


def test_without_the_package_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(InputError, match=r'pip install "fmi-cosim\[parquet\]"'):
        write_parquet(recording(), tmp_path / "r.parquet")
    assert not (tmp_path / "r.parquet").exists()
