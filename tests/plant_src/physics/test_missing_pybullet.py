"""An environment without PyBullet, as with a Python version for which it has no wheels."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

FMUS = Path(__file__).parents[3] / "fmus"


def run_without_pybullet(folder: Path, scenario: object) -> subprocess.CompletedProcess[str]:
    """Run `cosim run` in a process whose import of `pybullet` fails as if it were not installed."""
    modules = folder / "modules"
    modules.mkdir()
    (modules / "pybullet.py").write_text(
        'raise ModuleNotFoundError("No module named \'pybullet\'", name="pybullet")\n'
    )
    search_path = os.pathsep.join(filter(None, (str(modules), os.environ.get("PYTHONPATH"))))
    command = [
        sys.executable,
        "-m",
        "cosim",
        "run",
        str(scenario),
        "--no-report",
        "--output-dir",
        str(folder / "out"),
    ]
    environment = {**os.environ, "PYTHONPATH": search_path}
    return subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=100, check=False
    )


def test_a_scenario_without_the_world_runs(tmp_path: Path) -> None:
    scenario = tmp_path / "free.json"
    components = {"uav": {"fmu": str(FMUS / "ar_drone.fmu")}}
    scenario.write_text(
        json.dumps({"name": "free", "stop_time": 1, "step_size": 0.01, "components": components})
    )
    process = run_without_pybullet(tmp_path, scenario)
    assert process.returncode == 0, process.stderr
    assert len((tmp_path / "out/result.csv").read_text().splitlines()) == 102


def test_the_world_names_what_is_missing_and_the_ways_out_in_one_line(tmp_path: Path) -> None:
    process = run_without_pybullet(tmp_path, "demo1_box")
    assert process.returncode == 2
    assert len(process.stderr.splitlines()) == 1
    for text in (
        "$.components.plant",
        "PyBullet is not installed",
        "Python 3.11 to 3.13",
        "pip install pybullet",
        '"fmu"',
    ):
        assert text in process.stderr
