"""An FMU in a sandbox tries what it may not do, and a good one notices nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest
from fault_fmu import STEP_COUNT

from cosim.process.sandbox import find_available_sandboxes, landlock

MIB = 1 << 20
pytestmark = pytest.mark.skipif(
    find_available_sandboxes().landlock < landlock.NETWORK_ABI, reason="this kernel cannot confine files and network (Linux 6.7)"
)


@pytest.fixture
def contained(fmus, runner, tmp_path, version):
    """Runs an FMU with an order in a sandbox that lets it write to three folders; returns the outcome and its record."""
    places = [tmp_path / name for name in ("tmp", "results", "record")]
    for place in places:
        place.mkdir()
    own = replace(fmus, folder=tmp_path / "record")

    def run(order="", **settings):
        words = ("simulate", own(version, order), "--output-file", "results/result.csv")
        sandbox = {"writable": [*map(str, places)], "memory": 1024 * MIB, **settings}
        return runner.cosim(tmp_path, *words, limit=30, sandbox=sandbox), own

    return run


def test_a_good_fmu_notices_nothing(contained, tmp_path):
    done, _ = contained()
    assert done.code == 0, done.err
    assert len((tmp_path / "results/result.csv").read_text().splitlines()) == STEP_COUNT + 2


def test_it_writes_to_no_other_folder(contained, tmp_path):
    done, record = contained("DoStep 6 write_here")
    assert done.code == 0, done.err
    assert record.lines("file") == ["file fault_was_here 0"]
    assert not (tmp_path / "fault_was_here").exists()


def test_it_opens_no_connection(contained):
    done, record = contained("DoStep 6 tcp")
    assert done.code == 0, done.err
    assert record.lines("connect") == ["connect -1 Permission denied"]


def test_its_memory_is_limited(contained):
    done, record = contained("DoStep 6 memory")
    assert done.code == 1, done.err
    (line,) = record.lines("memory")
    assert 256 < int(line.split()[1]) <= 1024
    assert "out of memory" in done.err


def test_its_open_files_are_limited(contained):
    _, record = contained("DoStep 6 open_files", open_files=100)
    (line,) = record.lines("files")
    assert 50 < int(line.split()[1]) < 100
