"""A real browser to look at pages with, where there is no graphics card."""

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import pytest

#: WebGL drawn by the processor; the others so that Chromium asks nobody for anything
FLAGS = ("--enable-unsafe-swiftshader", "--no-sandbox", "--disable-quic", "--no-first-run")
FLAGS += ("--disable-background-networking", "--disable-component-update", "--disable-sync")
#: the page itself is drawn as if there were a graphics card, which takes the processor longer still
SOFTWARE_RENDERING_FLAGS = ("--use-gl=angle", "--use-angle=swiftshader")


@contextmanager
def open_browser(flags: Sequence[str] = ()) -> Iterator:
    """Playwright's Browser of an installed Chromium; skips the test where either is missing."""
    playwright = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    path = (
        shutil.which("chromium")
        or shutil.which("chromium-browser")
        or shutil.which("google-chrome")
    )
    if path is None:
        pytest.skip("no chromium here")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=path, args=[*FLAGS, *flags])
        yield opened
        opened.close()
