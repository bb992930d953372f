"""`cosim regress` on small scenarios with a cooling body, its reference and its checks."""

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from cosim_command import run_cosim
from lxml import etree

from cosim.cli.commands import regress as regress_command
from cosim.studies import regression
from cosim.studies.regression import RegressionOutcome

COOLING = """
import os
import signal

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class Body(Fmi2Slave):
    def __init__(self, **arguments):
        super().__init__(**arguments)
        self.rate, self.temperature = 0.5, 80.0
        tunable = {"causality": Fmi2Causality.parameter, "variability": Fmi2Variability.tunable}
        self.register_variable(Real("rate", **tunable))
        self.register_variable(Real("temperature", causality=Fmi2Causality.output))

    def do_step(self, current_time, step_size):
        if self.rate > 1000:
            os.kill(os.getppid(), signal.SIGKILL)
        if self.rate > 90:
            raise ValueError("no body cools that fast")
        self.temperature -= self.rate * step_size * self.temperature
        return True


def last(result, signal):
    return {"value": float(result[signal][-1])}
"""
REFERENCE = {"file": "references/cooling.csv", "tolerances": {"body.*": {"absolute": 0.1}}}
CHECK = {
    "kpis": [
        {"name": "end", "python": "cooling.py:last", "arguments": {"signal": "body.temperature"}}
    ],
    "checks": [{"kpi": "end.value", "max": 10}],
}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "scenarios").mkdir()
    (tmp_path / "scenarios/cooling.py").write_text(COOLING)
    return tmp_path


def scenario(folder, name="cooling", rate=0.5, **more):
    body = {"python": "cooling.py:Body", "parameters": {"rate": rate}}
    content = {
        "name": name,
        "stop_time": 5,
        "step_size": 0.01,
        "components": {"body": body},
        **more,
    }
    (folder / f"scenarios/{name}.json").write_text(json.dumps(content))


def regress(folder, *arguments):
    return run_cosim("regress", *arguments, cwd=folder)


def test_a_reference_is_written_and_met(folder):
    scenario(folder, reference=REFERENCE)
    updated = regress(folder, "--update")
    assert updated.returncode == 0, updated.stdout + updated.stderr
    assert "1 signal, " in updated.stdout
    assert json.loads((folder / "scenarios/references/cooling.json").read_text())["versions"][
        "numpy"
    ]
    again = regress(folder)
    assert (again.returncode, again.stdout.splitlines()[-1]) == (0, "1 scenario, all passed")
    assert (
        "1 signal (25% of the tolerances)" in again.stdout
    )  # the deviation of the decimated reference


def test_a_changed_result_fails_with_signal_time_and_changes(folder):
    scenario(folder, reference=REFERENCE)
    assert regress(folder, "--update").returncode == 0
    scenario(folder, rate=0.55, reference=REFERENCE)
    done = regress(folder, "--junit", "out/junit.xml")
    assert done.returncode == 3
    assert "body.temperature leaves its tube at t = 0.0" in done.stdout
    assert "changed since the reference was made: scenarios/cooling.json\n" in done.stdout
    assert "        tube: the reference plus and minus its tolerances" in done.stdout
    command = "cosim regress --update scenarios/cooling.json"
    assert (
        done.stdout.splitlines()[-1]
        == f"if the change is meant, make this run the reference: {command}"
    )
    assert (folder / "runs/cooling/tubes.png").stat().st_size > 10_000
    assert f"see {Path('runs/cooling/report.html')}\n" in done.stdout
    page = (folder / "runs/cooling/report.html").read_text()
    assert "comparison" in re.findall(r"<figcaption>(.*?)</figcaption>", page)
    assert (
        '<p class="verdict bad">✗ Comparison with the reference: 1 of 1 signal failed</p>' in page
    )
    assert "<li>Changed since the reference was made: scenarios/cooling.json</li>" in page
    assert f"<li>If the change is meant, make this run the reference: {command}</li>" in page
    suite = etree.parse(folder / "out/junit.xml").getroot().find("testsuite")
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("1", "1", "0")
    assert "leaves its tube" in suite.find("testcase[@name='cooling']/failure").text
    scenario(folder, rate=0.1, reference=REFERENCE, **CHECK)
    assert regress(folder).returncode == 3
    page = (folder / "runs/cooling/report.html").read_text()
    assert "✗ Comparison with the reference: 1 of 1 signal failed; 1 of 1 check failed</p>" in page
    scenario(folder, reference=REFERENCE)
    assert regress(folder).returncode == 0
    assert not (folder / "runs/cooling/tubes.png").exists()


