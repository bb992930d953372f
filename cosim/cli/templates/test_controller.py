"""Test of the controller CONTROLLER in its scenario.

The command ends an endless loop or a crash with a message.
"""

import subprocess
import sys
from pathlib import Path


def test_the_controller_meets_the_checks(tmp_path: Path) -> None:
    scenario = str(Path(__file__).with_name("CONTROLLER.json"))
    command = [
        sys.executable,
        "-m",
        "cosim",
        "run",
        scenario,
        "--no-report",
        "--output-dir",
        str(tmp_path),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
