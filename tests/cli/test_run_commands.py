"""`cosim run` in a real process: real time, parallel steps, Parquet."""

import json
import time

import pytest
from cosim_command import run_cosim
from slow_fmus import slow_fmu

from cosim.results import Result


def cosim_run(folder, fmus, *options, **algorithm):
    """Run one component per FMU (c0, c1, ... in one stage); return exit code, standard output and
    standard error.
    """
    components = {f"c{i}": {"fmu": str(fmu)} for i, fmu in enumerate(fmus)}
    document = {"name": "busy", "stop_time": 0.5, "step_size": 0.01, "components": components}
    (folder / "busy.json").write_text(
        json.dumps(document | {"algorithm": {"stages": [list(components)], **algorithm}})
    )
    done = run_cosim("run", "busy.json", "--output-dir", "out", *options, cwd=folder)
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("isolation", ["run", "none"])
def test_real_time_is_kept_and_reported(tmp_path, probes, isolation):
    began = time.monotonic()
    code, out, _ = cosim_run(tmp_path, [probes[2]], "--real-time", "0.5", "--isolation", isolation)
    assert code == 0
    assert time.monotonic() - began >= 1.0
    assert "paced to 0.5 times real time: " in out
    found = json.loads((tmp_path / "out/run.json").read_text())["real_time"]
    assert (found["factor"], found["steps"]) == (0.5, 50)


def test_the_real_time_factor_defaults_to_one(tmp_path, probes):
    assert "paced to 1 times real time: " in cosim_run(tmp_path, [probes[2]], "--real-time")[1]


def test_a_late_run_ends_and_keeps_its_rows_with_late_fail(tmp_path):
    slow = slow_fmu(tmp_path, "slow", 0.05, True)
    code, _, err = cosim_run(tmp_path, [slow], "--real-time", "--late", "fail")
    assert code == 1
    assert "too slow for 1 times real time: t = 0.01 s was reached 0.0" in err
    assert "2 rows until t = 0.01 s kept in out" in err


def test_a_crash_on_a_thread_names_all_components_of_the_stage(tmp_path):
    """Without threads, the failing component itself is named."""
    fmus = [
        slow_fmu(tmp_path, "good", 2e-4, True),
        slow_fmu(tmp_path, "bad", 2e-4, True, "FATAL_TIME=0.105"),
    ]
    code, _, err = cosim_run(tmp_path, fmus, parallel=True)
    assert code == 1
    assert (
        "one of c0, c1: parallel step failed at t = 0.11 s: the process was ended by signal 6 "
        "(SIGABRT"
    ) in err
    assert "12 rows until t = 0.11 s kept in" in err
    err = cosim_run(tmp_path, fmus, "--set", "/algorithm/parallel=false")[2]
    assert "c1: fmi2DoStep failed at t = 0.11 s: the process was ended by signal 6" in err


def test_parquet_holds_what_the_csv_file_holds(tmp_path, probes):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert cosim_run(tmp_path, [probes[2]], "--parquet")[0] == 0
    table = parquet.read_table(tmp_path / "out/result.parquet")
    csv = Result.from_csv(tmp_path / "out/result.csv")
    assert table.column_names == ["time", *csv]
    assert table["c0.y"].to_pylist() == csv["c0.y"].tolist()
