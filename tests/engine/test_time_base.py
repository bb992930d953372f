"""Rows off the time grid: two rows of one time and a point at a third of a step, from executors
through the rows file, all output files, the comparison, KPIs and the report.
"""

from __future__ import annotations

import json
import re
from fractions import Fraction

import numpy as np
import pytest
from cosim_command import run_cosim
from fakes import FakeComponent, outputs
from packed_runs import unpacked
from systems import endpoint, make_system

from cosim.engine import EXECUTORS, compile_plan
from cosim.engine.plan_run import PlanRun
from cosim.engine.settings import Settings
from cosim.kpis import energy
from cosim.process.journal import JOURNAL_SIZE, Journal, set_current_journal
from cosim.process.run_files import RowsFile
from cosim.report.run_page import write_report
from cosim.results import Result
from cosim.results.comparison import compare
from cosim.results.reference import decimate
from cosim.results.tolerance_tube import Tolerance

STEP = Fraction(3, 10)
#: limits before and after an event at 0.6 s, thirds of two steps at 0.7 s and 1 s
TIMES = [0.0, 0.3, 0.6, 0.6, 0.7, 0.9, 1.0, 1.2]
VALUES = [0.0, 1.0, 2.0, 102.0, 103.0, 3.0, 53.0, 4.0]
TEXTS = ["a", "a", "a", "b", "b", "a", "c", "a"]
METADATA = {"name": "events", "scenario": {}, "checks": []}


class Driver:
    """A run whose step hook and whose component record further rows."""

    def __init__(self, executor: str):
        self._number = 0

        def step(values, time, _step_size):
            self._number += 1
            if time == 0.9:  # within the macro step, with outputs at a third of it
                self._record(Fraction(1), 53.0, "c")
            values["y"], values["text"] = float(self._number), "a"

        variables = [*outputs("y"), *outputs("text", type="String")]
        component = FakeComponent(variables, step, start={"text": "a"})
        settings = Settings(
            Fraction(0),
            4 * STEP,
            STEP,
            {"a.y": endpoint("a.y"), **self.texts},
            executor=executor,
        )
        self.plan = compile_plan(make_system({"a": component}), settings)
        self.run = PlanRun(self.plan, self._hook)

    texts = {"a.text": endpoint("a.text")}

    def _hook(self, n: int) -> None:
        if n == 2:
            self._record(0.6, 102.0, "b")
            self._record(Fraction(7, 10), 103.0, "b")

    def _record(self, time: Fraction | float, value: float, text: str) -> None:
        positions, arrays = self.plan.outputs.positions, self.plan.outputs.arrays
        for name, new in {"a.y": value, **dict.fromkeys(self.texts, text)}.items():
            position = positions[endpoint(name)]
            arrays[position.dtype][position.offset] = new
        self.run.executor.record_between(time)

    def result(self) -> Result:
        self.run.initialize()
        self.run.advance(4)
        outcome = self.run.outcome()
        assert outcome.failure is None
        return Result(outcome.recording, metadata=METADATA)


class NumbersOnly(Driver):
    """The same without strings, which only Python records."""

    texts = {}


@pytest.fixture(params=[Driver, NumbersOnly])
def kind(request):
    return request.param


@pytest.fixture
def journal(tmp_path):
    """A journal as in a supervised process, so that rows are written to a folder."""
    journal = Journal(bytearray(JOURNAL_SIZE))
    folder = tmp_path / "unfinished"
    folder.mkdir()
    journal.set_folder(folder)
    set_current_journal(journal)
    yield journal
    set_current_journal(None)


def assert_rows(recording, texts=True):
    assert recording.time.dtype == np.float64
    assert recording.time.tolist() == TIMES
    assert recording.columns["a.y"].tolist() == VALUES
    if texts and "a.text" in recording.columns:
        assert recording.columns["a.text"].tolist() == TEXTS


@pytest.mark.parametrize("executor", EXECUTORS)
def test_rows_in_memory(executor, kind):
    """There are more rows than communication points, so the memory of the rows grows."""
    assert_rows(kind(executor).result().recording)


@pytest.mark.parametrize("executor", EXECUTORS)
def test_rows_in_a_file_of_small_chunks(executor, kind, journal, monkeypatch):
    monkeypatch.setattr("cosim.process.row_store.CHUNK_BYTES", 32)
    assert_rows(kind(executor).result().recording)
    rows_file = RowsFile.open(journal.folder)
    assert rows_file.count_rows() == len(TIMES)
    assert_rows(rows_file.recording(len(TIMES)))


