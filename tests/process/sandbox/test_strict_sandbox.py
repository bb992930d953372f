"""`--sandbox strict`: the whole command is confined, not only FMUs."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest
from cosim_command import run_cosim

from cosim.process.sandbox import find_available_sandboxes

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not find_available_sandboxes().bubblewrap, reason="no bubblewrap that works"
    ),
    pytest.mark.skipif(
        not find_available_sandboxes().confines_fmus, reason="this system cannot confine FMUs"
    ),
]


def words(*arguments: object) -> list[str]:
    return [sys.executable, "-m", "cosim", *map(str, arguments)]


def cosim(folder: Path, *arguments: object, **more: str) -> subprocess.CompletedProcess[str]:
    return run_cosim(*arguments, cwd=folder, env=variables(folder) | more)


@pytest.fixture
def server():
    """Server at one TCP and UDP port; reads UDP without waiting."""
    with socket.socket() as stream, socket.socket(type=socket.SOCK_DGRAM) as datagrams:
        stream.bind(("127.0.0.1", 0))
        stream.listen()
        datagrams.bind(stream.getsockname())
        datagrams.settimeout(0.2)
        yield datagrams


@pytest.fixture
def home(tmp_path):
    """Folder with a scenario in a subfolder and a private file beside it."""
    (tmp_path / "project").mkdir()
    (tmp_path / "private.txt").write_text("secret")
    shutil.copy(Path(__file__).with_name("sandbox_probe.py"), tmp_path / "project")
    return tmp_path


def variables(folder: Path) -> dict[str, str]:
    """Environment with temporary files in a folder."""
    (folder / "tmp").mkdir(exist_ok=True)
    return {**os.environ, "TMPDIR": str(folder / "tmp")}


def prowling(home: Path, port: int = 9, **more: Any) -> Path:
    arguments = {
        "private": str(home / "private.txt"),
        "own": str(home / "out/own.txt"),
        "port": port,
        "process": os.getpid(),
    }
    component = {"python": "sandbox_probe.py:SandboxProbe", "arguments": arguments}
    content = {
        "name": "prowling",
        "stop_time": 0.1,
        "step_size": 0.01,
        "components": {"p": component},
        **more,
    }
    file = home / "project/prowling.json"
    file.write_text(json.dumps(content))
    return file


def report(done: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    (line,) = [line for line in done.stdout.splitlines() if line.startswith("{")]
    return dict(json.loads(line))


def test_the_run_writes_its_results_and_reaches_nothing_else(home, server):
    file = prowling(home, server.getsockname()[1])
    done = cosim(home, "run", file, "--output-dir", "out", "--no-report", "--sandbox", "strict")
    assert done.returncode == 0, done.stderr
    found = report(done)
    assert found.pop("see processes") < 10
    assert found == {
        "write beside its source": "OSError",  # read-only file system
        "write to the system": "OSError",
        "write to its own folder": 4,
        "read a private file": "FileNotFoundError",
        "connect": "ConnectionRefusedError",  # this machine is another one there
        "send": 3,
        "signal": "ProcessLookupError",
    }
    with pytest.raises(TimeoutError):
        server.recv(10)
    assert len((home / "out/result.csv").read_text().splitlines()) == 12
    assert list((home / "tmp").iterdir()) == []


def test_without_sandbox_the_same_run_reaches_everything(home, server):
    """Control experiment for the test above."""
    done = cosim(
        home, "run", prowling(home, server.getsockname()[1]), "--output-dir", "out", "--no-report"
    )
    found = report(done)
    assert (found["read a private file"], found["connect"], found["send"], found["signal"]) == (
        "secret",
        "connected",
        3,
        None,
    )
    assert (found["write beside its source"], server.recv(10)) == (4, b"out")


@pytest.mark.parametrize("before", [True, False], ids=["before", "after"])
def test_the_kind_of_sandbox_may_be_left_out(home, before):
    file = prowling(home)
    order = ["--sandbox", file] if before else [file, "--sandbox"]
    done = cosim(home, "run", *order, "--output-dir", "out", "--no-report")
    assert done.returncode == 0, done.stderr
    assert report(done)["read a private file"] == "secret"  # no FMU, so nobody is confined


def test_a_refused_scenario_leaves_no_folder(home):
    file = prowling(home, connections=[{"from": "p.z", "to": "q.u"}])
    done = cosim(home, "run", file, "--output-dir", "new/out", "--sandbox", "strict")
    assert done.returncode == 2
    assert "q" in done.stderr
    assert "connections" in done.stderr
    assert not (home / "new").exists()


def test_strict_sandbox_without_bubblewrap_is_refused_before_the_run(home, tmp_path):
    done = cosim(home, "run", prowling(home), "--sandbox", "strict", PATH=str(tmp_path))
    assert done.returncode == 2
    assert done.stderr.startswith("the strict sandbox needs bubblewrap")
    assert not (home / "runs").exists()


def test_a_bubblewrap_that_does_not_start_the_command_is_a_failure(home):
    (home / "bwrap").write_text("#!/bin/sh\nexit 0\n")
    (home / "bwrap").chmod(0o755)
    done = cosim(home, "run", prowling(home), "--sandbox", "strict", PATH=f"{home}:/bin")
    assert (done.returncode, done.stderr) == (
        2,
        "bubblewrap could not start the command (exit code 0)\n",
    )
    assert not (home / "runs").exists()


@pytest.mark.parametrize("place", ["project", "."], ids=["folder of the scenario", "folder above"])
def test_the_home_folder_is_not_opened(home, place):
    done = cosim(
        home,
        "run",
        prowling(home),
        "--output-dir",
        "out",
        "--sandbox",
        "strict",
        HOME=str((home / place).resolve()),
    )
    assert (done.returncode, (home / "out").exists()) == (
        (2, False) if place == "project" else (0, True)
    ), done.stderr
    assert ("contains the home folder" in done.stderr) is (place == "project")


def test_results_are_not_written_to_the_home_folder(home):
    done = cosim(
        home, "run", prowling(home), "--output-dir", ".", "--sandbox", "strict", HOME=str(home)
    )
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert f'"{home}" holds a file or the results of this run' in done.stderr


def test_the_environment_inside_is_a_listed_one(home):
    probe = (home / "project/sandbox_probe.py").read_text()
    (home / "project/sandbox_probe.py").write_text(probe + "\nprint(sorted(os.environ))\n")
    done = cosim(
        home,
        "run",
        prowling(home),
        "--output-dir",
        "out",
        "--no-report",
        "--sandbox",
        "strict",
        PRIVATE="x",
        LC_ALL="C",
    )
    assert done.returncode == 0, done.stderr
    assert "PRIVATE" not in done.stdout + done.stderr
    assert "'LC_ALL'" in done.stdout + done.stderr


def test_strict_sandbox_of_a_single_fmu(home, probe):
    done = cosim(home, "simulate", probe, "--output-file", "out/x.csv", "--sandbox", "strict")
    assert done.returncode == 0, done.stderr
    free = cosim(home, "simulate", probe, "--output-file", "free.csv")
    assert free.returncode == 0, free.stderr
    assert (home / "out/x.csv").read_bytes() == (home / "free.csv").read_bytes()


def slow(home: Path) -> subprocess.Popen[str]:
    """Long real-time run that has written rows."""
    order = (
        "run",
        prowling(home, stop_time=1000),
        "--output-dir",
        "out",
        "--no-report",
        "--sandbox",
        "strict",
        "--real-time",
    )
    process = subprocess.Popen(
        words(*order), cwd=home, env=variables(home), stderr=subprocess.PIPE, text=True
    )
    latest = time.monotonic() + 60
    while not (home / "out/result.csv").exists() and time.monotonic() < latest:
        time.sleep(0.02)
    return process


def marked(home: Path) -> list[str]:
    """Return the processes of the run, found by their environment."""
    found = []
    for entry in Path("/proc").iterdir():
        try:
            if (
                entry.name.isdigit()
                and f"TMPDIR={home / 'tmp'}".encode() in (entry / "environ").read_bytes()
            ):
                found.append(entry.name)
        except OSError:
            continue
    return found


def test_an_interrupt_reaches_the_run_inside(home):
    process = slow(home)
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=30)
    assert process.returncode == 130, errors
    assert "rows until t = " in errors
    assert (marked(home), list((home / "tmp").iterdir())) == ([], [])


def test_nothing_inside_outlives_a_killed_command(home):
    process = slow(home)
    assert len(marked(home)) >= 4  # this command, bubblewrap, and the two of the run
    process.kill()
    process.communicate(timeout=30)
    latest = time.monotonic() + 10
    while marked(home) and time.monotonic() < latest:
        time.sleep(0.02)
    assert marked(home) == []
