"""`sweep.html`, its maps and their replays, as `cosim sweep` writes them."""

import csv
import io
import json
import re
import shlex
from html.parser import HTMLParser

import pytest
from cosim_command import run_cosim
from lag_project import SEGV_ORDER
from page_probes import LOW_CONTRAST

from cosim.core import resources
from cosim.studies.summary.page import _design_rows
from cosim.studies.summary.unsuccessful_runs import format_run_command
from cosim.studies.sweep import Sweep

#: a run that ends above 0.2 is unsuccessful; the last one crashes
STARTS = {"name": "start", "levels": {"low": {"lag.y_start": 1.0}, "high": {"lag.y_start": 3.0}}}
TIMES = {
    "name": "T",
    "levels": {"quick": {"lag.T": 0.05}, "never": {"lag.T": 0.5, "lag.fault": SEGV_ORDER}},
}
STUDY = {
    "factors": [STARTS, TIMES],
    "settings": {"/record": {"signals": ["lag.y"], "interval": 0.05}},
    "success": [{"kpi": "end.value", "max": 0.2}],
    "maps": [{"x": "T", "y": "start", "titles": {"T": "time constant"}}],
}


class Reader(HTMLParser):
    """Parser that collects tags, links, identifiers and text of a page."""

    def __init__(self, text):
        super().__init__()
        self.tags, self.links, self.identifiers, self.words = set(), [], set(), ""
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        self.tags.add(tag)
        self.links += [value for key, value in attributes if key in ("href", "src", "xlink:href")]
        self.identifiers |= {value for key, value in attributes if key == "id"}

    def handle_data(self, data):
        self.words += data


@pytest.fixture(scope="module")
def lag(make_lag):
    """Project after a sweep; `swept` is what the command printed."""
    found = make_lag()
    found.swept = found.run_command("sweep", found.write(**STUDY), "--workers", 1)
    return found


@pytest.fixture(scope="module")
def results(lag):
    return lag.folder / "runs/sweep"


@pytest.fixture(scope="module")
def page(results):
    return Reader((results / "sweep.html").read_text())


@pytest.fixture(scope="module")
def replayed(lag, page, results):
    """Page and output of a second call of the sweep, with replays."""
    assert page.tags  # the page without replays is read before the second call replaces it
    done = lag.run_command("sweep", "sweep.json", "--workers", 1, "--replays")
    return Reader((results / "sweep.html").read_text()), done


def test_maps_are_written_as_png_and_svg(results):
    assert (results / "success_map.png").read_bytes().startswith(b"\x89PNG")
    assert 'href="sweep.html#run-0"' in (results / "success_map.svg").read_text()


def test_the_page_has_no_external_links(page):
    assert all(link.startswith(("#", "data:")) for link in page.links), page.links


def test_a_phone_shows_names_on_one_line_and_scrolls_only_tables_and_maps(chromium, page, results):
    assert page.tags  # before the second call replaces the page
    context = chromium.new_context(viewport={"width": 360, "height": 740})
    opened = context.new_page()
    opened.goto((results / "sweep.html").as_uri())
    assert opened.evaluate("document.documentElement.scrollWidth") == 360
    assert (
        max(
            opened.evaluate(
                "[...document.querySelectorAll('.scroll td.name')].map((cell) => cell.clientHeight)"
            )
        )
        < 50
    )
    assert opened.evaluate(LOW_CONTRAST) == []
    opened.locator("[data-toggle-theme]").click()
    assert opened.evaluate("document.documentElement.dataset.theme") == "dark"
    assert opened.evaluate(LOW_CONTRAST) == []
    figure = "(figure) => figure.scrollWidth - figure.clientWidth"
    assert (
        opened.locator(".figures figure").first.evaluate(figure) <= 0
    )  # a map of few cells is not cut
    assert opened.evaluate(
        "[...document.querySelectorAll('.stacked')].every((part) => part.scrollWidth <= "
        "part.clientWidth)"
    )
    heights = (
        "[...document.querySelectorAll('.figures g[id^=text]')].map((text) => "
        "text.getBoundingClientRect().height)"
    )
    assert min(opened.evaluate(heights)) > 5  # px, without the descent: letters of at least 8 px
    context.close()


def test_cells_link_to_the_command_that_repeats_a_run(page):
    clicks = [link for link in page.links if link.startswith("#run-")]
    assert sorted(clicks) == [f"#run-{run}" for run in range(4)]
    assert {click.partition("#")[2] for click in clicks} <= page.identifiers
    assert "cosim run lag.json --set" in page.words  # in the folder of the sweep command
    assert "/record" not in page.words
    assert re.search(
        r"Run 2, the first unsuccessful run in\s+start = high,\s+T = quick", page.words
    )


def test_page_terminal_and_table_name_the_criterion_that_a_run_misses(lag, page, results):
    (row,) = csv.DictReader((results / "unsuccessful.csv").open())
    assert (row["run"], row["start"], row["T"]) == ("2", "high", "quick")
    value = float(next(csv.DictReader(io.StringIO("".join(table_lines(results, 2)))))["end.value"])
    assert row["missed"] == f"end.value is {value:.6g}, expected at most 0.2"
    assert f"T = quick. {row['missed']}. This command makes it again" in " ".join(
        page.words.split()
    )  # the cell of the map
    assert f"Run 2, start = high, T = quick: {row['missed']}" in page.words  # the list
    assert (
        f"end.value max 0.2: missed by 1 of 4 runs; the first is run 2:\n  {row['command']}\n"
        in lag.swept.out
    )
    again = run_cosim(*shlex.split(row["command"])[1:], cwd=lag.folder)
    assert json.loads((lag.folder / "runs/lag/kpis.json").read_text())["end.value"] == value, (
        again.stderr
    )


