"""The page `report.html`: its contents, and the commands that write it."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from cosim.cli.commands.finished_runs import replay, report
from cosim.cli.commands.run import command as run
from cosim.core import resources
from cosim.core.errors import InputError
from cosim.core.recording import Recording
from cosim.report import pages
from cosim.report.replay import find_failure, replay_data
from cosim.report.run_page import write_report
from cosim.results import Result, write_run
from cosim.results.checks import CheckOutcome
from cosim.scenario import load


class Reader(HTMLParser):
    """Tags, and the text of each element that is no script or style."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.texts, self.links, self._open = [], [], [], []
        self.feed(text.replace("<wbr>", ""))

    def handle_starttag(self, tag, attributes):
        self.tags.append(tag)
        self._open.append(tag)
        self.links += [
            value
            for key, value in attributes
            if key in ("src", "href", "xlink:href") and not value.startswith("#")
        ]

    def handle_data(self, data):
        if data.strip() and self._open[-1:] not in (["script"], ["style"]):
            self.texts.append(data.strip())


def invoke(command, *words):
    return CliRunner().invoke(command, [str(word) for word in words])


@pytest.fixture(scope="module")
def directory(tmp_path_factory):
    """Return the output directory of `cosim run` for the shipped Demo 1."""
    folder = tmp_path_factory.mktemp("demo1")
    done = invoke(run, "demo1_box", "--isolation", "none", "--output-dir", folder)
    assert done.exit_code == 0, done.output
    return folder


@pytest.fixture(scope="module")
def page(directory):
    return Reader((directory / "report.html").read_text())


def test_the_page_has_the_kpis_with_units_and_checks(page, directory):
    kpis = json.loads((directory / "kpis.json").read_text())
    assert "✓ 5 of 5 checks passed" in page.texts
    assert {name.partition(".")[2] for name in kpis} <= set(page.texts)
    card = page.texts.index("landing.lateral_error")
    assert page.texts[card + 1 : card + 4] == [
        f"{kpis['landing.lateral_error']:.4g}",
        "m",
        "✓ max 0.1",
    ]


def test_the_reasons_of_failed_checks_are_at_the_top(tmp_path):
    recording = Recording(np.array([0.0, 1.0]), {"a.y": np.zeros(2)}, {})
    reason = "landing.lateral_error: plant.uav never took off"
    outcome = CheckOutcome({"kpi": "landing.lateral_error", "max": 0.1}, float("nan"), False)
    write_report(
        Result(recording, metadata={"check_notes": [reason], "kpi_notes": [reason]}),
        [outcome],
        [],
        tmp_path / "r.html",
    )
    texts = Reader((tmp_path / "r.html").read_text()).texts
    verdict = texts.index("✗ 0 of 1 check passed")
    assert texts[verdict + 1 : verdict + 3] == [reason, "run"]


def test_the_page_has_system_versions_timings_and_scenario(page):
    assert {"plant.uav.position.x", "uav.vtol.vehicle.position.x", "rad/s", "stepping loop"} <= set(
        page.texts
    )
    assert {"pybullet", "pybullet-arm64"} & set(
        page.texts
    )  # the second one has wheels for Python 3.12 and later
    assert any('"stop_time": 40.0' in text for text in page.texts)
    assert page.tags.count("svg") >= 4  # two figures, the diagram, icons


def test_it_is_one_file_of_at_most_3_megabytes_that_loads_nothing(page, directory):
    assert (directory / "report.html").stat().st_size <= 3_000_000
    assert [link for link in page.links if not link.startswith("data:")] == []


def test_cosim_report_writes_the_same_page_again(directory, tmp_path):
    done = invoke(report, directory, "--output-file", tmp_path / "again.html")
    assert done.exit_code == 0, done.output
    first, again = ((directory / "report.html").read_text(), (tmp_path / "again.html").read_text())
    assert _without_data(again) == _without_data(first)


def _without_data(text):
    """Booleans come back from CSV as numbers, so the packed signals may differ in their last bits
    of compression.
    """
    return re.sub(r'"samples":"[^"]*"', "", text)


def test_the_replay_of_two_runs_is_written_beside_the_first(directory):
    done = invoke(replay, directory, directory)
    assert done.output.strip() == str(directory / "replay.html")
    data = re.search(
        r'id="replay-data">(.*?)</script>', (directory / "replay.html").read_text(), re.S
    ).group(1)
    assert [one["name"] for one in json.loads(data)["runs"]] == ["demo1_box", "demo1_box"]


