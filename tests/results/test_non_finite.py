"""Warnings about recorded values that are NaN or infinite."""

import logging

import numpy as np
import pytest

from cosim.core.recording import Recording
from cosim.results.checks import warn_non_finite

NAN, INF = float("nan"), float("inf")


def recording(rows, **columns):
    return Recording(np.arange(rows) / 100, columns, dict.fromkeys(columns, ""))


def spoiled(rows, row, value=NAN, dtype=np.float64):
    values = np.zeros(rows, dtype)
    values[row:] = value
    return values


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("value", [NAN, INF, -INF])
@pytest.mark.parametrize("row", [0, 1, 16383, 16384, 39999])
def test_a_signal_has_one_warning_with_its_first_time(caplog, row, value, dtype):
    """Rows are examined in chunks of 16384."""
    assert warn_non_finite(recording(40000, y=spoiled(40000, row, value, dtype))) == {
        "y": row / 100
    }
    assert caplog.messages == [
        f"y is {value} at t = {row / 100:.12g} s, its first value that is not finite"
    ]


def test_the_largest_floats_are_finite(caplog):
    columns = {
        dtype.__name__: np.array([np.finfo(dtype).max, np.finfo(dtype).min], dtype)
        for dtype in (np.float64, np.float32)
    }
    assert warn_non_finite(recording(2, **columns)) == {}
    assert not caplog.messages


def test_only_floats_are_examined():
    columns = {
        "i": np.array([1, 2]),
        "b": np.array([True, False]),
        "s": np.array(["nan", "inf"], object),
    }
    assert warn_non_finite(recording(2, **columns)) == {}


def test_a_recording_may_have_no_row_and_no_column():
    assert warn_non_finite(Recording.empty()) == {}
    assert warn_non_finite(recording(3)) == {}


def test_the_earliest_signals_come_first_and_of_many_only_some_have_a_warning(caplog):
    columns = {f"y{i}": spoiled(100, 99 - i) for i in range(50)}
    found = warn_non_finite(recording(100, **columns))
    assert [*found.items()] == [(f"y{i}", (99 - i) / 100) for i in reversed(range(50))]
    assert len(caplog.messages) == 21
    assert caplog.messages[0] == "y49 is nan at t = 0.5 s, its first value that is not finite"
    assert caplog.messages[-1] == "30 further recorded signals are not finite"
    assert {record.levelno for record in caplog.records} == {logging.WARNING}
