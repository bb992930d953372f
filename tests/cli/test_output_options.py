"""Options that choose what commands print: --json, --quiet, --verbose; and `cosim list`."""

import json
import logging
import re
from itertools import chain
from pathlib import Path

import pytest
from cosim_command import run_cosim

from cosim.cli import COMMANDS
from cosim.cli.messages import collect_log, print_log

ROOT = Path(__file__).parents[2]
TALKING = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real


class Talker(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        self.y = time
        print("stepping", time)
        if time >= {limit}:
            raise ValueError("too late")
        return True
"""
KPIS = (
    "from cosim import units\n\n\n@units(value='m')\ndef last(result, signal):\n    return "
    "{'value': float(result[signal][-1])}\n"
)
FIGURES = """
from matplotlib.figure import Figure


def line(result, signal):
    figure = Figure()
    figure.subplots().plot(result.time, result[signal])
    return figure


def broken(result):
    raise ValueError("no last row")
"""


def talker(folder, limit=100.0, largest=2.0, **more):
    """Write a scenario whose component prints, with a check of its last output."""
    (folder / "talker.py").write_text(TALKING.format(limit=limit))
    (folder / "kpis.py").write_text(KPIS)
    content = {
        "name": "talk",
        "stop_time": 3,
        "step_size": 1,
        "components": {"a": {"python": "talker.py:Talker"}},
        "kpis": [{"name": "end", "python": "kpis.py:last", "arguments": {"signal": "a.y"}}],
        "checks": [{"kpi": "end.value", "max": largest}],
        **more,
    }
    (folder / "talk.json").write_text(json.dumps(content))
    return folder / "talk.json"


@pytest.mark.parametrize("isolation", ["run", "none"])
def test_json_of_a_run_is_not_mixed_with_what_components_print(tmp_path, isolation):
    done = run_cosim(
        "run", talker(tmp_path), "--json", "--no-report", "--isolation", isolation, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert (summary["exit_code"], summary["failure"], summary["kpis"]) == (
        0,
        None,
        {"end.value": 2.0},
    )
    assert summary["checks"] == [{"kpi": "end.value", "max": 2.0, "value": 2.0, "passed": True}]
    assert (tmp_path / summary["folder"] / summary["files"][0]).is_file()
    assert "stepping 1.0" in done.stderr


def test_quiet_prints_only_what_is_wrong(tmp_path):
    good = run_cosim("run", talker(tmp_path), "--quiet", cwd=tmp_path)
    assert (good.returncode, good.stdout, good.stderr) == (0, "", "")
    bad = run_cosim("run", talker(tmp_path, largest=1.0), "--quiet", cwd=tmp_path)
    assert (bad.returncode, bad.stdout, bad.stderr) == (
        3,
        "",
        "check failed: end.value is 2 m, expected at most 1.0 m\n",
    )
    both = run_cosim("run", tmp_path / "talk.json", "--quiet", "--json", cwd=tmp_path)
    assert json.loads(both.stdout)["exit_code"] == 3
    regressed = run_cosim("regress", tmp_path / "talk.json", "-q", cwd=tmp_path)
    assert (regressed.returncode, regressed.stdout) == (3, "")
    assert (
        regressed.stderr
        == "talk: end.value is 2 m, expected at most 1.0 m\ntalk: see runs/talk/report.html\n"
    )


def test_verbose_prints_timings(tmp_path):
    done = run_cosim("run", talker(tmp_path), "--verbose", "--no-report", cwd=tmp_path)
    assert "loop_seconds" in done.stdout


def test_a_failed_run_has_a_report_with_its_cause_and_the_figures_that_can_be_drawn(tmp_path):
    (tmp_path / "figures.py").write_text(FIGURES)
    line = {"name": "course", "python": "figures.py:line", "arguments": {"signal": "a.y"}}
    file = talker(
        tmp_path, limit=2.0, figures=[line, {"name": "other", "python": "figures.py:broken"}]
    )
    done = run_cosim("run", file, "--json", cwd=tmp_path)
    assert done.returncode == 1
    summary = json.loads(done.stdout)
    assert "do_step failed at t = 2 s: ValueError: too late" in summary["failure"]
    assert (summary["end_time"], "report.html" in summary["files"]) == (2.0, True)
    assert 'the report lacks a figure: figure "other"' in done.stderr
    page = (tmp_path / "runs/talk/report.html").read_text()
    assert page.index("The run failed: a: do_step failed") < page.index("course")


def test_a_crashed_run_has_a_report_with_its_cause(tmp_path):
    file = talker(tmp_path)
    text = (tmp_path / "talker.py").read_text()
    (tmp_path / "talker.py").write_text(
        f"import os\n{text}".replace("return True", "os.kill(os.getpid(), 11)")
    )
    done = run_cosim("run", file, "--json", cwd=tmp_path)
    assert done.returncode == 1
    assert "SIGSEGV" in json.loads(done.stdout)["failure"]
    assert (
        "The run failed: a: do_step failed at t = 0 s"
        in (tmp_path / "runs/talk/report.html").read_text()
    )


def test_data_of_all_commands_is_printed_as_json(tmp_path):
    scenario, fmu = talker(tmp_path), ROOT / "fmus/mixer.fmu"
    (tmp_path / "a.csv").write_text("time,y\n0,1\n1,2\n")
    checked = json.loads(run_cosim("check", scenario, "--json").stdout)
    assert (checked["steps"], checked["signals"], checked["stages"]) == (3, ["a.y"], [["a"]])
    described = json.loads(run_cosim("info", fmu, "--json").stdout)
    assert described["properties"]["model"] == "mixer"
    assert {"name", "unit", "causality", "start"} <= set(described["variables"][0])
    assert set(json.loads(run_cosim("simulate", fmu, "--json").stdout)) == {"time", "values"}
    compared = json.loads(
        run_cosim("compare", tmp_path / "a.csv", tmp_path / "a.csv", "--json").stdout
    )
    assert (compared["passed"], compared["signals"][0]["signal"]) == (True, "y")
    regressed = json.loads(run_cosim("regress", scenario, "--json", cwd=tmp_path).stdout)
    assert (regressed["failed"], regressed["scenarios"][0]["summary"]) == (0, "1 check")


def test_every_command_has_quiet_and_verbose():
    for name in COMMANDS:
        words = (name, "controller") if name == "new" else (name,)
        assert "--quiet" in run_cosim(*words, "--help").stdout


def test_list_names_what_is_shipped():
    done = run_cosim("list")
    for text in (
        "demo1_box ",
        "landing_envelope ",
        "ar_drone ",
        "uav_mixer ",
        "cosim.kpis:rms ",
        "kpis.py:landing ",
    ):
        assert text in done.stdout
    listed = json.loads(run_cosim("list", "--json", "scenarios", "kpis").stdout)
    assert [entry["name"] for entry in listed["scenarios"]] == sorted(
        path.stem for path in (ROOT / "scenarios").glob("*.json")
    )
    for found in listed.values():
        assert all(Path(entry["file"]).is_file() and entry["description"] for entry in found)


def test_scenarios_are_listed_in_the_groups_of_their_document():
    """Each scenario is in one group; the document has a heading for each group and a table of its
    scenarios.
    """
    text = run_cosim("list", "scenarios").stdout
    listed = {
        head.lower(): sorted(re.findall(r"^  (\w+)", rows, re.M))
        for head, rows in re.findall(r"^(\w.*):\n((?:  .*\n)+)", text, re.M)
    }
    document = (ROOT / "docs/shipped_scenarios.md").read_text()
    documented = {}
    for head, rows in re.findall(r"^## (.*)\n\n((?:\|.*\n)+)", document, re.M):
        names = "".join(row.split("|")[1] for row in rows.splitlines())
        documented[head.lower()] = sorted(re.findall(r"`(\w+)`", names))
    assert listed == documented
    names = sorted(chain.from_iterable(listed.values()))
    assert names == sorted(path.stem for path in (ROOT / "scenarios").glob("*.json"))


def test_an_fmu_in_place_of_a_scenario_is_explained():
    done = run_cosim("run", "x.fmu")
    message = (
        "x.fmu is an FMU, expected a scenario; `cosim simulate x.fmu` simulates a single FMU\n"
    )
    assert (done.returncode, done.stderr) == (2, message)


def test_a_command_keeps_the_log_handlers_of_the_program_that_calls_it():
    logger, own = logging.getLogger("cosim"), logging.NullHandler()
    level = logger.level
    logger.addHandler(own)
    try:
        first, second = print_log(), print_log()
        logger.warning("once")
        assert own in logger.handlers
        assert (first, second) == ([], ["WARNING once"])
    finally:
        collect_log()
        logger.handlers.remove(own)
        logger.setLevel(level)
