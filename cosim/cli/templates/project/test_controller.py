"""Requirements on the controller beyond the checks of its scenarios."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import cosim

COURSE = Path(__file__).parents[1] / "scenarios/course.json"


def run_course(folder: Path, setting: str) -> None:
    """Run the scenario with a changed value.

    The command ends an endless loop or a crash with a message.
    """
    command = [
        sys.executable,
        "-m",
        "cosim",
        "run",
        str(COURSE),
        "--set",
        setting,
        "--no-report",
        "--output-dir",
        str(folder),
    ]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode in (0, 3), (
        done.stdout + done.stderr
    )  # 3: the scenario's own checks are for its own values


@pytest.mark.parametrize("course", [0.5, -2.0])
def test_the_vessel_reaches_a_course_on_either_side(course: float, tmp_path: Path) -> None:
    run_course(tmp_path, f"usv.course_command={course}")
    result = cosim.Result.from_csv(tmp_path / "result.csv")
    assert result["vessel.attitude.yaw"][-1] == pytest.approx(course, abs=0.01)


def test_the_vessel_holds_a_low_speed(tmp_path: Path) -> None:
    run_course(tmp_path, "usv.speed_command=0.6")
    kpis = json.loads((tmp_path / "kpis.json").read_text())
    assert kpis["speed.value"] == pytest.approx(0.6, abs=0.01)
