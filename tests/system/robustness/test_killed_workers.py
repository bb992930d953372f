"""Whoever of a run with worker processes is killed, at whatever moment: the rows can be read, and
nothing stays behind.
"""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from command_folder import TICKER, CommandFolder, child_processes, wait_until

import cosim

DESCRIPTORS = Path("/proc/self/fd")
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="looks into /proc")


@pytest.fixture
def probe(probes):
    return probes[3]


def scenario(place: CommandFolder, probe: Path, stop: float = 1000.0) -> Path:
    """A ticker and two FMUs, each in a separate process."""
    fmus = {name: {"fmu": str(probe), "isolation": "fmu"} for name in ("lag", "twin")}
    return place.scenario(stop, components={"ticker": {"python": f"{TICKER}:SlowCounter"}, **fmus})


def family(supervisor: int) -> dict[str, list[int]]:
    (child,) = child_processes(supervisor)
    return {
        "supervisor": [supervisor],
        "child": [child],
        "worker": child_processes(child)[:1],
        "everybody": [supervisor, child],
    }


OTHERS = [pytest.param(whom, marks=pytest.mark.long) for whom in ("child", "everybody")]


@pytest.mark.parametrize("whom", ["supervisor", "worker", *OTHERS])
def test_nothing_stays_and_the_rows_can_be_read(workplace, probe, whom):
    process = workplace.start(
        "run", scenario(workplace, probe), "--output-dir", "out", "--no-report"
    )
    assert workplace.wait_for_file("started"), process.communicate()
    started = float((workplace.folder / "started").read_text())
    time.sleep(random.Random(whom).uniform(0.4, 0.8))  # noqa: S311 - the same moment each time
    for victim in family(process.pid)[whom]:
        os.kill(victim, signal.SIGKILL)
    moment = time.monotonic()
    _, errors = process.communicate(timeout=30)
    assert wait_until(lambda: not workplace.processes(), 5.0)
    if whom in ("child", "worker"):
        assert process.returncode == 1
        assert "signal 9 (SIGKILL" in errors
        assert workplace.leftovers() == []
    else:
        done = workplace.run("recover", "out")
        assert done.returncode == 0, done.stderr
    if whom == "worker":
        assert "lag: " in json.loads((workplace.out / "run.json").read_text())["failure"]
    rows = cosim.Result.from_csv(workplace.out / "result.csv")
    assert rows["ticker.count"].tolist() == list(range(len(rows.time)))
    assert moment - max(started, rows["ticker.clock"][-1]) <= 0.2
    (workplace.folder / "started").unlink()
    again = workplace.run(
        "run", scenario(workplace, probe, 0.1), "--output-dir", "out", "--no-report"
    )
    assert again.returncode == 0, again.stderr
    assert workplace.leftovers() == []


def test_a_killed_worker_leaves_no_descriptor_in_the_importer(workplace, probe, monkeypatch):
    """The worker is killed from an observer; the run says who died and when, and keeps its rows."""
    monkeypatch.setattr("tempfile.tempdir", str(workplace.tmp))
    monkeypatch.chdir(workplace.folder)
    file = scenario(workplace, probe, 1.0)
    cosim.run(file)  # imports
    before, others = sorted(DESCRIPTORS.iterdir()), child_processes(os.getpid())

    def killer(finished: int, _count: int) -> None:
        if finished == 50:
            lag, _ = (child for child in child_processes(os.getpid()) if child not in others)
            os.kill(lag, signal.SIGKILL)

    with pytest.raises(
        cosim.ComponentError, match=r"lag: .* failed at t = 0.5 s: .*signal 9"
    ) as caught:
        cosim.run(file, observers=[killer])
    assert len(caught.value.result.time) == 51
    assert (
        sorted(DESCRIPTORS.iterdir()),
        child_processes(os.getpid()),
        list(workplace.tmp.iterdir()),
    ) == (before, others, [])


PROGRAM = """
import os, sys, time, cosim
def wait(finished, count):
    print("running", flush=True)
    time.sleep(60)
cosim.run(sys.argv[1], observers=[wait])
"""


def folders(place: CommandFolder) -> set[str]:
    return {path.name.rpartition("-")[0] for path in place.tmp.iterdir()}


def test_what_a_killed_program_left_goes_at_the_start_of_the_next_one(workplace, probe):
    """Two programs use the Python interface and one is killed: its folders are removed, those of
    the other stay.
    """
    file = scenario(workplace, probe)
    environment = {**os.environ, "TMPDIR": str(workplace.tmp)}
    programs = []
    for _ in range(2):
        words = [sys.executable, "-c", PROGRAM, str(file)]
        programs.append(
            subprocess.Popen(
                words, env=environment, cwd=workplace.folder, stdout=subprocess.PIPE, text=True
            )
        )
        assert programs[-1].stdout.readline() == "running\n"
    living = sorted(workplace.tmp.iterdir())
    assert folders(workplace) == {"cosim-fmu", "cosim-worker"}
    victim, other = programs
    victim.kill()
    victim.communicate()
    assert sorted(workplace.tmp.iterdir()) == living
    try:
        done = workplace.run(
            "run", scenario(workplace, probe, 0.1), "--output-dir", "out", "--no-report"
        )
        assert done.returncode == 0, done.stderr
        assert len(living) == 6
        assert len(list(workplace.tmp.iterdir())) == 3
        assert folders(workplace) == {"cosim-fmu", "cosim-worker"}
    finally:
        other.kill()
        other.communicate()


FORGETFUL = """
import os, sys
from cosim.process.temporary_folders import FMU_PREFIX, LockedFolder
folder = LockedFolder(FMU_PREFIX)
if os.fork() == 0:
    sys.exit()
os.wait()
print(os.listdir(os.environ["TMPDIR"]) == [os.path.basename(folder.name)])
"""


def test_a_forgotten_folder_goes_with_its_process_and_not_with_a_child(workplace):
    environment = {**os.environ, "TMPDIR": str(workplace.tmp)}
    done = subprocess.run(
        [sys.executable, "-c", FORGETFUL],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
    )
    assert (done.stdout, list(workplace.tmp.iterdir())) == ("True\n", [])
