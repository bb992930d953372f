"""`sweep.html`, its maps and their replays: from `cosim sweep`, as they lie in the folder."""

import re
from html.parser import HTMLParser

import pytest
from lag_project import SEGV_ORDER

from cosim.studies.summary.page import _design_rows
from cosim.studies.sweep import Sweep

#: a run that ends above 0.2 is no success; the last one crashes
STARTS = {"name": "start", "levels": {"low": {"lag.y_start": 1.0}, "high": {"lag.y_start": 3.0}}}
TIMES = {"name": "T", "levels": {"quick": {"lag.T": 0.05}, "never": {"lag.T": 0.5, "lag.fault": SEGV_ORDER}}}
STUDY = {
    "factors": [STARTS, TIMES],
    "settings": {"/record": {"signals": ["lag.y"], "interval": 0.05}},
    "success": [{"kpi": "end.value", "max": 0.2}],
    "maps": [{"x": "T", "y": "start", "titles": {"T": "time constant"}}],
}


class Reader(HTMLParser):
    """Tags, links and words of a page."""

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
    """The folder of a sweep."""
    found = make_lag()
    found.run_command("sweep", found.write(**STUDY), "--workers", 1)
    return found


@pytest.fixture(scope="module")
def results(lag):
    return lag.folder / "runs/sweep"


@pytest.fixture(scope="module")
def page(results):
    return Reader((results / "sweep.html").read_text())


@pytest.fixture(scope="module")
def replayed(lag, page, results):
    """The page after the sweep was called again, for replays, and what that call said."""
    done = lag.run_command("sweep", "sweep.json", "--workers", 1, "--replays")
    return Reader((results / "sweep.html").read_text()), done


def test_figures_lie_beside_the_table(results):
    assert (results / "success_map.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (results / "success_map.svg").read_text()


def test_the_page_asks_nobody_for_anything(page):
    assert "script" not in page.tags
    assert all(link.startswith(("#", "sweep.html#", "data:")) for link in page.links), page.links


def test_a_click_on_a_cell_leads_to_the_command_that_shows_a_run_in_full(lag, page):
    clicks = [link for link in page.links if link.startswith("sweep.html#run-")]
    assert sorted(clicks) == [f"sweep.html#run-{run}" for run in range(4)]
    assert {click.partition("#")[2] for click in clicks} <= page.identifiers
    assert f"cosim run {lag.folder / 'lag.json'} --set" in page.words
    assert "/record" not in page.words
    assert re.search(r"Run 2, the first unsuccessful run in\s+start = high,\s+T = quick", page.words)


def test_rates_causes_and_the_design_stand_there(page):
    assert "✗ 2 of 4 runs failed" in page.words
    assert "SIGSEGV" in page.words
    assert "25.0 %" in page.words
    assert "quick, never" in page.words


def test_with_replays_a_click_opens_one(replayed, results):
    replays = {link for link in replayed[0].links if link.startswith("replays/")}
    assert replays == {f"replays/{path.name}" for path in (results / "replays").iterdir()}
    assert len(replays) == 2


def test_a_replay_shows_all_that_the_scenario_records(replayed, results):
    """11 rows are not 3: the sweep's own `/record` is for the sweep."""
    (link, *_) = [link for link in replayed[0].links if link.startswith("replays/")]
    text = (results / link).read_text()
    assert '"rows":11,' in text
    assert "sweep run 0: start low, T quick" in text


def test_a_run_that_crashes_has_its_command_and_is_named(replayed):
    page, done = replayed
    assert {link for link in page.links if link.startswith("sweep.html#run-")} == {"sweep.html#run-1", "sweep.html#run-3"}
    assert "no replay of run 1: lag: fmi2DoStep failed" in done.err


def test_a_replay_is_made_once(lag, replayed, results):
    before = {path: path.stat().st_mtime_ns for path in (results / "replays").iterdir()}
    lag.run_command("sweep", "sweep.json", "--workers", 1, "--replays")
    assert {path: path.stat().st_mtime_ns for path in (results / "replays").iterdir()} == before


@pytest.mark.parametrize("design", [{"kind": "full_factorial"}, {"kind": "latin_hypercube", "runs": 4}])
def test_of_many_levels_the_ends_are_shown(lag, design):
    normal = {"name": "start", "set": "lag.y_start", "distribution": {"kind": "normal", "mean": 0, "std": 1, "count": 24}}
    sweep = Sweep.from_file(lag.write("many", factors=[normal], design=design))
    levels = [point.labels["start"] for point in sweep.design]
    assert dict(_design_rows(sweep))["start"] == f"{min(levels):.4g} ... {max(levels):.4g}"