def test_a_run_that_is_longer_than_its_reference_says_so(folder):
    scenario(folder, reference=REFERENCE)
    assert regress(folder, "--update").returncode == 0
    scenario(folder, reference=REFERENCE, stop_time=6)
    done = regress(folder)
    assert (
        done.returncode,
        "1 signal (25% of the tolerances; the reference ends at 5 s)" in done.stdout,
    ) == (0, True)
    scenario(
        folder,
        reference=REFERENCE,
        stop_time=6,
        kpis=CHECK["kpis"],
        checks=[{"kpi": "end.value", "max": 1}],
        rate=0.6,
    )
    assert regress(folder).returncode == 3
    page = (folder / "runs/cooling/report.html").read_text()
    assert ("Changed since" in page, "If the change is meant" in page) == (True, False)


def test_every_scenario_of_a_folder_is_reported(folder):
    scenario(folder, name="aimless")
    melted = {"name": "melted", "when": "body.temperature < 60", "outcome": "crash"}
    scenario(folder, name="cold", stop_when=[melted], **CHECK)
    scenario(folder, name="crashing", rate=99, **CHECK)
    scenario(folder, name="good", rate=0.9, **CHECK)
    scenario(folder, name="warm", rate=0.1, **CHECK)
    done = regress(folder, "scenarios", "--junit", "junit.xml")
    assert done.returncode == 1
    assert [line.split()[:2] for line in done.stdout.splitlines() if line[0] != " "] == [
        ["FAILED", "cold"],
        ["FAILED", "crashing"],
        ["passed", "good"],
        ["FAILED", "warm"],
        ["4", "scenarios,"],
    ]
    assert done.stdout.count("crashed at t = ") == 1
    assert "body: do_step failed at t = 0 s: ValueError: no body cools that fast" in done.stdout
    assert "end.value is 48.5" in done.stdout
    cases = etree.parse(folder / "junit.xml").getroot().findall("testsuite/testcase")
    outcomes = {}
    for case in cases:
        outcomes[case.get("name")] = [part.tag for part in case]
    assert outcomes == {
        "cold": ["failure"],
        "crashing": ["error"],
        "good": [],
        "warm": ["failure"],
    }


def test_a_killed_run_fails(folder):
    scenario(folder, name="good", rate=0.9, **CHECK)
    scenario(folder, name="killed", rate=1001, **CHECK)
    done = regress(folder)
    assert (done.returncode, "cosim run: ended by signal 9" in done.stdout) == (1, True)


def test_a_failed_run_does_not_become_a_reference(folder):
    scenario(folder, rate=0.1, reference=REFERENCE, **CHECK)
    done = regress(folder, "--update")
    assert (done.returncode, "a failed run becomes no reference" in done.stdout) == (3, True)
    assert not (folder / "scenarios/references").exists()


def test_a_missing_reference_is_reported_with_a_hint(folder):
    scenario(folder, reference=REFERENCE)
    done = regress(folder, "scenarios/cooling.json")
    assert done.returncode == 2
    assert 'cooling.csv" does not exist: `cosim regress --update` writes it' in done.stdout


def test_a_folder_without_scenarios_is_told_that_the_shipped_ones_are_run(folder, monkeypatch):
    """With the outcome of one of them, because all of them take long."""
    monkeypatch.chdir(folder / "scenarios")
    outcome = RegressionOutcome("demo1_box", 0, "5 checks")
    monkeypatch.setattr(
        regression,
        "run_regressions",
        lambda folders, *_: [outcome] if folders[0].is_absolute() else [],
    )
    assert (
        "no folder scenarios/ here: the shipped scenarios are run\n"
        in CliRunner().invoke(regress_command.regress).stderr
    )


def test_missing_and_unreadable_scenarios_are_refused(folder):
    scenario(folder, name="aimless")
    assert regress(folder).returncode == 2
    assert 'no shipped scenario "colling"' in regress(folder, "colling").stderr
    (folder / "free_flight").mkdir()
    assert (
        '"free_flight" is a folder here and a shipped scenario: write '
        in regress(folder, "free_flight").stderr
    )
    (folder / "scenarios/aimless.json").write_text("{]")
    assert "aimless.json:1:2:" in regress(folder).stdout
    (folder / "scenarios/aimless.json").write_text("[" * 100_000)
    assert "nested more than 100 levels deep" in regress(folder).stdout


def test_an_fmu_older_than_its_source_in_the_folder_of_controllers_is_named(folder):
    (folder / "controllers").mkdir()
    (folder / "scenarios/cooling.py").rename(folder / "controllers/body.py")
    assert (
        run_cosim(
            "build", "controllers/body.py", "--output", "fmus/body.fmu", cwd=folder
        ).returncode
        == 0
    )
    scenario(folder, components={"body": {"fmu": "../fmus/body.fmu"}}, reference=REFERENCE)
    updated = regress(folder, "--update")
    assert (updated.returncode, "WARNING" in updated.stdout) == (0, False)
    (folder / "controllers/body.py").write_text(COOLING + "# changed")
    done = regress(folder)
    command = "cosim build controllers/body.py --output fmus/body.fmu"
    warning = (
        f'"fmus/body.fmu" was built from another version of controllers/body.py: `{command}` '
        "builds it again"
    )
    assert (done.returncode, done.stdout.splitlines()[1]) == (0, f"        WARNING {warning}")
