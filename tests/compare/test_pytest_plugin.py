"""Scenarios as tests of pytest."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

BLOCKS = Path(__file__).parents[1] / "scenario" / "blocks.py"
KPIS = [{"name": "y", "python": "cosim.kpis:final", "arguments": {"signal": "a.y"}}]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "data.json").write_text('{"checks": ["of something else"]}')
    return tmp_path


def scenario(folder, name, block="Gain", **more):
    components = {"a": {"python": f"{BLOCKS}:{block}", **({"parameters": {"u": 1.5}} if block == "Gain" else {})}}
    content = {"name": name, "stop_time": 3, "step_size": 1, "components": components, "kpis": KPIS, **more}
    (folder / f"{name}.json").write_text(json.dumps(content))


def run_pytest(folder, *arguments):
    command = [sys.executable, "-m", "pytest", "-p", "cosim.pytest_plugin", "-p", "no:cacheprovider", *arguments]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    return subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, env=environment)


def test_scenarios_with_expectations_are_tests(folder):
    scenario(folder, "good", checks=[{"kpi": "y.value", "equals": 3.0}])
    scenario(folder, "aimless")
    done = run_pytest(folder, "-v")
    assert done.returncode == 0, done.stdout
    assert "good.json::good PASSED" in done.stdout
    assert "1 passed" in done.stdout


def test_what_is_not_met_is_said_without_a_traceback(folder):
    scenario(folder, "low", checks=[{"kpi": "y.value", "min": 4.0}])
    scenario(folder, "broken", block="Broken", checks=[{"kpi": "y.value", "min": 4.0}])
    done = run_pytest(folder)
    assert done.returncode == 1
    assert "y.value is 3, expected min 4.0" in done.stdout
    assert "a: do_step failed at t = 2 s: ValueError: tilt beyond limit" in done.stdout
    assert "2 failed" in done.stdout
    assert "regression.py" not in done.stdout


def test_scenarios_are_chosen_by_name_and_run_in_parallel(folder):
    for name in ("first", "second", "third"):
        scenario(folder, name, checks=[{"kpi": "y.value", "equals": 3.0}])
    assert "1 passed, 2 deselected" in run_pytest(folder, "-k", "second").stdout
    assert "3 passed" in run_pytest(folder, "-p", "xdist", "-n", "2").stdout
