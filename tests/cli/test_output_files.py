"""Output files of commands that are symbolic links, FIFOs and devices."""

from __future__ import annotations

import json
import os
import stat
from pathlib import Path

import pytest
from cosim_command import StartedCommand, run_cosim

from cosim.core import resources
from cosim.results import Result

FMU = resources.root() / "fmus" / "acceleration_controller.fmu"
CONTROLLER = resources.root() / "controllers" / "python" / "heading_controller.py"
SIGNAL = "pilot.acceleration_command.x"


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a scenario and its results."""
    folder = tmp_path_factory.mktemp("outputs")
    check = {"name": "k", "python": "cosim:cosim/kpis.py:final", "arguments": {"signal": SIGNAL}}
    scenario = {
        "name": "plain",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": {"pilot": {"fmu": str(FMU)}},
        "kpis": [check],
        "checks": [{"kpi": "k.value", "min": -1.0}],
    }
    (folder / "plain.json").write_text(json.dumps(scenario))
    sweep = {"name": "study", "scenario": "plain.json", "factors": []}
    sweep["factors"] = [{"name": "f", "set": "pilot.speed_limit", "values": [1.0, 2.0]}]
    (folder / "sweep.json").write_text(json.dumps(sweep))
    done = run_cosim("run", "plain.json", "--output-dir", "out", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


INPUTS = "--inputs pilot.vehicle.position.x --outputs pilot.acceleration_command.x"

#: words of a command, and the links that it writes
WRITERS = [
    (f"simulate {FMU} --output-file LINK.csv", "LINK.csv"),
    (
        "run plain.json --output-dir results --parquet --mcap",
        "results/result.csv results/kpis.json results/run.json results/report.html "
        "results/result.parquet results/result.mcap",
    ),
    (
        "sweep sweep.json --output-dir results",
        "results/table.csv results/sweep.html results/sweep.json results/journal.jsonl",
    ),
    ("regress plain.json --junit LINK.xml", "LINK.xml"),
    (f"linearize plain.json {INPUTS} --output LINK.json", "LINK.json"),
    (f"linearize plain.json {INPUTS} --output LINK.mat", "LINK.mat"),
    ("report out --output-file LINK.html", "LINK.html"),
    ("replay out --output-file LINK.html", "LINK.html"),
    ("compare out out --plot LINK.svg", "LINK.svg"),
    (f"build {CONTROLLER} --output LINK.fmu", "LINK.fmu"),
    ("new scenario LINK --from plain.json --force", "LINK.json"),
    ("new vehicle LINK --from otter --force", "LINK.json"),
    ("new controller link --language python --role vessel_autopilot --force", "link/link.py"),
]


@pytest.mark.parametrize(("words", "links"), WRITERS)
def test_links_are_followed(finished: Path, tmp_path: Path, words: str, links: str) -> None:
    for file in ("plain.json", "sweep.json", "out"):
        (tmp_path / file).symlink_to(finished / file)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    targets = {tmp_path / link: elsewhere / Path(link).name for link in links.split()}
    for link, target in targets.items():
        link.parent.mkdir(exist_ok=True)
        link.symlink_to(target)
    done = run_cosim(*words.split(), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for link, target in targets.items():
        assert link.is_symlink()
        assert stat.S_ISREG(target.lstat().st_mode)
        assert target.stat().st_size > 0
    assert names(elsewhere) == sorted(target.name for target in targets.values())


def test_a_link_is_followed_again(tmp_path: Path) -> None:
    (tmp_path / "link.csv").symlink_to("data.csv")
    for _ in range(2):
        done = run_cosim("simulate", FMU, "--output-file", "link.csv", cwd=tmp_path)
        assert done.stdout == "101 rows in link.csv\n"
    assert len(Result.from_csv(tmp_path / "data.csv").time) == 101
    assert names(tmp_path) == ["data.csv", "link.csv"]


@pytest.mark.parametrize("isolation", ["run", "none"])
def test_a_fifo_gets_the_rows(tmp_path: Path, isolation: str) -> None:
    os.mkfifo(tmp_path / "rows.csv")
    reader = os.open(tmp_path / "rows.csv", os.O_RDONLY | os.O_NONBLOCK)
    words = ("simulate", FMU, "--output-file", "rows.csv", "--isolation", isolation)
    done = run_cosim(*words, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "101 rows in rows.csv\n"), done.stderr
    assert os.read(reader, 1 << 16).count(b"\n") == 102
    os.close(reader)
    assert names(tmp_path) == ["rows.csv"]


def test_a_fifo_without_a_reader_is_refused_with_a_message(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "rows.csv")
    command = StartedCommand("simulate", FMU, "--output-file", "rows.csv", cwd=tmp_path, env={})
    _, err = command.communicate(timeout=60.0)
    assert command.returncode == 2
    assert "No process reads this FIFO" in err
    assert names(tmp_path) == ["rows.csv"]


def test_the_output_may_be_standard_output(tmp_path: Path) -> None:
    done = run_cosim("simulate", FMU, "--output-file", "/dev/stdout", cwd=tmp_path)
    lines = done.stdout.splitlines()
    assert lines[0].startswith('"time",')
    assert (len(lines), lines[-1]) == (103, "101 rows in /dev/stdout")


@pytest.mark.skipif(os.geteuid() != 0, reason="only root creates device nodes")
@pytest.mark.parametrize(
    "words", [f"simulate {FMU} --output-file null", "regress plain.json --junit null"]
)
def test_a_device_stays_a_device(finished: Path, tmp_path: Path, words: str) -> None:
    """A node with the numbers of the null device: as root, the null device itself is at stake."""
    (tmp_path / "plain.json").symlink_to(finished / "plain.json")
    os.mknod(tmp_path / "null", 0o020666, os.makedev(1, 3))
    done = run_cosim(*words.split(), cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "null").is_char_device()
    assert os.lstat(tmp_path / "null").st_rdev == os.makedev(1, 3)
