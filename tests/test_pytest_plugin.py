"""Scenarios as pytest tests."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

BLOCKS = Path(__file__).parent / "scenario" / "pythonfmu_blocks.py"
KPIS = [{"name": "y", "python": "cosim.kpis:final", "arguments": {"signal": "a.y"}}]


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "pytest.ini").write_text("[pytest]\n")
    (tmp_path / "data.json").write_text('{"checks": ["of something else"]}')
    (tmp_path / "sweep.json").write_text('{"scenario": "good.json", "success": []}')
    (tmp_path / "system.json").write_text('{"components": {}, "ports": {}}')
    return tmp_path


def scenario(folder, name, block="Gain", **more):
    components = {"a": {"python": f"{BLOCKS}:{block}", **({"parameters": {"u": 1.5}} if block == "Gain" else {})}}
    content = {"name": name, "stop_time": 3, "step_size": 1, "components": components, "kpis": KPIS, **more}
    (folder / f"{name}.json").write_text(json.dumps({key: value for key, value in content.items() if value is not None}))


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


def test_failures_are_reported_without_a_traceback(folder):
    scenario(folder, "low", checks=[{"kpi": "y.value", "min": 4.0}])
    scenario(folder, "broken", block="FailingBlock", checks=[{"kpi": "y.value", "min": 4.0}])
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


def test_invalid_files_fail_with_the_location(folder):
    checks = [{"kpi": "y.value", "equals": 3.0}]
    scenario(folder, "misspelt", checks=checks, stop_time=None, stop_tme=3)
    (folder / "torn.json").write_text('{"components": {"a":')
    (folder / "tsconfig.json").write_text('{"compilerOptions": {}, // comments are usual here\n}')
    done = run_pytest(folder)
    assert done.returncode == 1
    assert "2 failed" in done.stdout
    assert '$.stop_tme: unknown key; did you mean "stop_time"?' in done.stdout
    assert "torn.json:1:" in done.stdout


def test_scenarios_with_equal_names_have_separate_results(folder):
    for calm, limit in (("calm", 3.0), ("storm", 4.0)):
        (folder / "scenarios" / calm).mkdir(parents=True)
        scenario(folder / "scenarios" / calm, "course", checks=[{"kpi": "y.value", "equals": limit}])
    assert "1 failed, 1 passed" in run_pytest(folder, "-p", "xdist", "-n", "2").stdout
    results = (folder / "runs").rglob("result.csv")
    assert sorted(path.parent.relative_to(folder / "runs").as_posix() for path in results) == [
        "scenarios/calm/course",
        "scenarios/storm/course",
    ]


def test_results_of_scenarios_outside_the_root_folder_are_inside_it(folder, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside")
    scenario(outside, "course", checks=[{"kpi": "y.value", "equals": 3.0}])
    assert "1 passed" in run_pytest(folder, f"--rootdir={folder}", str(outside)).stdout
    assert (folder / "runs" / outside.relative_to(outside.anchor) / "course/result.csv").is_file()