@pytest.mark.parametrize("executor", EXECUTORS)
def test_a_time_outside_the_present_step_is_refused(executor):
    driver = NumbersOnly(executor)
    driver.run.initialize()
    driver.run.advance(1)
    for time in (0.2, 0.7, float("nan")):
        with pytest.raises(ValueError, match=r"expected a time from the last row, 0\.3 s, to"):
            driver.run.executor.record_between(time)
    driver.run.executor.record_between(0.45)
    with pytest.raises(ValueError, match=r"0\.45 s, to the next communication point, 0\.6 s"):
        driver.run.executor.record_between(0.4)


@pytest.mark.parametrize("executor", EXECUTORS)
def test_rows_are_forgotten_by_a_restored_state(executor):
    driver = NumbersOnly(executor)
    driver.run.initialize()
    driver.run.advance(1)
    state = driver.run.executor.save()
    driver.run.executor.record_between(0.4)
    driver.run.executor.restore(state)
    assert driver.run.outcome().recording.time.tolist() == [0.0, 0.3]


@pytest.fixture(scope="module")
def result() -> Result:
    return Driver("python").result()


def test_files(result, tmp_path):
    result.to_csv(tmp_path / "result.csv")
    lines = (tmp_path / "result.csv").read_text().splitlines()
    assert lines[3:6] == ['0.6,2.0,"a"', '0.6,102.0,"b"', '0.7,103.0,"b"']
    assert_rows(Result.from_csv(tmp_path / "result.csv").recording)


def test_parquet(result, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    result.to_parquet(tmp_path / "result.parquet")
    table = parquet.read_table(tmp_path / "result.parquet")
    assert table["time"].to_pylist() == TIMES
    assert table["a.y"].to_pylist() == VALUES


def test_mcap(result, tmp_path):
    reader = pytest.importorskip("mcap.reader")
    result.to_mcap(tmp_path / "result.mcap")
    with (tmp_path / "result.mcap").open("rb") as file:
        messages = [
            (message.log_time, json.loads(message.data)["y"])
            for _, _, message in reader.make_reader(file).iter_messages(topics=["/signals/a"])
        ]
    assert messages == [(round(1e9 * t), y) for t, y in zip(TIMES, VALUES, strict=True)]


def test_kpis(result):
    """The jump has no duration: trapezoids below the polyline through all rows."""
    assert result.time.tolist() == TIMES
    heights = np.array(VALUES)
    expected = np.sum((heights[1:] + heights[:-1]) / 2 * np.diff(TIMES))
    assert energy(result, "a.y")["value"] == pytest.approx(expected)


def test_comparison(result, tmp_path):
    """The tube contains the jump; a result without it leaves the tube there."""
    exact = {"*": Tolerance()}
    assert compare(result, result, exact).passed
    smooth = [0, 1, 2, 5, 7]
    without = Result(
        type(result.recording)(
            result.time[smooth],
            {name: column[smooth] for name, column in result.recording.columns.items()},
            {},
        )
    )
    verdicts = {verdict.signal: verdict for verdict in compare(result, without, exact).verdicts}
    assert verdicts["a.y"].time == 0.6
    assert verdicts["a.text"].time == 0.6
    assert not compare(without, result, exact).passed
    for name, run in (("a", result), ("b", result), ("c", without)):
        run.to_csv(tmp_path / f"{name}.csv")
    same, other = (run_cosim("compare", tmp_path / "a.csv", tmp_path / f"{n}.csv") for n in "bc")
    assert same.returncode == 0, same.stderr
    assert other.returncode == 3
    assert "a.y is 102 at t = 0.6 s, expected 2" in other.stderr


def test_a_reference_keeps_the_jump(result):
    reference = decimate(result, {"*": Tolerance(absolute=0.01)})
    assert compare(result, reference, {"*": Tolerance(absolute=0.01)}).passed


def test_report(result, tmp_path):
    write_report(result, [], [], tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    samples = re.search(r'\{[^{}]*"rows":\s*8[^{}]*"columns":.*?"samples":\s*"[^"]*"', page)
    assert samples, "the page contains no recorded run"
    packed = json.loads(
        re.sub(r'"constants":\s*\{.*?\},|"units":\s*\{.*?\},', "", samples[0]) + "}"
    )
    columns = unpacked(packed)
    assert columns["time"].tolist() == np.float32(TIMES).tolist()
    assert columns["a.y"].tolist() == VALUES
