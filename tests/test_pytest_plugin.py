"""Scenarios as pytest tests."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from cosim_command import run_cosim

from cosim import pytest_plugin

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
    components = {
        "a": {
            "python": f"{BLOCKS}:{block}",
            **({"parameters": {"u": 1.5}} if block == "Gain" else {}),
        }
    }
    content = {
        "name": name,
        "stop_time": 3,
        "step_size": 1,
        "components": components,
        "kpis": KPIS,
        **more,
    }
    (folder / f"{name}.json").write_text(
        json.dumps({key: value for key, value in content.items() if value is not None})
    )


OPTIONS = ("-p", "no:cacheprovider")


@pytest.fixture
def run_pytest(folder, monkeypatch, capsys):
    """Function that runs pytest in the folder, in this process, with forked commands; returns exit
    code and output.
    """
    forked = SimpleNamespace(
        run=lambda command, **_: run_cosim(*command[3:]), DEVNULL=subprocess.DEVNULL
    )
    monkeypatch.setattr("cosim.studies.regression.subprocess", forked)
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTEST_ADDOPTS", "")
    monkeypatch.chdir(folder)

    def run(*arguments):
        code = pytest.main([*OPTIONS, *arguments], plugins=[pytest_plugin])
        return int(code), capsys.readouterr().out

    return run


def run_in_parallel(folder):
    """Run pytest with two processes of pytest-xdist; return its output."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-p",
        "cosim.pytest_plugin",
        *OPTIONS,
        "-p",
        "xdist",
        "-n",
        "2",
    ]
    environment = {**os.environ, "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1", "PYTEST_ADDOPTS": ""}
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, env=environment
    ).stdout


def test_scenarios_with_expectations_are_tests(folder, run_pytest):
    scenario(folder, "good", checks=[{"kpi": "y.value", "equals": 3.0}])
    scenario(folder, "aimless")
    code, out = run_pytest("-v")
    assert code == 0, out
    assert "good.json::good PASSED" in out
    assert "1 passed" in out


def test_failures_are_reported_without_a_traceback(folder, run_pytest):
    scenario(folder, "low", checks=[{"kpi": "y.value", "min": 4.0}])
    scenario(folder, "broken", block="FailingBlock", checks=[{"kpi": "y.value", "min": 4.0}])
    code, out = run_pytest()
    assert code == 1
    assert "y.value is 3, expected at least 4.0" in out
    assert "a: do_step failed at t = 2 s: ValueError: tilt beyond limit" in out
    assert "2 failed" in out
    assert "regression.py" not in out


def test_scenarios_are_chosen_by_name_and_run_in_parallel(folder, run_pytest):
    for name in ("first", "second", "third"):
        scenario(folder, name, checks=[{"kpi": "y.value", "equals": 3.0}])
    assert "1 passed, 2 deselected" in run_pytest("-k", "second")[1]
    assert "3 passed" in run_in_parallel(folder)


def test_invalid_files_fail_with_the_location(folder, run_pytest):
    checks = [{"kpi": "y.value", "equals": 3.0}]
    scenario(folder, "misspelt", checks=checks, stop_time=None, stop_tme=3)
    (folder / "torn.json").write_text('{"components": {"a":')
    (folder / "tsconfig.json").write_text('{"compilerOptions": {}, // comments are usual here\n}')
    code, out = run_pytest()
    assert code == 1
    assert "2 failed" in out
    assert '$.stop_tme: unknown key; did you mean "stop_time"?' in out
    assert "torn.json:1:" in out


def test_scenarios_with_equal_names_have_separate_results(folder, run_pytest):
    for calm, limit in (("calm", 3.0), ("storm", 4.0)):
        (folder / "scenarios" / calm).mkdir(parents=True)
        scenario(
            folder / "scenarios" / calm, "course", checks=[{"kpi": "y.value", "equals": limit}]
        )
    assert "1 failed, 1 passed" in run_pytest()[1]
    results = (folder / "runs").rglob("result.csv")
    assert sorted(path.parent.relative_to(folder / "runs").as_posix() for path in results) == [
        "scenarios/calm/course",
        "scenarios/storm/course",
    ]


def test_results_of_scenarios_outside_the_root_folder_are_inside_it(
    folder, run_pytest, tmp_path_factory
):
    outside = tmp_path_factory.mktemp("outside")
    scenario(outside, "course", checks=[{"kpi": "y.value", "equals": 3.0}])
    assert "1 passed" in run_pytest(f"--rootdir={folder}", str(outside))[1]
    assert (folder / "runs" / outside.relative_to(outside.anchor) / "course/result.csv").is_file()