def table_lines(results, run):
    """Return the header of table.csv and the line of a run."""
    header, *lines = (results / "table.csv").read_text().splitlines(keepends=True)
    return [header, lines[run]]


def test_commands_name_shipped_scenarios_in_place_of_their_paths(tmp_path):
    shipped, own = resources.root() / "scenarios/demo1_box.json", tmp_path / "demo1_box.json"
    assert (
        format_run_command(shipped, {"uav.altitude_command": 3.0})
        == "cosim run demo1_box --set uav.altitude_command=3.0"
    )
    assert format_run_command(own, {}) == f"cosim run {own}"


def test_paths_in_commands_start_from_the_working_directory_or_name_shipped_files(
    tmp_path, monkeypatch
):
    (tmp_path / "work").mkdir()
    monkeypatch.chdir(tmp_path / "work")
    shipped, own = resources.root() / "scenarios/demo1_box.json", tmp_path / "scenarios/own.json"
    level = {
        "/components/uav": {
            "system": "systems/uav.json",
            "parameters": {"file": "systems/uav.json"},
        }
    }
    moved = '{"system": "%s", "parameters": {"file": "systems/uav.json"}}'
    assert (
        shlex.split(format_run_command(shipped, level))[-1]
        == "/components/uav=" + moved % "cosim:scenarios/systems/uav.json"
    )
    assert (
        shlex.split(format_run_command(own, level))[-1]
        == "/components/uav=" + moved % "../scenarios/systems/uav.json"
    )
    one = shlex.split(
        format_run_command(shipped, {"/components/uav/fmu": "../fmus/ar_drone_indi.fmu"})
    )
    assert one[-1] == "/components/uav/fmu=cosim:fmus/ar_drone_indi.fmu"


def test_the_page_shows_success_rates_failures_and_the_design(page):
    assert "✗ 2 of 4 runs failed" in page.words
    assert "SIGSEGV" in page.words
    assert "25.0 %" in page.words
    assert "quick, never" in page.words


def test_cells_link_to_replays_when_there_are_any(replayed, results):
    replays = {link for link in replayed[0].links if link.startswith("replays/")}
    assert replays == {f"replays/{path.name}" for path in (results / "replays").iterdir()}
    assert len(replays) == 2


def test_a_replay_shows_all_signals_that_the_scenario_records(replayed, results):
    """A replay has all 11 rows, not the 3 that `/record` of the sweep selects."""
    (link, *_) = [link for link in replayed[0].links if link.startswith("replays/")]
    text = (results / link).read_text()
    assert '"rows":11,' in text
    assert "sweep run 0: start low, T quick" in text


@pytest.mark.usefixtures("replayed")
def test_a_replay_names_the_criterion_that_the_run_misses_and_opens_before_the_failure(results):
    (row,) = csv.DictReader((results / "unsuccessful.csv").open())
    good, bad = (
        next((results / "replays").glob(f"{key}-*")).read_text() for key in run_keys(results)
    )
    assert "<p>Successful.</p>" in good
    sentence = (
        "The replay opens at t = 0 s. Mark × at t = 0.1 s: end of the run, check of end.value "
        "failed."
    )
    assert f"<p>Not successful: {row['missed']}. {sentence}</p>" in bad
    assert '"failure":{"time":0.1,' in bad.replace(" ", "")


@pytest.mark.usefixtures("replayed")
def test_a_phone_shows_the_whole_reason_above_the_replay(chromium, results):
    (row,) = csv.DictReader((results / "unsuccessful.csv").open())
    bad = next((results / "replays").glob(f"{run_keys(results)[1]}-*"))
    context = chromium.new_context(
        viewport={"width": 360, "height": 740}, java_script_enabled=False
    )
    opened = context.new_page()
    opened.goto(bad.as_uri())
    reason = opened.get_by_text(row["missed"]).bounding_box()
    assert reason["width"] > 300
    assert reason["height"] < 120
    context.close()


def run_keys(results):
    """Return the keys of the runs 0 and 2, which have replays."""
    lines = [json.loads(line) for line in (results / "journal.jsonl").read_text().splitlines()]
    good, bad = sorted(
        (line for line in lines if "failure" not in line),
        key=lambda line: line["kpis"]["end.value"],
    )
    return good["key"], bad["key"]


def test_a_crashing_run_is_reported_and_keeps_its_command(replayed):
    page, done = replayed
    assert {link for link in page.links if link.startswith("#run-")} == {"#run-1", "#run-3"}
    assert "no replay of run 1: lag: fmi2DoStep failed" in done.err


@pytest.mark.usefixtures("replayed")
def test_a_replay_is_written_only_once(lag, results):
    before = {path: path.stat().st_mtime_ns for path in (results / "replays").iterdir()}
    lag.run_command("sweep", "sweep.json", "--workers", 1, "--replays")
    assert {path: path.stat().st_mtime_ns for path in (results / "replays").iterdir()} == before


@pytest.mark.parametrize(
    "design", [{"kind": "full_factorial"}, {"kind": "latin_hypercube", "runs": 4}]
)
def test_many_levels_are_shown_by_the_lowest_and_the_highest(lag, design):
    normal = {
        "name": "start",
        "set": "lag.y_start",
        "distribution": {"kind": "normal", "mean": 0, "std": 1, "count": 24},
    }
    sweep = Sweep.from_file(lag.write("many", factors=[normal], design=design))
    levels = [point.labels["start"] for point in sweep.design]
    assert dict(_design_rows(sweep))["start"] == f"{min(levels):.4g} ... {max(levels):.4g}"
