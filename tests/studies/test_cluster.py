"""`cosim sweep --scheduler` on a real scheduler with workers on loopback."""

from __future__ import annotations

import shutil
import time

import pytest
from cosim_command import run_cosim
from dask_cluster import DaskCluster, running_cluster
from lag_project import SEGV_ORDER, descendants, is_alive

import cosim
from cosim.core.resources import root

pytestmark = pytest.mark.slow

pytest.importorskip("distributed")

LEVELS = {
    f"run {run}": {"lag.y_start": 1 + run / 100, "lag.fault": SEGV_ORDER if run == 3 else ""}
    for run in range(8)
}
FACTORS = [{"name": "level", "levels": LEVELS}]
#: a sweep of 30 runs of about 0.1 s each
SLOW = {
    "factors": [
        {"name": "start", "set": "lag.y_start", "values": [1 + run / 10 for run in range(30)]}
    ],
    "settings": {"/stop_time": 100, "/record/interval": 1},
}


@pytest.mark.parametrize("command", ["sweep", "tune"])
def test_the_option_says_that_a_cluster_is_trusted(command):
    """Dask unpickles answers; no test can make that safe."""
    text = " ".join(run_cosim(command, "--help").stdout.split())
    assert "Only for a cluster that you trust: Dask unpickles its answers" in text


@pytest.mark.parametrize("document", ["SECURITY.md", "docs/sweeps.md"])
def test_documents_say_that_a_cluster_is_trusted_in_both_directions(document):
    assert "trusted in both directions" in (root() / document).read_text()


@pytest.fixture(scope="module")  # its processes are busy also when nobody uses them
def two_workers(tmp_path_factory):
    with running_cluster(tmp_path_factory.mktemp("cluster")) as made:
        yield made


def test_a_cluster_writes_the_same_files_as_a_local_sweep(lag, two_workers):
    sweep = lag.write(factors=FACTORS)
    local = lag.run_command("sweep", sweep, "--output-dir", "local")
    away = lag.run_command(
        "sweep", sweep, "--scheduler", two_workers.address, "--output-dir", "cluster"
    )
    assert (local.code, away.code) == (1, 1), away.err
    for name in ("table.csv", "aggregates.csv", "success.csv"):
        assert (lag.folder / "local" / name).read_bytes() == (
            lag.folder / "cluster" / name
        ).read_bytes(), name
    shipped = list(two_workers.folder.glob("scratch/**/trees/*/lag.fmu"))
    assert {file.read_bytes() for file in shipped} == {(lag.folder / "lag.fmu").read_bytes()}


def test_an_unknown_variable_is_refused_before_the_first_run(lag, two_workers):
    sweep = lag.write(factors=[{"name": "T", "set": "lag.Tau", "values": [1.0]}])
    done = lag.run_command("sweep", sweep, "--scheduler", two_workers.address)
    assert done.code == 2
    assert "$.factors[0].set" in done.err
    assert 'component "lag" has no variable "Tau"' in done.err
    assert lag.records() == []


def test_absolute_paths_are_refused(make_lag, two_workers):
    lag = make_lag()
    place = {"/components/lag/fmu": str(lag.folder / "lag.fmu")}
    sweep = lag.write(factors=[{"name": "fmu", "levels": {"here": place}}])
    done = lag.run_command("sweep", sweep, "--scheduler", two_workers.address)
    assert done.code == 2
    assert "cannot be shipped to a cluster" in done.err


def test_a_sweep_is_refused_when_no_scheduler_answers(lag, monkeypatch):
    monkeypatch.setattr("cosim.studies.cluster._CONNECT_TIMEOUT", 1.0)
    done = lag.run_command("sweep", lag.write(factors=FACTORS), "--scheduler", "tcp://127.0.0.1:9")
    assert done.code == 2
    assert 'no Dask scheduler answers at "tcp://127.0.0.1:9"' in done.err


@pytest.mark.long
def test_a_worker_with_another_cosim_is_refused(lag, tmp_path):
    shutil.copytree(
        root() / "cosim",
        tmp_path / "other" / "cosim",
        ignore=shutil.ignore_patterns("__pycache__", "_bundle"),
    )
    with (tmp_path / "other/cosim/core/__init__.py").open("a") as file:
        file.write('\n__version__ = "0.0.9"\n')
    with running_cluster(tmp_path, workers=0) as made:
        made.workers.append(made.start_worker(PYTHONPATH=str(tmp_path / "other")))
        done = lag.run_command("sweep", lag.write(factors=FACTORS), "--scheduler", made.address)
    assert done.code == 2
    assert "has cosim 0.0.9 (" in done.err
    assert f"expected {cosim.__version__} (" in done.err


def start_sweep(lag, made: DaskCluster):
    """Start a sweep on a cluster and wait until some runs have finished."""
    process = lag.start_command("sweep", lag.write(**SLOW), "--scheduler", made.address)
    end = time.monotonic() + 60
    while len(lag.records()) < 3:
        assert process.poll() is None, (made.folder / "log").read_text()
        assert time.monotonic() < end, (made.folder / "log").read_text()
        time.sleep(0.02)
    return process


@pytest.mark.long
def test_killed_workers_are_replaced(lag, tmp_path):
    with running_cluster(tmp_path) as made:
        process = start_sweep(lag, made)
        victim, below = made.workers[0], descendants(made.workers[0].pid)
        victim.kill()
        victim.wait()
        made.workers.append(made.start_worker())
        _, err = process.communicate(timeout=120)
        assert process.returncode == 0, err
        assert not any("failure" in record for record in lag.records())
        assert len({record["key"] for record in lag.records()}) == len(lag.records()) == 30
        assert not any(map(is_alive, below))


@pytest.mark.long
def test_another_scheduler_continues_a_sweep_after_the_first_was_killed(lag, tmp_path):
    (tmp_path / "first").mkdir()
    (tmp_path / "second").mkdir()
    with running_cluster(tmp_path / "first") as made:
        process = start_sweep(lag, made)
        made.scheduler.kill()
        _, err = process.communicate(timeout=120)
        assert process.returncode == 1
        assert "the connection to the scheduler" in err
        before = lag.records()
        assert 3 <= len(before) < 30
    with running_cluster(tmp_path / "second") as made:
        assert lag.run_command("sweep", "sweep.json", "--scheduler", made.address).code == 0
    assert lag.records()[: len(before)] == before
    assert len({record["key"] for record in lag.records()}) == len(lag.records()) == 30
