"""Reading of long arrays in slices."""

import resource
from pathlib import Path

import numpy as np
import pytest

from cosim.results.files import iterate_chunks

STATISTICS = Path("/proc/self/statm")


@pytest.mark.parametrize("count", [0, 1, 9, 10, 11, 25])
def test_slices_cover_each_row_once(count):
    values = np.arange(count)
    parts = [values[piece] for piece in iterate_chunks([values, values], 10)]
    assert [x for part in parts for x in part.tolist()] == list(range(count))
    assert all(0 < len(part) <= 10 for part in parts)


def resident():
    """Return the resident memory of this process (bytes)."""
    return int(STATISTICS.read_text().split()[1]) * resource.getpagesize()


@pytest.mark.skipif(
    not STATISTICS.exists(), reason="only Linux tells how much memory is in use this way"
)
def test_memory_of_a_mapped_file_is_released_after_reading(tmp_path):
    rows = np.dtype([("x", np.float64), ("y", np.float64)])
    np.full(2_000_000, 1.0).tofile(tmp_path / "rows")
    values = np.memmap(tmp_path / "rows", rows, "r")["y"]
    before, total = resident(), 0.0
    for piece in iterate_chunks([values], 10_000):
        total += values[piece].sum()
    assert total == 1_000_000
    assert resident() - before < 8_000_000  # of 16 000 000


def test_a_mapped_file_can_be_read_again(tmp_path):
    np.arange(100_000.0).tofile(tmp_path / "rows")
    values = np.memmap(tmp_path / "rows", np.float64, "r")
    for _ in range(2):
        total = sum(values[piece].sum() for piece in iterate_chunks([values], 1000))
        assert total == values.sum() == 99_999 * 50_000.0
