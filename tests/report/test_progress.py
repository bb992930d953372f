"""The progress bar shows on a terminal only."""

import os
import subprocess
import sys

CODE = """
from cosim.cli.messages import progress_bar

with progress_bar("chase.mp4") as progress:
    if progress:
        progress(3, 12)
print(progress is None)
"""


def output(stderr):
    return subprocess.run(
        [sys.executable, "-c", CODE], stdout=subprocess.PIPE, stderr=stderr, text=True, check=True
    ).stdout


def test_a_terminal_shows_name_and_percentage():
    ours, theirs = os.openpty()
    try:
        assert output(theirs) == "False\n"
        shown = os.read(ours, 10000).decode()
    finally:
        os.close(ours)
        os.close(theirs)
    assert "chase.mp4" in shown
    assert "25%" in shown


def test_nothing_is_written_to_a_file(tmp_path):
    with (tmp_path / "errors").open("w+") as errors:
        assert output(errors) == "True\n"
        assert errors.tell() == 0
