"""The report on screens of all sizes: layout, contrast and keyboard."""

from dataclasses import replace

import pytest
from page_probes import LOW_CONTRAST, OVERFLOWING, UNREACHABLE

from cosim.report.run_page import write_report
from cosim.results.checks import evaluate_checks

LONG_NAMES = {
    "components": [
        {"name": name, "origin": origin, "inputs": 1, "outputs": 1, "period": None}
        for name, origin in (
            ("WaveMeasurementMMMM", "models/DeckController.mo:DeckController"),
            ("illinois", "WWWWWWWWWWWWWWWWWWWWWWWW.fmu"),
            ("uav.attitude", "attitude.fmu"),
        )
    ],
    "stages": [["WaveMeasurementMMMM", "illinois", "uav.attitude"]],
    "connections": [],
}

SIZES = ((1280, 800), (768, 1024), (360, 740))


@pytest.fixture(scope="module")
def report(open_page, flight_result, tmp_path_factory):
    """The report of a flight with a failed check, which has the longest label."""
    file = tmp_path_factory.mktemp("report") / "report.html"
    checks = [
        {"kpi": "landing.touchdown_speed", "min": 0.123456, "max": 0.234567},
        {"kpi": "waypoints.all_reached", "equals": True},
    ]
    ended = {
        "terminated_by": {
            "time": 16.0,
            "since": 13.0,
            "condition": "landed",
            "cause": "plant.uav.contact.vessel",
        }
    }
    result = replace(
        flight_result, metadata={**flight_result.metadata, **ended, "system": LONG_NAMES}
    )
    write_report(result, evaluate_checks(flight_result.kpis, checks), [], file)
    return open_page(file)


def test_texts_of_the_diagram_are_inside_their_boxes(report):
    """In the widest font of the page; texts that fit are not shortened."""
    widths = report(
        "[...document.querySelectorAll('.component text')].map((text) => text.getBBox().width)"
    )
    assert 110 < max(widths) < 152 - 8, widths
    texts = report(
        "[...document.querySelectorAll('.component text')].map((text) => text.textContent)"
    )
    assert texts[0::2] == ["WaveMeasure…", "illinois", "uav.attitude"]
    assert texts[1] == "DeckController.mo:D…"


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("width", "height"), SIZES)
def test_nothing_overflows_and_texts_are_legible(report, width, height, scheme):
    report.page.set_viewport_size({"width": width, "height": height})
    report.page.emulate_media(color_scheme=scheme)
    assert report("document.documentElement.scrollWidth") == width
    assert report(OVERFLOWING) == []
    assert report(LOW_CONTRAST) == []


def test_a_phone_shows_the_picture_first(report):
    report.page.set_viewport_size({"width": 360, "height": 740})
    tops = report(
        "['.stage', '.bar', 'h1', '.card', '.signals'].map((part) => "
        "document.querySelector(part).getBoundingClientRect().top)"
    )
    assert tops == sorted(tops)
    assert tops[0] <= 0
    places = (
        "cosimReplay.view.actors.map(({position}) => "
        "position.clone().project(cosimReplay.view.cameras.camera).x)"
    )
    assert all(abs(x) < 0.9 for x in report(places))


def test_a_text_on_a_neutral_background_stands_where_the_picture_will_be(report, chromium):
    """The page as it is before its script has run, and after the first frame."""
    context = chromium.new_context(java_script_enabled=False)
    before = context.new_page()
    before.goto(report.page.url)
    loading = before.get_by_text("Loading the replay")
    assert loading.is_visible()
    assert loading.bounding_box()["height"] >= 320
    context.close()
    report.until("document.querySelector('.stage').dataset.drawn")
    assert report("getComputedStyle(document.querySelector('.stage')).backgroundColor") not in (
        "rgba(0, 0, 0, 0)",
        "rgb(0, 0, 0)",
    )
    assert report("document.querySelectorAll('.loading').length") == 1
    assert not report.page.locator(".loading").is_visible()


def test_the_keyboard_reaches_every_control(report):
    assert report(UNREACHABLE) == []
    report.page.keyboard.press("Tab")
    assert report("document.activeElement !== document.body")


def test_full_screen_shows_picture_and_controls(report):
    report.page.set_viewport_size({"width": 1280, "height": 800})
    report.page.locator(".full").click()
    report.until("document.fullscreenElement?.id === 'replay'")
    assert report(
        "document.querySelector('.bar').getBoundingClientRect().bottom <= innerHeight + 1"
    )
    report.page.locator(".full").click()
    report.until("!document.fullscreenElement")
