"""The route in docs/route.md is the order in which a run first calls the functions of its table."""

import re
import sys
from pathlib import Path

import pytest

import cosim

ROOT = Path(cosim.__file__).parents[1]
TABLE_ROW = re.compile(r"\| \d+ \| `(\S+)` \| `(\S+)` \|")


def called_functions(action):
    """Return (file, function) of all Python functions of the project that `action` calls, in order."""
    calls = []

    def record(frame, event, _):
        if event == "call" and frame.f_code.co_filename.startswith(f"{ROOT}/cosim/"):
            calls.append((str(Path(frame.f_code.co_filename).relative_to(ROOT)), frame.f_code.co_qualname))

    sys.setprofile(record)
    try:
        action()
    finally:
        sys.setprofile(None)
    return calls


def test_a_run_passes_the_stops_in_their_order(folder, probe, monkeypatch):
    stops = TABLE_ROW.findall((ROOT / "docs/route.md").read_text())
    assert len(stops) == 16
    monkeypatch.setattr("cosim.engine.native_available", lambda: False)
    scenario = folder.scenario({"a": {"fmu": str(probe)}})
    calls = iter(called_functions(lambda: cosim.run(scenario)))
    for stop in stops:
        if stop not in calls:
            pytest.fail(f"{stop} is not called after the stop before it")
