"""Many runs and many steps in one process: it does not grow."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

GROWTH = Path(__file__).parent / "resource_growth.py"
MEGABYTE = 1 << 20
#: growth of a long measurement that is allowed, without Bullet and with it (bytes)
PLAIN, BULLET = 5 * MEGABYTE, 15 * MEGABYTE


def grown(folder: Path, *arguments: object) -> dict[str, int]:
    (folder / "tmp").mkdir()
    words = [sys.executable, GROWTH, *map(str, arguments)]
    environment = {
        name: value for name, value in os.environ.items() if not name.startswith("COVERAGE_")
    }  # whose data grow
    environment["TMPDIR"] = str(folder / "tmp")
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    growth: dict[str, int] = json.loads(done.stdout)
    return growth


def pair(folder: Path, probes: dict[int, Path]) -> Path:
    """Two small foreign FMUs that feed each other, one of each FMI version."""
    document = {
        "name": "pair",
        "stop_time": 1.0,
        "step_size": 0.01,
        "components": {
            name: {"fmu": str(probes[version])} for name, version in (("a", 2), ("b", 3))
        },
        "connections": [{"from": "a.y", "to": "b.u"}, {"from": "b.y", "to": "a.u"}],
    }
    file = folder / "pair.json"
    file.write_text(json.dumps(document))
    return file


def judge(growth: dict[str, int], memory: float) -> None:
    assert growth.pop("memory") < memory
    assert set(growth.values()) == {0}, growth


def test_many_runs_leave_nothing(tmp_path, probes):
    judge(grown(tmp_path, pair(tmp_path, probes), "runs", 50), PLAIN / 2)


def test_some_runs_with_bullet_leave_nothing(tmp_path):
    judge(grown(tmp_path, "demo1_box", "runs", 10), BULLET / 4)


@pytest.mark.parametrize(
    ("scenario", "limit"), [("free_flight", PLAIN / 4), ("demo1_box", BULLET / 4)]
)
def test_many_steps_need_no_memory(tmp_path, scenario, limit):
    judge(grown(tmp_path, scenario, "steps", 50_000), limit)


@pytest.mark.long
@pytest.mark.parametrize(("scenario", "limit"), [("free_flight", PLAIN), ("demo1_box", BULLET)])
@pytest.mark.parametrize(("what", "count"), [("runs", 1000), ("steps", 1_000_000)])
def test_a_long_life_leaves_nothing(tmp_path, scenario, limit, what, count):
    judge(grown(tmp_path, scenario, what, count), limit)
