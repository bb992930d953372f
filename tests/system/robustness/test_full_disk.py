"""Disks that are full or may not be written: a line that says so, whole files or none, and no row
lost.
"""

from __future__ import annotations

import ctypes
import json
import os
import re
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
FMU = resources.root() / "fmus" / "strider_autopilot.fmu"
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
        self._environment = {
            "LD_PRELOAD": str(library),
            "FULL_DISK": str(self.out),
            "FULL_DISK_LEFT": str(self._left),
        }

    def begin(self, **scenario: object) -> None:
        figure = {"name": "picture", "python": f"{TICKER}:plot_count"}
        file = self.scenario(figures=[figure], **scenario)
        self.process = self.start("run", file, *RUN, environment=self._environment)

    def end(self) -> bool:
        """Judge what came of the run; whether the disk was full."""
        _, errors = self.process.communicate(timeout=100)
        full = struct.unpack("l", self._left.read_bytes())[0] < 0
        where = f"{self.operations} operations: {errors}"
        rows, whole = kept(self), round(1 + 100 * self._stop())
        assert rows <= whole
        if "`cosim recover out`" in errors:
            rows = self.recover(errors)
        assert self.leftovers() == [], where
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

    def recover(self, errors: str) -> int:
        """Write the rows that were kept, with space on the disk, and return their number."""
        done = self.run("recover", "out")
        assert done.returncode == 0, done.stderr
        rows = kept(self)
        assert f"; kept {rows} row" in errors
        return rows

    def _stop(self) -> float:
        return float(json.loads((self.folder / "robust.json").read_text())["stop_time"])


@pytest.mark.parametrize(
    ("kind", "numbers"), [(SHORT, (0, 6, 12)), (LONG, (2, 9))], ids=["short", "long"]
)
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


def on_small_disk(
    workplace: CommandFolder, size: str, *scripts: str
) -> subprocess.CompletedProcess[str]:
    """Run commands in the folder out on a separate disk, and copy its files to the folder kept."""
    cosim_command = f"{sys.executable} -m cosim"
    script = (
        f"mkdir out && mount -t tmpfs -o size={size} none out || exit 99\n"
        + "\n".join(scripts)
        + "\ncp -r out kept; exit $code"
    )
    variables = {
        **os.environ,
        "TMPDIR": str(workplace.tmp),
        "WORKPLACE": str(workplace.folder),
        "COSIM": cosim_command,
    }
    words = ["unshare", "-rm", "sh", "-c", script]
    done = subprocess.run(
        words, cwd=workplace.folder, env=variables, capture_output=True, text=True, check=False
    )
    if done.returncode == 99 or "unshare" in done.stderr:
        pytest.skip("no disk can be mounted here")
    workplace.out = workplace.folder / "kept"
    return done


RECOVER = "mount -o remount,size=100m out; $COSIM recover out >&2 || code=98"


