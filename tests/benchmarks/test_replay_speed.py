"""Frames per second of the replay of Demo 1 in a browser with software rendering.

Run with: pytest -m benchmark -n 0 -s tests/benchmarks/test_replay_speed.py
"""

import os
from statistics import median

import pytest
from chromium import SOFTWARE_RENDERING_FLAGS, open_browser

import cosim
from cosim.report.replay import write_replay

pytestmark = pytest.mark.benchmark

WINDOW = {"width": 1280, "height": 720}
ROUNDS = 3
SECONDS = 2
#: smallest allowed frame rate (1/s), also on a machine under load
SMALLEST_RATE = 3
MOMENTS = """(seconds) => new Promise((done) => {
  const moments = [], end = performance.now() + 1000 * seconds;
  const frame = (now) => {
    moments.push(now);
    now < end ? requestAnimationFrame(frame) : done(moments);
  };
  requestAnimationFrame(frame);
})"""


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    file = tmp_path_factory.mktemp("replay") / "replay.html"
    write_replay([cosim.run("demo1_box")], file)
    return file.as_uri()


@pytest.mark.parametrize(
    ("drawn", "flags"), [("3-D only", ()), ("all of the page", SOFTWARE_RENDERING_FLAGS)]
)
def test_frames_per_second(page, drawn, flags):
    print(
        f"\nreplay of Demo 1, {drawn} by SwiftShader, median of {ROUNDS} rounds, load average "
        f"{os.getloadavg()[0]:.2f}"
    )
    with open_browser(flags) as opened:
        tab = opened.new_page(viewport=WINDOW)
        tab.goto(page)
        tab.wait_for_selector("#replay[data-ready]")
        for camera in ("Orbit", "Chase"):
            tab.get_by_role("button", name=camera, exact=True).click()
            rates = [frames_per_second(tab) for _ in range(ROUNDS)]
            ratio = tab.evaluate("cosimReplay.view.renderer.getPixelRatio()")
            print(
                (
                    f"  {camera:8}{median(rates):8.1f} frames/s at {ratio:.2g} pixels per pixel of "
                    "the page"
                ),
                flush=True,
            )
            assert median(rates) > SMALLEST_RATE


def frames_per_second(tab):
    """Return the frame rate of the replay after its first second."""
    tab.evaluate("cosimReplay.player.seek(4)")
    tab.click(".play")
    tab.wait_for_timeout(1000)
    moments = tab.evaluate(MOMENTS, SECONDS)
    tab.click(".play")
    return 1000 * (len(moments) - 1) / (moments[-1] - moments[0])
