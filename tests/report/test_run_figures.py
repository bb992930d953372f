"""Figures of a supervised run: files, report and failures."""

import json
from pathlib import Path

import pytest
from cosim_command import run_cosim

BLOCKS = Path(__file__).parents[1] / "scenario/pythonfmu_blocks.py"
FIGURES = """
import os
from matplotlib.figure import Figure

def curve(result, signal):
    figure = Figure()
    figure.subplots().plot(result.time, result[signal], label=str(sorted(result.kpis.items())))
    figure.legend()
    return figure

def last(result, signal):
    return {"value": result[signal][-1]}

def failing(result):
    raise ValueError("no data for this")

def crashing(result):
    os.kill(os.getpid(), 11)

def ending(result):
    os._exit(0)

def number(result):
    return 3
"""


def run(folder, *options, figures, block="Gain", **more):
    (folder / "own.py").write_text(FIGURES)
    entries = [
        {"name": name, "python": f"own.py:{name.rstrip('12')}", "arguments": values}
        for name, values in figures.items()
    ]
    kpis = [{"name": "last", "python": "own.py:last", "arguments": {"signal": "a.y"}}]
    components = {"a": {"python": f"{BLOCKS}:{block}"}}
    scenario = {
        "name": "small",
        "stop_time": 3,
        "step_size": 1,
        "components": components,
        "kpis": kpis,
        "figures": entries,
    }
    (folder / "small.json").write_text(json.dumps({**scenario, **more}))
    return run_cosim("run", "small.json", *options, cwd=folder)


def test_figures_and_report_are_those_of_a_run_in_one_process(tmp_path):
    figures = {"curve1": {"signal": "a.y"}, "curve2": {"signal": "a.y"}}
    for mode in ("run", "none"):
        done = run(tmp_path, "--isolation", mode, "--output-dir", mode, figures=figures)
        assert done.returncode == 0, done.stderr
        assert "run.json, curve1.png, curve2.png, report.html in" in done.stdout
    for name in ("curve1.png", "curve2.png", "result.csv", "kpis.json"):
        assert (tmp_path / "run" / name).read_bytes() == (tmp_path / "none" / name).read_bytes()
    drawings = []
    for mode in ("run", "none"):
        report = (tmp_path / mode / "report.html").read_text()
        drawings.append([line for line in report.splitlines() if "<path" in line])
    assert drawings[0] == drawings[1] != []


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("failing", "failing failed: ValueError: no data for this (own.py:15)"),
        (
            "crashing",
            "crashing failed: the process was ended by signal 11 (SIGSEGV, segmentation fault) "
            "(own.py:18)",
        ),
        ("ending", "ending failed: it ended the process with exit code 0"),
        ("number", "number failed: returned int, expected a matplotlib.figure.Figure"),
    ],
)
def test_a_figure_that_fails_is_named_and_all_results_are_kept(tmp_path, name, words):
    done = run(tmp_path, "--output-dir", "out", figures={"curve": {"signal": "a.y"}, name: {}})
    assert done.returncode == 1
    assert done.stderr == f'figure "{name}": {words}\n'
    assert len((tmp_path / "out/result.csv").read_text().splitlines()) == 5
    assert json.loads((tmp_path / "out/kpis.json").read_text()) != {}


@pytest.mark.parametrize("mode", ["run", "none"])
def test_a_module_that_cannot_be_imported_is_refused_once(tmp_path, mode):
    (tmp_path / "broken.py").write_text("import no_such_module\n\ndef curve(result):\n    pass\n")
    figures = [{"name": "curve", "python": "broken.py:curve"}]
    (tmp_path / "own.py").write_text(FIGURES)
    components = {"a": {"python": f"{BLOCKS}:Gain"}}
    scenario = {
        "name": "small",
        "stop_time": 3,
        "step_size": 1,
        "components": components,
        "figures": figures,
    }
    (tmp_path / "small.json").write_text(json.dumps(scenario))
    done = run_cosim("run", "small.json", "--isolation", mode, cwd=tmp_path)
    assert done.returncode == 2
    reason = "ModuleNotFoundError: No module named 'no_such_module' (broken.py:1)"
    assert done.stderr == f'"broken.py" cannot be imported: {reason}\n'


def test_a_run_that_fails_draws_nothing(tmp_path):
    done = run(
        tmp_path, "--output-dir", "out", figures={"curve": {"signal": "a.y"}}, block="FailingBlock"
    )
    assert done.returncode == 1
    assert "figure" not in done.stderr
    assert not (tmp_path / "out/curve.png").exists()