@pytest.mark.parametrize("more", ["true", RECOVER], ids=["full", "recovered"])
def test_a_real_disk_that_is_too_small_for_the_result(tmp_path, more):
    """30 000 rows: their numbers fit, their texts do not."""
    workplace = CommandFolder(tmp_path / "work")
    workplace.scenario(300, arguments={"pause": 0})
    done = on_small_disk(
        workplace, "1500k", "$COSIM run robust.json --output-dir out --no-report; code=$?", more
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.count(FULL) == 1
    assert "free about 2 MB, then call `cosim recover out`" in done.stderr
    if more == RECOVER:
        assert sorted(path.name for path in workplace.out.iterdir()) == [
            "kpis.json",
            "result.csv",
            "run.json",
        ]
        assert f"{kept(workplace)} rows until t = " in done.stderr
    else:
        assert [path.name for path in workplace.out.iterdir() if path.name != "result.csv"] == [
            ".unfinished"
        ]
        assert kept(workplace) < 30_001
    assert list(workplace.tmp.iterdir()) == []


def test_all_rows_of_a_finished_run_are_kept(tmp_path):
    """The rows fit the disk, the CSV file does not; the recovered files are those of a run with
    enough space.
    """
    workplace = CommandFolder(tmp_path / "work")
    pilot = {"pilot": {"fmu": str(FMU)}}
    kpi = {"name": "rows", "python": f"{TICKER}:row_count"}
    workplace.scenario(
        2000,
        components=pilot,
        kpis=[kpi],
        record={"signals": ["pilot.thrust", "pilot.rudder_angle"]},
    )
    run = "$COSIM run robust.json --no-report --output-dir"
    done = on_small_disk(workplace, "5m", f"{run} out; code=$?", RECOVER, f"{run} whole >&2")
    assert done.returncode == 1, done.stderr
    assert "; kept 200001 rows: free about " in done.stderr
    for name in ("result.csv", "kpis.json"):
        assert (workplace.out / name).read_bytes() == (
            workplace.folder / "whole" / name
        ).read_bytes()
    whole, recovered = (
        json.loads((folder / "run.json").read_text())
        for folder in (workplace.folder / "whole", workplace.out)
    )
    assert whole.keys() == recovered.keys()
    assert whole | {"timing": {}} == recovered | {"timing": {}}


def test_one_fmu_alone_on_a_full_disk(tmp_path):
    workplace = CommandFolder(tmp_path / "work")
    simulate = (
        f"$COSIM simulate {FMU} --stop-time 1000 --step-size 0.01 --output-file out/x.csv; code=$?"
    )
    recover = RECOVER.replace("recover out", "recover out/x.csv")
    done = on_small_disk(workplace, "5500k", simulate, "test -e out/x.csv && code=97", recover)
    assert done.returncode == 1, done.stderr
    assert "; kept 100001 rows: free about " in done.stderr
    assert [path.name for path in workplace.out.iterdir()] == ["x.csv"]
    assert len(cosim.Result.from_csv(workplace.out / "x.csv").time) == 100_001


def test_a_result_that_cannot_be_written_for_another_reason(workplace):
    """A KPI function puts a folder where the result should be."""
    workplace.scenario(
        1.0, arguments={"pause": 0}, kpis=[{"name": "k", "python": f"{TICKER}:block_result"}]
    )
    done = workplace.run("run", "robust.json", *RUN, "--no-report")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.endswith("; kept 101 rows: remove the cause, then call `cosim recover out`")
    again = workplace.run("recover", "out")
    assert again.returncode == 2
    assert again.stderr.endswith("; remove the cause, then call `cosim recover out`\n")
    (workplace.out / "result.csv").rmdir()
    assert workplace.run("recover", "out").returncode == 0
    assert kept(workplace) == 101
    assert json.loads((workplace.out / "kpis.json").read_text()) == {"k.value": 1}
    assert workplace.leftovers() == []


def test_a_component_that_fails_on_a_full_disk_is_named(tmp_path):
    workplace = CommandFolder(tmp_path / "work")
    workplace.scenario(
        300, arguments={"pause": 0, "fail_at": 20_000}, record={"signals": ["ticker.count"]}
    )
    done = on_small_disk(
        workplace, "600k", "$COSIM run robust.json --output-dir out --no-report; code=$?"
    )
    assert done.returncode == 1
    full, failure = done.stderr.splitlines()
    assert "; kept 20000 rows: free about " in full
    assert failure.startswith("ticker: do_step failed at t = 199.99 s")


@pytest.mark.parametrize("output", ["nowhere", "empty", "robust.json"])
def test_nothing_to_recover(workplace, output):
    workplace.scenario(0.1)
    (workplace.folder / "empty").mkdir()
    done = workplace.run("recover", output)
    assert done.returncode == 2
    assert (
        done.stderr
        == f'no rows were kept for "{output}"; expected an output directory or an output file\n'
    )
    assert workplace.leftovers() == []


#: rows for about 1.1 GB
MANY = {
    "stop": 200_000,
    "arguments": {"pause": 0, "fail_at": 10},
    "record": {"signals": ["ticker.count"]},
}


@pytest.mark.parametrize("command", ["run", "run --isolation none"])
def test_a_small_temporary_folder_does_not_limit_the_rows_in_the_output_directory(
    tmp_path, command
):
    workplace = CommandFolder(tmp_path / "work")
    workplace.scenario(**MANY)
    done = on_small_disk(
        workplace,
        "20m",
        f"TMPDIR=$PWD/out $COSIM {command} robust.json --output-dir big --no-report; code=$?",
    )
    assert done.returncode == 1, done.stderr
    assert done.stderr.startswith("10 rows until t = 0.09 s kept in big\n")


def test_a_recording_larger_than_the_output_directory_is_refused_before_results_are_removed(
    tmp_path,
):
    workplace = CommandFolder(tmp_path / "work")
    workplace.scenario(**MANY)
    run = "$COSIM run robust.json --output-dir out --no-report"
    done = on_small_disk(workplace, "20m", f"{run} --stop-time 0.05 >&2", f"{run}; code=$?")
    assert done.returncode == 2, done.stderr
    where = re.escape(str(workplace.folder / "out"))
    text = (
        "robust.json:1:.* 20000001 rows of 1 signal take about 1.12 GB, 0.0.* GB are free in "
        f"{where}; make the step longer.*"
    )
    assert re.fullmatch(text, done.stderr.splitlines()[-1])
    assert kept(workplace) == 6


def test_one_fmu_alone_is_refused_before_its_former_result_is_removed(tmp_path):
    workplace = CommandFolder(tmp_path / "work")
    simulate = f"$COSIM simulate {FMU} --step-size 0.01 --output-file out/x.csv"
    done = on_small_disk(
        workplace, "20m", f"{simulate} --stop-time 1", f"{simulate} --stop-time 100000; code=$?"
    )
    assert done.returncode == 2, done.stderr
    assert "GB are free in" in done.stderr
    assert len(cosim.Result.from_csv(workplace.out / "x.csv").time) == 101


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
    file = workplace.folder / "file"
    message = {
        "run": f'cannot write to "{file}": File exists',
        "simulate": f'cannot write "{file / "x.csv"}": Not a directory',
    }
    assert done.stderr.splitlines() == [message[command]]
    assert (workplace.folder / "file").read_text() == "mine"
    assert workplace.leftovers() == []


def test_a_folder_where_the_result_should_be(workplace):
    (workplace.out / "result.csv").mkdir(parents=True)
    done = workplace.run("run", workplace.scenario(0.1), *RUN)
    assert done.returncode == 2
    assert done.stderr.splitlines() == [
        f'cannot replace "{workplace.out / "result.csv"}": Is a directory'
    ]
    assert workplace.leftovers() == []


def test_a_path_as_long_as_paths_may_be(workplace):
    """Longer than the marks that two processes of a run exchange in memory."""
    words = ("run", workplace.scenario(0.1), "--output-dir", "/".join(["d" * 200] * 17))
    done = workplace.run(*words)
    assert done.returncode == 0, done.stderr
    assert workplace.leftovers() == []
