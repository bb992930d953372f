"""A real flight, and visits of its pages in a real browser."""

import time

import pytest

import cosim


@pytest.fixture(scope="session")
def flight_result():
    """Demo 1 until shortly after the landing: one of its five checks fails, it has not been round
    the box.
    """
    return cosim.run("demo1_box", stop_time=16)


class PageVisit:
    """A page opened from disk, and what it asked for and complained about."""

    def __init__(self, browser, file):
        self.context = browser.new_context(viewport={"width": 640, "height": 480})
        self.page = self.context.new_page()
        self.requests, self.console_messages, self.url = [], [], file.absolute().as_uri()
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on(
            "console",
            lambda said: (
                self.console_messages.append(said.text)
                if said.type in ("error", "warning")
                else None
            ),
        )
        self.page.on("pageerror", lambda error: self.console_messages.append(str(error)))
        self.page.goto(self.url)
        self.page.wait_for_selector("#replay[data-ready]", timeout=60_000)

    def __call__(self, script):
        return self.page.evaluate(script)

    def seek(self, time):
        self(f"cosimReplay.player.seek({time})")

    def until(self, condition, seconds=30):
        """Wait until a condition in the page holds."""
        end = time.monotonic() + seconds
        while not self(condition):
            assert time.monotonic() < end, f"waited {seconds} s in vain for {condition}"
            self.page.wait_for_timeout(50)

    def check(self):
        """The page has asked for nothing but itself, and complained of nothing."""
        assert self.requests == [self.url]
        assert [text for text in self.console_messages if "GPU stall" not in text] == []

    @property
    def time(self):
        return self("cosimReplay.player.time")

    def body(self, number):
        """Position and orientation (w, x, y, z) of a body as it stands in the scene."""
        of = f"cosimReplay.view.actors[{number}].object"
        return self(
            f"[{of}.position.toArray(), [{of}.quaternion.w, ...{of}.quaternion.toArray().slice(0, "
            "3)]]"
        )


@pytest.fixture(scope="module")
def open_page(chromium):
    """Open files in the browser; none may request anything else or report an error."""
    visits = []

    def opened(file):
        visits.append(PageVisit(chromium, file))
        return visits[-1]

    yield opened
    for one in visits:
        one.context.close()
        one.check()