def test_failed_checks_are_at_the_top(flight_result, tmp_path):
    write_run(flight_result, tmp_path)
    assert invoke(report, tmp_path).exit_code == 0
    texts = Reader((tmp_path / "report.html").read_text()).texts
    assert texts[1] == "✗ 4 of 5 checks passed"
    assert "✗ failed: equals true" in texts
    assert (
        "The replay opens at t = 14 s. Mark × at t = 16 s: end of the run, check of "
        "waypoints.all_reached failed."
    ) in texts


@pytest.mark.parametrize(
    ("metadata", "failure"),
    [
        ({"failure": "uav: do_step failed at t = 16 s"}, (16.0, "failure", 14.0)),
        (
            {"terminated_by": {"time": 16.0, "outcome": "crash", "since": 15.5}},
            (15.5, "crash", 13.5),
        ),
        ({}, (11.0, "check of landing.lateral_error failed", 9.0)),
    ],
)
def test_the_moment_of_a_failure_depends_on_its_kind(flight_result, metadata, failure):
    """The landing of which the touchdown counts failed, unless the run ended early."""
    result = replace(flight_result, metadata=metadata, kpis={"landing.time": 11.0})
    outcomes = [CheckOutcome({"kpi": "landing.lateral_error", "max": 0.1}, 0.2, passed=False)]
    assert find_failure(result, outcomes) == failure
    assert find_failure(replace(result, metadata={}), []) is None


@pytest.mark.parametrize(
    ("function", "arguments", "time"),
    [
        ("peak", {"signal": "x", "target": 1.0}, 3.0),
        ("minimum", {"signal": "x"}, 3.0),
        ("maximum", {"signal": "x"}, 1.0),
        ("peak", {"signal": "x", "start": 2.0, "stop": 2.0}, 2.0),
        ("rms", {"signal": "x"}, 4.0),
    ],
)
def test_a_failed_check_of_an_extreme_marks_the_row_of_the_extreme(function, arguments, time):
    """Values without a time are marked at the end of the run."""
    recording = Recording(np.arange(5.0), {"x": np.array([0.0, 5.0, 1.0, -4.0, 2.0])}, {"x": "m"})
    kpi = {"name": "k", "python": f"cosim.kpis:{function}", "arguments": arguments}
    result = Result(recording, {"k.value": 9.0}, metadata={"scenario": {"kpis": [kpi]}})
    failure = find_failure(
        result, [CheckOutcome({"kpi": "k.value", "max": 1.0}, 9.0, passed=False)]
    )
    end = "end of the run, " if function == "rms" else ""
    assert (failure.time, failure.label) == (time, f"{end}check of k.value failed")


def short_run(folder):
    words = ("--stop-time", "0.1", "--isolation", "none", "--no-report")
    return invoke(run, "demo1_box", *words, "--output-dir", folder)


def test_the_option_no_report_writes_no_page_and_removes_old_ones(tmp_path):
    for name in ("report.html", "replay.html"):
        (tmp_path / name).write_text("old")
    assert short_run(tmp_path).exception is None
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "kpis.json",
        "result.csv",
        "run.json",
    ]


def test_replacing_the_results_of_another_scenario_causes_a_warning(tmp_path):
    """A copy, whose name is still that of the first one."""
    copy = tmp_path / "mine.json"
    shipped = resources.root() / "scenarios/free_flight.json"
    copy.write_text(shipped.read_text().replace('"../', f'"{resources.root()}/'))
    words = (
        "--stop-time",
        "9",
        "--isolation",
        "none",
        "--no-report",
        "--output-dir",
        tmp_path / "out",
    )
    said = [invoke(run, file, *words).stderr for file in ("free_flight", "free_flight", copy)]
    text = (
        f'replaces the results of {shipped} in {tmp_path / "out"}; another "name" in the scenario '
        "or --output-dir keeps both\n"
    )
    assert said[0] == said[1] == ""
    assert said[2] == text


def test_a_folder_without_a_run_is_refused(tmp_path):
    for command in (report, replay):
        assert isinstance(invoke(command, tmp_path).exception, InputError)


def test_data_in_a_page_cannot_close_its_script_element():
    text = pages.embed_json({"name": "</script><!--<script>", "missing": float("nan")})
    assert "<" not in text
    assert json.loads(text) == {"name": "</script><!--<script>", "missing": None}


