"""Replay pages of single runs of a sweep; each is named after the key of its run, so that it is written once."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from ..execution.job import Job, Record
from ..execution.local import LocalRunner
from ..execution.worker_pool import WorkerPool
from ..sweep import Sweep
from .run_commands import run_settings

REPLAY_FOLDER = "replays"


def replay_path(sweep: Sweep, run: int) -> str:
    """Return the path of a run's replay, relative to the folder of the sweep."""
    return f"{REPLAY_FOLDER}/{sweep.keys[run]}.html"


def write_replays(sweep: Sweep, runs: Iterable[int], folder: Path, workers: int) -> dict[int, str]:
    """Write the missing replays by repeating their runs; return the failure of each run whose replay is still missing."""
    pages = {run: folder / replay_path(sweep, run) for run in dict.fromkeys(runs)}
    missing = {run: page for run, page in pages.items() if not page.exists()}
    (folder / REPLAY_FOLDER).mkdir(exist_ok=True)
    with LocalRunner(sweep.study.context, workers) as runner, ThreadPoolExecutor(workers) as pool:
        records = pool.map(partial(_write_replay, sweep, runner.worker_pool), missing, missing.values())
        causes = {run: record.failure for run, record in zip(missing, records, strict=True)}
    return {run: causes[run] for run, page in missing.items() if not page.exists()}


def _write_replay(sweep: Sweep, pool: WorkerPool, run: int, page: Path) -> Record:
    labels = ", ".join(f"{name} {label}" for name, label in sweep.design[run].labels.items())
    job = Job(sweep.keys[run], run_settings(sweep, run))
    return pool.replay(job, f"{sweep.study_file.spec.name} run {run}: {labels}", page)
