"""The route in docs/route.md is the order in which a run first calls the functions of its table,
and it is short.
"""

import re
import sys
from itertools import pairwise
from pathlib import Path

import pytest

import cosim

ROOT = Path(cosim.__file__).parents[1]
TABLE_ROW = re.compile(r"\| \d+ \| `(\S+)` \| `(\S+)` \|")
#: packages on the route, the highest first (see CONTRIBUTING.md)
PACKAGES = ("api", "scenario", "engine", "components")
CHECKS = ("check_run", "TimeGrid.from_times", "compile_plan")


def table():
    """Return (file, function) of each stop in docs/route.md."""
    return TABLE_ROW.findall((ROOT / "docs/route.md").read_text())


def called_functions(action):
    """Return (file, function) of all Python functions of the project that `action` calls, in order."""
    calls = []

    def record(frame, event, _):
        if event == "call" and frame.f_code.co_filename.startswith(f"{ROOT}/cosim/"):
            calls.append(
                (str(Path(frame.f_code.co_filename).relative_to(ROOT)), frame.f_code.co_qualname)
            )

    sys.setprofile(record)
    try:
        action()
    finally:
        sys.setprofile(None)
    return calls


@pytest.fixture
def calls(folder, probe, monkeypatch):
    """Functions called by a run of one FMU."""
    monkeypatch.setattr("cosim.engine.native_available", lambda: False)
    scenario = folder.scenario({"a": {"fmu": str(probe)}})
    return called_functions(lambda: cosim.run(scenario))


def test_a_run_passes_the_stops_in_their_order(calls):
    remaining = iter(calls)
    for stop in table():
        if stop not in remaining:
            pytest.fail(f"{stop} is not called after the stop before it")


def test_the_route_is_short():
    heights = [PACKAGES.index(Path(file).with_suffix("").parts[1]) for file, _ in table()]
    assert 12 <= len(heights) <= 16
    assert sum(after < before for before, after in pairwise(heights)) <= 4


@pytest.mark.parametrize("function", CHECKS)
def test_a_run_is_checked_and_compiled_once(calls, function):
    assert [name for _, name in calls].count(function) == 1
