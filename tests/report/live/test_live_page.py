"""The live page in a browser."""

import pytest
from live_run import LiveRun, wait_until

from cosim.results import Result


@pytest.fixture
def run(tmp_path):
    run = LiveRun(tmp_path, "free_flight", "--stop-time", "6", "--real-time", "0.2")
    run.command("pause")  # until the page is open
    yield run
    run.process.kill()
    run.process.wait()


@pytest.fixture
def page(chromium, run):
    context = chromium.new_context(viewport={"width": 640, "height": 480})
    page = context.new_page()
    page.console_messages, page.requests = [], []
    page.on("pageerror", lambda error: page.console_messages.append(str(error)))
    page.on(
        "console",
        lambda said: page.console_messages.append(said.text) if said.type == "error" else None,
    )
    page.on("request", lambda request: page.requests.append(request.url))
    page.goto(run.url)
    page.wait_for_selector("#replay[data-ready]", timeout=60_000)
    yield page
    context.close()


def waiting(page, condition):
    return wait_until(lambda: page.wait_for_timeout(30) or page.evaluate(condition))


def test_a_live_run_is_shown_steered_and_replayed(run, page):
    assert (
        page.locator(".play").count() == page.locator(".speed").count() == 1
    )  # one set of controls
    page.locator(".play").click()
    waiting(
        page, "cosimReplay.player.time > cosimReplay.player.first && cosimReplay.live.run.rows > 20"
    )
    page.keyboard.press("Space")
    waiting(page, "document.querySelector('.state').textContent === 'Paused'")
    rows = page.evaluate("cosimReplay.live.run.rows")
    page.get_by_role("button", name="Step", exact=True).click()
    waiting(page, f"cosimReplay.live.run.rows === {rows + 1}")

    page.get_by_text("Parameters and inputs").click()
    count = page.get_by_label("usv.waypoint_count", exact=True)
    assert (count.first.get_attribute("type"), count.first.get_attribute("max")) == ("range", "32")
    count.last.fill("99")
    count.last.press("Enter")
    waiting(
        page,
        (
            "document.querySelector('.answer').textContent.includes('must lie in 1.0 ... 32.0, "
            "found 99')"
        ),
    )
    assert count.last.input_value() == "5"
    speed = page.get_by_label("usv.speed_command", exact=True)
    speed.fill("0.25")
    speed.press("Enter")
    waiting(page, "document.querySelector('.answer').textContent === ''")

    page.get_by_label("Run speed", exact=True).select_option(label="fastest")
    page.locator(".play").click()
    assert run.wait() in (0, 3)
    waiting(page, "document.querySelector('.state').textContent === 'Finished'")
    assert run.run_metadata()["live_events"] == [
        {"time": pytest.approx(0.01 * rows), "set": {"usv.speed_command": 0.25}}
    ]
    result = Result.from_csv(run.out / "result.csv")
    assert page.evaluate("cosimReplay.live.run.rows") == len(result.time)
    waiting(page, "cosimReplay.player.time === 6")
    x, y, z = page.evaluate("cosimReplay.view.actors[1].object.position.toArray()")
    assert (x, y, z) == pytest.approx(
        [result[f"vessel.position.{axis}"][-1] for axis in "xyz"], abs=1e-5
    )

    page.evaluate("cosimReplay.player.seek(2)")  # a replay as any
    assert page.get_by_label("Replay speed", exact=True).input_value() == "1"
    page.locator(".play").click()
    waiting(page, "cosimReplay.player.time > 2 && cosimReplay.player.playing")
    assert {url for url in page.requests if not url.startswith((run.url, "data:"))} == set()
    assert [text for text in page.console_messages if "400 (Bad Request)" not in text] == []
