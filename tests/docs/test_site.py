"""The documentation site is built without warnings, is complete, and needs no network.

The build takes about 10 s of processor time, so `.ci/run` runs these tests apart from the suite,
which it runs twice.
"""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from page_probes import LOW_CONTRAST

from cosim.cli import COMMANDS
from cosim.scenario import json_schema

pytestmark = pytest.mark.long

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    pytest.importorskip("mkdocs")
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "--quiet",
        "--site-dir",
        str(folder),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def text_of(page):
    return re.sub(r"<[^>]*>", "", page.read_text())


def test_the_reference_is_complete(site):
    reference = site / "docs/reference"
    commands = (reference / "commands.html").read_text()
    assert all(f'id="cosim-{name}"' in commands for name in COMMANDS)
    keys = text_of(reference / "scenario_keys.html")
    schemas = [json_schema(), json_schema(nested=True)]
    parts = [*schemas, *schemas[0]["$defs"].values(), *schemas[1]["$defs"].values()]
    for part in parts:
        assert all(key in keys for key in part["properties"])
    assert "landing_waves" in text_of(reference / "scenarios.html")
    assert "vessel_autopilot" in text_of(reference / "roles.html")
    assert "rotor_speed[1]" in text_of(reference / "variables.html")
    assert "touchdown_speed" in text_of(reference / "kpis.html")
    assert "cosim.run" in text_of(reference / "python.html")


def test_no_page_shows_the_markdown_of_a_block(site):
    assert [page for page in site.rglob("*.html") if "```" in page.read_text()] == []


def test_the_page_of_a_wrong_address_has_its_style_as_a_file(site, chromium):
    page = chromium.new_page()
    page.goto((site / "404.html").as_uri())
    assert (
        page.evaluate("getComputedStyle(document.querySelector('.md-header')).position") == "sticky"
    )
    page.get_by_role("link", name="Tutorials").click()
    assert page.url == (site / "docs/tutorials/landing.html").as_uri()
    page.close()


def test_pages_are_read_and_searched_as_files_without_a_network(site, chromium):
    """The browser has no network and opens no other address than files."""
    for page in site.rglob("*.html"):
        assert not re.search(
            r'<(script|link|img)[^>]*(src|href)="?(https?:)?//', page.read_text()
        ), page
    context = chromium.new_context(offline=True, viewport={"width": 1300, "height": 700})
    page, requests = context.new_page(), []
    page.on("request", lambda request: requests.append(request.url))
    page.goto((site / "index.html").as_uri())
    page.click("input[name=query]")
    page.keyboard.type("waypoint_count", delay=20)
    page.wait_for_function(
        "document.querySelector('.md-search-result__meta').innerText.includes('matching')"
    )
    assert page.locator(".md-search-result__link").count() > 0
    assert {url.partition(":")[0] for url in requests} <= {"file", "data", "blob"}


#: a page of each kind
SAMPLES = (
    "index",
    "docs/tutorials/own_boat",
    "docs/how_to/swap_controller",
    "docs/reference/python",
    "docs/controllers",
)
SAMPLES += (
    "docs/reference/kpis",
    "docs/reference/world_keys",
    "docs/reference/roles",
    "docs/validation",
)

CUT_TABLES = (
    "[...document.querySelectorAll('.md-typeset__scrollwrap')].filter((one) => one.scrollWidth > "
    "one.clientWidth).length"
)
#: titles and names in tables of which a word stands on two lines
BROKEN_TITLES = """[...document.querySelectorAll(
  "h1, h2, h3, table:not([data-stacked]) td:first-child code"
)].filter((title) => {
  const texts = document.createTreeWalker(title, NodeFilter.SHOW_TEXT);
  while (texts.nextNode()) for (const word of texts.currentNode.data.matchAll(/[A-Za-z0-9]+/g)) {
    const range = document.createRange();
    range.setStart(texts.currentNode, word.index);
    range.setEnd(texts.currentNode, word.index + word[0].length);
    const tops = [...range.getClientRects()].map((box) => Math.round(box.top));
    if (new Set(tops).size > 1) return true;
  }
}).map((title) => title.innerText)"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_fit_a_phone_and_are_legible(site, chromium, scheme):
    context = chromium.new_context(
        offline=True, color_scheme=scheme, viewport={"width": 360, "height": 740}
    )
    page, complaints = context.new_page(), []
    page.on("console", lambda said: complaints.append(said.text) if said.type == "error" else None)
    for name in SAMPLES:
        page.goto((site / f"{name}.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") == 360, name
        assert page.evaluate(CUT_TABLES) == 0, name
        assert page.evaluate(BROKEN_TITLES) == [], name
        assert page.evaluate(LOW_CONTRAST) == [], name
    assert complaints == []
    context.close()
