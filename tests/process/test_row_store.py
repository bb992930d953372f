"""Row stores in memory, in a given file and in a temporary file."""

from fractions import Fraction

import numpy as np
import pytest
from fakes import counter
from systems import endpoint, make_system

from cosim.engine.plan_run import simulate
from cosim.engine.settings import Settings
from cosim.process.row_store import FileMapping
from cosim.results.csv_files import read_csv, write_csv
from cosim.results.files import _memory_map

pytestmark = pytest.mark.usefixtures("executor")
STEPS = 3000


def recorded(every=1, **more):
    columns = {"a.y": endpoint("a.y"), "a.n": endpoint("a.n")}
    interval = Fraction(every, 100)
    settings = Settings(
        Fraction(0), Fraction(STEPS, 100), Fraction(1, 100), columns, interval, **more
    )
    return simulate(make_system({"a": counter()}), settings).recording


@pytest.fixture
def small_chunks(monkeypatch):
    for name, value in (("CHUNK_BYTES", 1000), ("MAX_MEMORY_BYTES", 0)):
        monkeypatch.setattr(f"cosim.process.row_store.{name}", value)
    monkeypatch.setattr("cosim.engine.recorder.MAX_MEMORY_BYTES", 0)


@pytest.mark.usefixtures("small_chunks")
def test_many_rows_are_kept_in_a_file_and_are_the_same():
    recording = recorded()
    assert isinstance(_memory_map(recording.columns["a.y"]), FileMapping)
    assert isinstance(_memory_map(recording.time), FileMapping)
    assert recording.time.tolist() == [n / 100 for n in range(STEPS + 1)]
    assert recording.columns["a.y"].tolist() == list(range(STEPS + 1))
    assert recording.columns["a.n"].tolist() == list(range(STEPS + 1))


@pytest.mark.usefixtures("small_chunks")
def test_rows_of_every_nth_step_have_the_right_times():
    recording = recorded(every=3)
    assert recording.time.tolist() == [n / 100 for n in range(0, STEPS + 1, 3)]
    assert recording.columns["a.y"].tolist() == list(range(0, STEPS + 1, 3))


def test_rows_are_stored_in_the_given_file(tmp_path):
    recording = recorded(rows_file=tmp_path / "rows")
    dtype = np.dtype([("t", np.float64), ("y", np.float64), ("n", np.int32), ("gap", np.int32)])
    rows = np.fromfile(tmp_path / "rows", dtype)
    assert len(rows) == STEPS + 1
    assert rows["t"].tolist() == recording.time.tolist()
    assert rows["n"].tolist() == recording.columns["a.n"].tolist()


@pytest.mark.usefixtures("small_chunks")
def test_csv_is_written_from_a_file_of_rows(tmp_path):
    recording = recorded()
    write_csv(recording, tmp_path / "result.csv")
    again = read_csv(tmp_path / "result.csv")
    assert again.time.tolist() == recording.time.tolist()
    assert again.columns["a.y"].tolist() == recording.columns["a.y"].tolist()


def test_rows_without_signals_contain_times(tmp_path):
    settings = Settings(Fraction(0), Fraction(1), Fraction(1, 100), rows_file=tmp_path / "rows")
    recording = simulate(make_system({"a": counter()}), settings).recording
    assert len(recording.time) == 101
    assert not recording.columns
