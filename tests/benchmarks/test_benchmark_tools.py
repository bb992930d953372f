"""Tests of the benchmark tools; they run with all other tests."""

from __future__ import annotations

import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest
from bullet_calls import record_calls
from c_limit import CLimit
from cosim_contender import cpu_per_step, executors, ring_system
from fmpy.validation import validate_fmu
from lag_fmus import lag_fmu
from peer_comparison import write_into

from cosim.scenario import load

PEERS = Path(__file__).with_name("peer_comparison.py")


@pytest.mark.parametrize("width", [1, 3])
@pytest.mark.parametrize("version", [2, 3])
def test_the_lag_is_a_valid_fmu(version, width, tmp_path):
    assert validate_fmu(str(lag_fmu(tmp_path, version, width))) == []


@pytest.mark.parametrize("version", [2, 3])
def test_importer_and_c_limit_step_the_same_ring(version, tmp_path):
    """Both measurements check that all values stay at 1 exactly."""
    fmu = lag_fmu(tmp_path, version, width=3)
    assert CLimit(fmu, tmp_path)(4, 100, width=3, recorded=12) > 0
    for executor in executors():
        assert (
            cpu_per_step(
                ring_system(fmu, 4),
                100,
                [f"s{i}.y{j}" for i, j in product(range(4), (1, 2, 3))],
                executor,
            )
            > 0
        )


def test_recorded_bullet_calls_can_be_replayed():
    """The replay checks that every call returns the same result."""
    calls = record_calls(lambda: load("demo1_box", stop_time=2.0))
    assert calls.steps == 200
    assert {call.function.__name__ for call in calls.calls[calls.first : calls.last]} >= {
        "stepSimulation",
        "resetBaseVelocity",
    }
    assert calls.replay() > 0


def test_without_peers_cosim_is_compared_with_the_limit(tmp_path):
    command = [sys.executable, PEERS, tmp_path / "cache", "--sizes", "2", "--rounds", "1", "--only"]
    done = subprocess.run([*map(str, command)], capture_output=True, text=True, check=True)
    lines = done.stdout.splitlines()
    assert lines[0] == "| contender | ring 2 | y after the run |"
    assert "(1x)" in lines[2]
    assert "cosim" in lines[3]


def test_a_table_replaces_the_one_between_the_marks(tmp_path):
    document = tmp_path / "page.md"
    document.write_text("before\n<!-- peers -->\nold\nolder\n<!-- /peers -->\nafter\n")
    write_into(document, r"new \1")
    assert document.read_text() == "before\n<!-- peers -->\nnew \\1\n<!-- /peers -->\nafter\n"


def test_a_document_without_marks_is_refused(tmp_path):
    document = tmp_path / "page.md"
    document.write_text("no marks")
    with pytest.raises(SystemExit, match="has no <!-- peers -->"):
        write_into(document, "new")
