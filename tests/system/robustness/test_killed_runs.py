"""A killed run loses no row; what it leaves can be recovered and then goes away."""

from __future__ import annotations

import fcntl
import os
import random
import signal
import time
from dataclasses import dataclass, field

import pytest
from command_folder import CommandFolder, child_processes, wait_until
from slow_counter import tens

import cosim

#: time from the initialization to the first row, and longest step (s)
TOLERANCE = 0.2


def victims(supervisor: int, whom: str) -> list[int]:
    child = child_processes(supervisor)
    return {"supervisor": [supervisor], "child": child, "both": [supervisor, *child]}[whom]


@dataclass
class Killed:
    """A run that goes on until somebody is killed."""

    place: CommandFolder
    whom: str
    delay: float
    moment: float = field(init=False)

    def __post_init__(self) -> None:
        self.process = self.place.start(
            "run", self.place.scenario(), "--output-dir", "out", "--no-report"
        )

    def begin(self) -> float:
        assert self.place.wait_for_file("started"), self.process.communicate()
        self.started = float((self.place.folder / "started").read_text())
        return self.started + self.delay

    def kill(self) -> None:
        time.sleep(max(0.0, self.started + self.delay - time.monotonic()))
        self.moment = time.monotonic()
        for process in victims(self.process.pid, self.whom):
            os.kill(process, signal.SIGKILL)
        _, self.errors = self.process.communicate(timeout=30)

    def judge(self) -> None:
        assert wait_until(lambda: not self.place.processes(), 5.0)
        assert wait_until(lambda: self.process.returncode is not None)
        if self.whom == "child":
            assert self.process.returncode == 1, self.errors
            assert "the process was ended by signal 9 (SIGKILL" in self.errors
            assert self.place.leftovers() == []
        else:
            done = self.place.run("recover", "out")
            if done.returncode:
                assert self.moment - self.started <= TOLERANCE, done.stderr
                return
        result = cosim.Result.from_csv(self.place.out / "result.csv")
        rows = len(result.time)
        assert result["ticker.count"].tolist() == list(range(rows))
        assert result["ticker.tens"].tolist() == [tens(n) for n in range(rows)]
        assert result.time.tolist() == [n / 100 for n in range(rows)]
        assert self.moment - result["ticker.clock"][-1] <= TOLERANCE


def together(folder, seed: int, count: int = 10) -> None:
    """Several runs at once, each killed at a different moment."""
    draw = random.Random(seed)  # noqa: S311 - the same moments each time
    who = ["supervisor", "child", "both"]
    runs = [
        Killed(CommandFolder(folder / str(n)), who[n % 3], draw.uniform(0.0, 4.0))
        for n in range(count)
    ]
    for run in sorted(runs, key=Killed.begin):
        run.kill()
    for run in runs:
        run.judge()


def test_no_row_is_lost(tmp_path):
    together(tmp_path, 1, 6)


@pytest.mark.long
@pytest.mark.parametrize("seed", range(2, 22))
def test_no_row_is_lost_at_any_moment(tmp_path, seed):
    together(tmp_path, seed)


def test_the_next_run_removes_what_a_killed_one_left(workplace):
    killed = Killed(workplace, "both", 1.5)
    killed.begin()
    killed.kill()
    assert len(workplace.leftovers()) == 3  # the rows, the lock file, and a folder in tmp
    done = workplace.run("run", workplace.scenario(stop=0.1), "--output-dir", "out", "--no-report")
    assert done.returncode == 0, done.stderr
    assert workplace.leftovers() == []
    assert len(cosim.Result.from_csv(workplace.out / "result.csv").time) == 11


def test_temporary_folders_of_living_processes_are_left_alone(workplace):
    taken, abandoned, foreign = (
        workplace.tmp / name for name in ("cosim-run-taken", "cosim-run-abandoned", "others")
    )
    for folder in (taken, abandoned, foreign):
        folder.mkdir()
        (folder / "file").touch()
    lock = os.open(taken, os.O_RDONLY)
    fcntl.flock(lock, fcntl.LOCK_EX)
    done = workplace.run("run", workplace.scenario(stop=0.1), "--output-dir", "out", "--no-report")
    os.close(lock)
    assert done.returncode == 0, done.stderr
    assert sorted(path.name for path in workplace.tmp.iterdir()) == ["cosim-run-taken", "others"]
    assert (taken / "file").exists()


def test_rows_of_an_earlier_run_do_not_pass_for_those_of_a_killed_one(workplace):
    first = workplace.run("run", workplace.scenario(stop=0.1), "--output-dir", "out", "--no-report")
    assert first.returncode == 0, first.stderr
    (workplace.folder / "started").unlink()
    killed = Killed(workplace, "both", 0.05)
    killed.begin()
    killed.kill()
    assert not (workplace.out / "result.csv").exists()
    assert not (workplace.out / "run.json").exists()


def test_one_fmu_alone_leaves_nothing_when_its_process_is_killed(workplace):
    from cosim.core import resources

    words = (
        "simulate",
        resources.root() / "fmus/python/vtol.fmu",
        "--output-file",
        "x.csv",
        "--stop-time",
        "1e5",
        "--step-size",
        "0.01",
    )
    process = workplace.start(*words)
    header = workplace.folder / ".x.csv.unfinished/header.json"
    assert wait_until(header.exists)
    time.sleep(0.2)
    os.kill(child_processes(process.pid)[0], signal.SIGKILL)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1, errors
    assert workplace.leftovers() == []
    assert len(cosim.Result.from_csv(workplace.folder / "x.csv").time) > 1
