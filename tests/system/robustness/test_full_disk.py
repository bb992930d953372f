"""Disks that are full or may not be written: a line that says so, whole files or none, and nothing left behind."""

from __future__ import annotations

import ctypes
import json
import os
import shutil
import struct
import subprocess
import sys
from pathlib import Path

import pytest
from command_folder import TICKER, CommandFolder

import cosim
from cosim.core import resources

FULL = "No space left on device"
RUN = ("--output-dir", "out")
FMU = resources.root() / "fmus" / "strider.fmu"
PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1
#: operations on the disk of a run of less than half a second, and of one that lasts
SHORT, LONG = {"stop": 0.5, "arguments": {"pause": 0}}, {"stop": 1.5, "arguments": {"pause": 0.01}}


def kept(workplace: CommandFolder) -> int:
    """Rows of the result file, which are good whatever happened."""
    if not (workplace.out / "result.csv").exists():
        return 0
    result = cosim.Result.from_csv(workplace.out / "result.csv")
    assert result["ticker.count"].tolist() == list(range(len(result.time)))
    return len(result.time)


@pytest.fixture(scope="session")
def full_disk(tmp_path_factory: pytest.TempPathFactory) -> Path:
    library = tmp_path_factory.mktemp("full") / "full_disk.so"
    compiler = os.environ.get("CC") or shutil.which("cc") or "gcc"
    source = Path(__file__).parent / "full_disk.c"
    subprocess.run([compiler, "-shared", "-fPIC", "-O1", source, "-o", library, "-ldl"], check=True)
    return library


class Disk(CommandFolder):
    """A place whose folder out is on a disk that is full after `operations`."""

    def __init__(self, folder: Path, library: Path, operations: int):
        super().__init__(folder)
        self.operations, self._left = operations, folder / "left"
        self._left.write_bytes(struct.pack("l", operations))
        self._environment = {"LD_PRELOAD": str(library), "FULL_DISK": str(self.out), "FULL_DISK_LEFT": str(self._left)}

    def begin(self, **scenario: object) -> None:
        figure = {"name": "picture", "python": f"{TICKER}:plot_count"}
        file = self.scenario(figures=[figure], **scenario)
        self.process = self.start("run", file, *RUN, environment=self._environment)

    def end(self) -> bool:
        """Judge what came of the run; whether the disk was full."""
        _, errors = self.process.communicate(timeout=100)
        full = struct.unpack("l", self._left.read_bytes())[0] < 0
        where = f"{self.operations} operations: {errors}"
        assert self.leftovers() == [], where
        rows, whole = kept(self), round(1 + 100 * self._stop())
        assert rows <= whole
        if self.process.returncode == 0:
            assert rows == whole, where
            assert (self.out / "picture.png").exists(), where
            assert (self.out / "run.json").exists(), where
            return full
        assert full, where
        assert self.process.returncode == 1, where
        assert errors.count(FULL) == 1, where
        assert "Traceback" not in errors, where
        return True

    def _stop(self) -> float:
        return float(json.loads((self.folder / "robust.json").read_text())["stop_time"])


@pytest.mark.parametrize(("kind", "numbers"), [(SHORT, (0, 6, 12)), (LONG, (2, 9))], ids=["short", "long"])
def test_a_disk_that_is_full_after_some_operations(full_disk, tmp_path, kind, numbers):
    disks = [Disk(tmp_path / str(n), full_disk, n) for n in numbers]
    for disk in disks:
        disk.begin(**kind)
    assert all(disk.end() for disk in disks)


@pytest.mark.long
@pytest.mark.parametrize("kind", [SHORT, LONG], ids=["short", "long"])
def test_a_disk_that_is_full_after_each_number_of_operations(full_disk, tmp_path, kind):
    """Until there is room for the whole run."""
    for n in range(100):
        disk = Disk(tmp_path / str(n), full_disk, n)
        disk.begin(**kind)
        if not disk.end():
            break
    assert 15 < n < 99


def test_a_real_disk_that_is_too_small_for_the_result(tmp_path):
    """30 000 rows: their numbers fit, their texts do not."""
    workplace = CommandFolder(tmp_path / "work")
    file = workplace.scenario(300, arguments={"pause": 0})
    script = f"""mkdir out && mount -t tmpfs -o size=1200k none out || exit 99
        {sys.executable} -m cosim run {file} --output-dir out --no-report; code=$?
        mkdir kept; cp out/result.csv kept; find out -mindepth 1 -not -name result.csv > others; exit $code"""
    variables = {**os.environ, "TMPDIR": str(workplace.tmp), "WORKPLACE": str(workplace.folder)}
    words = ["unshare", "-rm", "sh", "-c", script]
    done = subprocess.run(words, cwd=workplace.folder, env=variables, capture_output=True, text=True, check=False)
    if done.returncode == 99 or "unshare" in done.stderr:
        pytest.skip("no disk can be mounted here")
    assert done.returncode == 1, done.stderr
    assert done.stderr.count(FULL) == 1
    assert (workplace.folder / "others").read_text() == ""
    workplace.out = workplace.folder / "kept"
    assert kept(workplace) < 30_001
    assert list(workplace.tmp.iterdir()) == []


def without_privileges() -> None:
    """From the next program on, the file mode counts for root too."""
    ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0)


def writing(command: str, folder: str) -> tuple[object, ...]:
    """The words of a command that writes its result to a folder."""
    return {
        "run": ("run", "robust.json", "--output-dir", folder),
        "simulate": ("simulate", FMU, "--output-file", f"{folder}/x.csv"),
    }[command]


@pytest.mark.parametrize("parent", ["out", "."])
@pytest.mark.parametrize("command", ["run", "simulate"])
def test_a_folder_that_may_not_be_written(workplace, command, parent):
    workplace.scenario(0.1)
    workplace.out.mkdir()
    folder = workplace.folder / parent
    folder.chmod(0o555)
    done = workplace.run(*writing(command, f"{parent}/new"), preexec_fn=without_privileges)
    folder.chmod(0o755)
    assert done.returncode == 2, done.stderr
    assert done.stderr.splitlines() == [f'cannot write to "{folder / "new"}": Permission denied']
    assert workplace.leftovers() == []


@pytest.mark.parametrize("command", ["run", "simulate"])
def test_a_file_where_a_folder_should_be(workplace, command):
    workplace.scenario(0.1)
    (workplace.folder / "file").write_text("mine")
    done = workplace.run(*writing(command, "file"))
    assert done.returncode == 2
    assert done.stderr.splitlines() == [f'cannot write to "{workplace.folder / "file"}": File exists']
    assert (workplace.folder / "file").read_text() == "mine"
    assert workplace.leftovers() == []


def test_a_folder_where_the_result_should_be(workplace):
    (workplace.out / "result.csv").mkdir(parents=True)
    done = workplace.run("run", workplace.scenario(0.1), *RUN)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [f'cannot replace "{workplace.out / "result.csv"}": Is a directory']
    assert workplace.leftovers() == []


def test_a_path_as_long_as_paths_may_be(workplace):
    """Longer than the marks that two processes of a run exchange in memory."""
    words = ("run", workplace.scenario(0.1), "--output-dir", "/".join(["d" * 200] * 17))
    done = workplace.run(*words)
    assert done.returncode == 0, done.stderr
    assert workplace.leftovers() == []
