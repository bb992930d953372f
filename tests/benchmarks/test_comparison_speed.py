"""Duration of the comparison of a result with its reference.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_comparison_speed.py
"""

from time import process_time

import numpy as np
import pytest

from cosim.core.recording import Recording
from cosim.results import Result
from cosim.results.comparison import compare
from cosim.results.tolerance_tube import Tolerance

pytestmark = pytest.mark.benchmark


def waves(signals, rows, delay=0.0, noise=0.0):
    time, rng = np.arange(rows) / 100, np.random.default_rng(1)
    columns = {
        f"s{i}": np.sin((1 + i / 10) * np.maximum(time - delay - 1, 0))
        + noise * rng.uniform(-1, 1, rows)
        for i in range(signals)
    }
    return Result(Recording(time, columns, dict.fromkeys(columns, "")))


@pytest.mark.parametrize(("signals", "rows"), [(150, 4000), (10, 1_000_000)])
def test_comparison(signals, rows):
    print()
    reference, tolerance = waves(signals, rows), Tolerance(absolute=0.01, time=0.1)
    for name, result in {
        "equal": reference,
        "within the tolerance in value": waves(signals, rows, noise=0.009),
        "within the tolerance in time": waves(signals, rows, delay=0.05),
    }.items():
        start = process_time()
        comparison = compare(result, reference, {"*": tolerance})
        print(f"  {signals} signals of {rows} rows, {name}: {process_time() - start:.3f} s of CPU")
        assert comparison.passed, str(comparison)
