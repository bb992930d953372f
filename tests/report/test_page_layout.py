"""The report on screens of all sizes: layout, contrast and keyboard."""

import pytest

from cosim.report.run_page import write_report
from cosim.results.checks import evaluate_checks

SIZES = ((1280, 800), (768, 1024), (360, 740))

#: ratio of the luminances of every visible text and its background (WCAG 2.2, 1.4.3), those below the limit
LOW_CONTRAST = """() => {
  const canvas = document.createElement("canvas").getContext("2d", {willReadFrequently: true});
  const rgba = (css) => { canvas.clearRect(0, 0, 1, 1); canvas.fillStyle = css; canvas.fillRect(0, 0, 1, 1);
    return [...canvas.getImageData(0, 0, 1, 1).data]; };
  const light = (rgb) => rgb.slice(0, 3).map((v) => v / 255).map((v) => v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)
    .reduce((sum, v, i) => sum + v * [0.2126, 0.7152, 0.0722][i], 0);
  const behind = (element) => { for (let e = element; e; e = e.parentElement) {
    const colour = rgba(getComputedStyle(e).backgroundColor); if (colour[3] > 200) return colour; } return [255, 255, 255]; };
  const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT), low = [];
  while (texts.nextNode()) {
    const element = texts.currentNode.parentElement, style = getComputedStyle(element);
    const shown = texts.currentNode.data.trim() && element.getClientRects().length;
    if (!shown || element.closest("script, style, .drawn, svg, :disabled")) continue;
    const [one, other] = [light(rgba(style.color)), light(behind(element))].sort((a, b) => b - a);
    const large = parseFloat(style.fontSize) >= 24, ratio = (one + 0.05) / (other + 0.05);
    if (ratio < (large ? 3 : 4.5)) low.push([texts.currentNode.data.trim().slice(0, 30), ratio]);
  }
  return low;
}"""

#: texts whose box ends outside of the window or of its card
OVERFLOWING = """() => {
  const parts = document.querySelectorAll(".card *, .verdict, .chip, .facts *, .bar > *, .tools *, .plot figcaption *");
  return [...parts].filter((element) => !element.closest("datalist, option")).filter((element) => {
    const inner = element.getBoundingClientRect(), outer = (element.closest(".card") ?? document.body).getBoundingClientRect();
    return inner.right > outer.right + 0.5 || inner.left < outer.left - 0.5;
  }).map((element) => element.className || element.tagName);
}"""

#: controls that Tab does not reach, or that have no name
UNREACHABLE = """() => [...document.querySelectorAll("button, select, input, summary")]
  .filter((element) => element.getClientRects().length && !element.disabled)
  .filter((element) => element.tabIndex < 0 || !(element.ariaLabel || element.title || element.textContent.trim()))
  .map((element) => element.outerHTML.slice(0, 80))"""


@pytest.fixture(scope="module")
def report(open_page, flight_result, tmp_path_factory):
    """The report of a flight with a check that is not met, which has the longest label."""
    file = tmp_path_factory.mktemp("report") / "report.html"
    checks = [
        {"kpi": "landing.touchdown_speed", "min": 0.123456, "max": 0.234567},
        {"kpi": "waypoints.all_reached", "equals": True},
    ]
    write_report(flight_result, evaluate_checks(flight_result.kpis, checks), [], file)
    return open_page(file)


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
        "['.stage', '.bar', 'h1', '.card', '.signals'].map((part) => document.querySelector(part).getBoundingClientRect().top)"
    )
    assert tops == sorted(tops)
    assert tops[0] <= 0


def test_the_keyboard_reaches_every_control(report):
    assert report(UNREACHABLE) == []
    report.page.keyboard.press("Tab")
    assert report("document.activeElement !== document.body")


def test_full_screen_shows_picture_and_controls(report):
    report.page.set_viewport_size({"width": 1280, "height": 800})
    report.page.locator(".full").click()
    report.until("document.fullscreenElement?.id === 'replay'")
    assert report("document.querySelector('.bar').getBoundingClientRect().bottom <= innerHeight + 1")
    report.page.locator(".full").click()
    report.until("!document.fullscreenElement")
