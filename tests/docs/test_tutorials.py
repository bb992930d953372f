"""Tutorials and guides: every block of a page is executed, in the order of the page, in one empty
folder.
"""

import io
import os
import re
import runpy
import shlex
import socket
import subprocess
import sys
import time
from contextlib import redirect_stdout
from pathlib import Path

import pytest
from cosim_command import run_cosim

DOCS = Path(__file__).parents[2] / "docs"
PAGES = [*sorted((DOCS / "tutorials").glob("*.md")), *sorted((DOCS / "how_to").glob("*.md"))]
PAGES += [DOCS / "python.md", DOCS / "analysis.md"]
BLOCK = re.compile(r'^```(\w+)(?: title="([^"]+)"| (\w+))?\n(.*?)^```$', re.MULTILINE | re.DOTALL)

#: pages that take more than two seconds
SLOW = {
    "cluster",
    "compare_runs",
    "controller_modelica",
    "controller_other_tools",
    "landing",
    "rank_controllers",
    "regression",
}
SLOW |= {"analysis", "python", "run_foreign_fmus", "sweep"}
#: shown, but of programs that are not installed here
NOT_EXECUTED = {"matlab"}


class Story:
    """A reader who follows a page."""

    def __init__(self, folder, monkeypatch):
        self.folder, self.output, self.background = folder, "", []
        monkeypatch.chdir(folder)

    def follow(self, language, title, manner, text):
        if title:
            Path(title).parent.mkdir(parents=True, exist_ok=True)
            Path(title).write_text(text)
        elif language not in NOT_EXECUTED:
            getattr(self, language)(text, manner)

    def sh(self, text, manner):
        for line in text.splitlines():
            words = shlex.split(line, comments=True)
            if manner == "background":
                self.background.append(
                    subprocess.Popen([sys.executable, "-m", *words], stderr=subprocess.DEVNULL)
                )
            elif words[:1] == ["cd"]:
                os.chdir(words[1])
            elif words:
                self.run(words, manner)
        if manner == "background":
            wait_for_port(8799)

    def run(self, words, manner):
        if words[0] == "cosim":
            done = run_cosim(*words[1:], cwd=Path.cwd())
        else:
            assert words[0] == "python"
            done = subprocess.run(
                [sys.executable, *words[1:]], capture_output=True, text=True, check=False
            )
        self.output += done.stdout
        assert (done.returncode == 3) if manner == "fails" else (done.returncode == 0), (
            done.stdout + done.stderr
        )

    def text(self, text, _):
        """Every line shown was printed before."""
        printed = {" ".join(line.split()) for line in self.output.splitlines()}
        assert [line for line in text.splitlines() if " ".join(line.split()) not in printed] == []

    def python(self, text, _):
        Path("block.py").write_text(text)
        with redirect_stdout(io.StringIO()) as printed:
            runpy.run_path("block.py")
        self.output += printed.getvalue()

    def modelica(self, text, _):
        assert "buildModelFMU" in text  # a script of OpenModelica

    def json(self, text, _):
        raise AssertionError(f"a JSON block without a title is not used by the page: {text}")


def wait_for_port(port, limit=30.0):
    end = time.monotonic() + limit
    while time.monotonic() < end:
        with socket.socket() as client:
            if client.connect_ex(("127.0.0.1", port)) == 0:
                return
        time.sleep(0.1)
    raise AssertionError("no scheduler")


@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, id=page.stem, marks=[pytest.mark.long] if page.stem in SLOW else [])
        for page in PAGES
    ],
)
def test_a_reader_can_follow_the_page(page, tmp_path, monkeypatch):
    if page.stem == "cluster":
        pytest.importorskip("distributed")
    story = Story(tmp_path, monkeypatch)
    try:
        for block in BLOCK.findall(page.read_text()):
            story.follow(*block)
    finally:
        for process in reversed(story.background):
            process.terminate()
            process.wait()


@pytest.mark.parametrize(
    "page", sorted((DOCS / "tutorials").glob("*.md")), ids=lambda page: page.stem
)
def test_a_tutorial_names_the_folder_of_its_commands_before_the_first_one(page):
    beginning = page.read_text().partition("\n## ")[0]
    assert re.search(
        r"\b[Rr]un (all|the first) commands? in .*\bfolder\b|run all commands in it", beginning
    )


def test_every_block_is_found():
    """The pattern of blocks misses none, and no block stands for nothing."""
    for page in PAGES:
        text = page.read_text()
        assert 2 * len(BLOCK.findall(text)) == len(re.findall(r"^```", text, re.MULTILINE)), page
