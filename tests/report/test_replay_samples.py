"""The packed run of the replay page, unpacked by independent code."""

import numpy as np
import pytest
from packed_runs import unpacked

from cosim.core.recording import Recording
from cosim.report import replay as samples
from cosim.results import Result


def result(**columns):
    rows = len(next(iter(columns.values())))
    return Result(
        Recording(
            np.arange(rows) / 100,
            {k: np.asarray(v) for k, v in columns.items()},
            dict.fromkeys(columns, "m"),
        )
    )


def test_columns_unpack_to_32_bit_floats():
    values = np.array([1.0, -2.5, np.nan, np.inf, 1e-30, -0.0, 1 / 3])
    columns = unpacked(samples.pack_run(result(values=values, flags=values > 0)))
    np.testing.assert_array_equal(columns["values"], values.astype(np.float32))
    np.testing.assert_array_equal(columns["flags"], [1, 0, 0, 1, 1, 0, 1])
    np.testing.assert_array_equal(columns["time"], (np.arange(7) / 100).astype(np.float32))


def test_a_constant_signal_is_one_number():
    packed = samples.pack_run(
        result(still=[2.5, 2.5], never=[np.inf, np.inf], text=np.array(["a", "b"], object))
    )
    assert packed["constants"] == {"still": 2.5}
    assert packed["columns"] == ["time", "never"]
    assert packed["units"] == {"still": "m", "never": "m"}


def test_a_long_run_is_downsampled_and_keeps_its_peaks():
    rows = 100_003
    smooth, force = np.linspace(0, 7, rows), np.zeros(rows)
    force[[31_415, 77_777, rows - 2]] = 250.0, -80.0, 7.0
    touching = force > 0
    packed = samples.pack_run(result(smooth=smooth, force=force, touching=touching))
    columns = unpacked(packed)
    assert packed["rows"] <= samples.MAX_ROWS + 3
    assert columns["force"].max() == 250.0
    assert columns["force"].min() == -80.0
    assert columns["touching"].max() == 1.0
    assert columns["force"][-5:].max() == 7.0
    assert columns["time"][-1] == pytest.approx((rows - 1) / 100)
    np.testing.assert_allclose(
        np.interp(columns["time"], np.arange(rows) / 100, smooth), columns["smooth"], atol=1e-5
    )
    at_peak = columns["time"][columns["force"].argmax()]
    assert at_peak == pytest.approx(314.15, abs=2 * rows / samples.MAX_ROWS / 100)


def test_runs_of_many_signals_have_fewer_rows(monkeypatch):
    monkeypatch.setattr(samples, "MAX_VALUES", 1000)
    packed = samples.pack_run(result(**{f"s{i}": np.arange(400.0) + i for i in range(9)}))
    assert packed["rows"] * len(packed["columns"]) <= 1100