def test_the_page_shows_warnings_of_components(tmp_path):
    (tmp_path / "loud.py").write_text(LOUD)
    components = {"loud": {"python": "loud.py:Loud"}}
    scenario = {"name": "loud", "stop_time": 0.02, "step_size": 0.01, "components": components}
    (tmp_path / "loud.json").write_text(json.dumps(scenario))
    done = invoke(
        run, tmp_path / "loud.json", "--isolation", "none", "--output-dir", tmp_path / "out"
    )
    assert done.exit_code == 0, done.output
    texts = Reader((tmp_path / "out/report.html").read_text()).texts
    assert "WARNING loud: rotor <3> hot" in texts


def test_a_run_without_a_scene_shows_its_changing_signals(tmp_path):
    """Plots instead of an empty page, and the command says that there is no 3-D view."""
    columns = {
        "a.x": np.array([0.0, 1.0]),
        "a.still": np.zeros(2),
        "a.v": np.array([2.0, 1.0]),
        "b.x": np.array([3.0, 1.0]),
    }
    units = {"a.x": "m", "a.still": "m", "a.v": "m/s", "b.x": "m"}
    write_run(
        Result(Recording(np.array([0.0, 1.0]), columns, units), metadata={"name": "numbers"}),
        tmp_path,
    )
    done = invoke(replay, tmp_path)
    assert done.exit_code == 0
    assert "the page shows only signals and no 3-D view" in done.stderr
    data = re.search(
        r'id="replay-data">(.*?)</script>', (tmp_path / "replay.html").read_text(), re.S
    ).group(1)
    assert json.loads(data)["scene"]["plots"] == [["a.x", "b.x"], ["a.v"]]


def test_plots_of_checked_signals_come_first(flight_result):
    """The KPI of the yaw angle is checked, that of the rotor speed is not. The scene has a plot of
    the yaw angle, too.
    """
    yaw, speed = "plant.usv.attitude.yaw", "plant.uav.rotor_speed[1]"
    kpis = [
        {"name": name, "python": "cosim.kpis:final", "arguments": {"signal": signal}}
        for name, signal in (("turn", yaw), ("rotor", speed))
    ]
    scenario = {
        **flight_result.metadata["scenario"],
        "kpis": kpis,
        "checks": [{"kpi": "turn.value", "max": 1}],
    }
    result = replace(flight_result, metadata={**flight_result.metadata, "scenario": scenario})
    plots = replay_data([result])["scene"]["plots"]
    assert plots[0] == [yaw]
    assert plots.count([yaw]) == 1
    assert len(plots) == len(replay_data([flight_result])["scene"]["plots"])


LOUD = """
from pythonfmu import Fmi2Causality, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Status


class Loud(Fmi2Slave):
    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.y = 0.0
        self.register_variable(Real("y", causality=Fmi2Causality.output))

    def do_step(self, time, step_size):
        if time == 0:
            self.log("rotor <3> hot", Fmi2Status.warning)
        return True
"""


def test_run_json_contains_units_and_connections(directory):
    about = json.loads((directory / "run.json").read_text())
    assert about["units"]["plant.uav.velocity.x"] == "m/s"
    assembly = load("demo1_box")
    assembly.free()
    assert len(about["system"]["connections"]) == len(assembly.system.connections)
    assert {one["name"] for one in about["system"]["components"]} == set(assembly.system.components)


def test_a_page_shows_no_folder_of_this_machine(flight_result, tmp_path, monkeypatch):
    """Paths below the working directory are relative, others are file names; JSON paths and
    addresses stay.
    """
    monkeypatch.chdir(tmp_path)
    texts = [
        f"{tmp_path}/own/pilot.fmu is late",
        "/components/uav: see https://example.org/a/b",
        f"in {Path(__file__)}",
    ]
    metadata = {
        **flight_result.metadata,
        "warnings": texts,
        "sha256": {"../../../../home/person/pilot.py": "12ab"},
    }
    write_report(replace(flight_result, metadata=metadata), [], [], tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text()
    assert "<li>own/pilot.fmu is late</li>" in page
    assert f"<li>{texts[1]}</li>" in page
    assert f"<li>in {Path(__file__).name}</li>" in page
    assert '<td class="name">pilot.py</td>' in page
    assert str(tmp_path) not in page
    assert str(Path(__file__).parents[2]) not in page
