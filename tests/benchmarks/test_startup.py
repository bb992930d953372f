"""CPU time of whole processes, compared with a Python process that does nothing.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_startup.py
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable

import pytest
from cost_measurement import measure_rounds, print_heading, print_rows

COMMANDS = {
    "python -c pass": ["-c", "pass"],
    'python -c "import cosim"': ["-c", "import cosim"],
    "cosim --help": ["-m", "cosim", "--help"],
    "cosim run demo1_box": ["-m", "cosim", "run", "demo1_box", "--no-report"],
}
#: largest allowed ratio to a Python process that does nothing (generous)
LARGEST_RATIO = {'python -c "import cosim"': 10, "cosim --help": 30, "cosim run demo1_box": 500}
pytestmark = pytest.mark.benchmark


def test_startup(tmp_path):
    print_heading("whole processes", "CPU ms")
    contenders: dict[str, Callable[[], float]] = {
        name: lambda words=words: cpu_milliseconds([sys.executable, *words], tmp_path)
        for name, words in COMMANDS.items()
    }
    ratios = print_rows("process", measure_rounds(contenders))
    assert all(ratios[name] < largest for name, largest in LARGEST_RATIO.items())


def cpu_milliseconds(command, folder):
    """Return the user and system time (ms) of a process and its children."""
    before = os.times()
    subprocess.run(command, cwd=folder, capture_output=True, check=True)
    after = os.times()
    return 1e3 * sum(
        getattr(after, kind) - getattr(before, kind)
        for kind in ("children_user", "children_system")
    )
