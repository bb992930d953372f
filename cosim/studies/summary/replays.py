"""Replay pages of single runs of a sweep.

Each is named after the key of its run and a hash of its texts, so that it is written once and
belongs to one sweep only.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from hashlib import sha256
from pathlib import Path

from ...results.files import remove_files
from ..execution.job import Job, Record
from ..execution.local import LocalRunner
from ..execution.run import ReplayRequest
from ..execution.worker_pool import WorkerPool
from ..sweep import Sweep
from .run_commands import run_settings

REPLAY_FOLDER = "replays"


def replay_path(sweep: Sweep, run: int) -> str:
    """Return the path of a run's replay, relative to the folder of the sweep."""
    text = json.dumps([_replay_title(sweep, run), sweep.criteria])
    return f"{REPLAY_FOLDER}/{sweep.keys[run]}-{sha256(text.encode()).hexdigest()[:8]}.html"


def remove_foreign_replays(sweep: Sweep, folder: Path) -> None:
    """Remove replays of runs that are not part of the sweep.

    Of another sweep, or of earlier versions of its files.
    """
    pages = list((folder / REPLAY_FOLDER).glob("*.html"))
    own = {Path(replay_path(sweep, run)).name for run in range(len(sweep))} if pages else set()
    remove_files(folder / REPLAY_FOLDER, *(page.name for page in pages if page.name not in own))


def write_replays(sweep: Sweep, runs: Iterable[int], folder: Path, workers: int) -> dict[int, str]:
    """Write the missing replays by repeating their runs.

    Return the failure of each run whose replay is still missing.
    """
    pages = {run: folder / replay_path(sweep, run) for run in dict.fromkeys(runs)}
    missing = {run: page for run, page in pages.items() if not page.exists()}
    (folder / REPLAY_FOLDER).mkdir(exist_ok=True)
    with LocalRunner(sweep.study.context, workers) as runner, ThreadPoolExecutor(workers) as pool:
        records = pool.map(
            partial(_write_replay, sweep, runner.worker_pool), missing, missing.values()
        )
        causes = {run: record.failure for run, record in zip(missing, records, strict=True)}
    return {run: causes[run] for run, page in missing.items() if not page.exists()}


def _write_replay(sweep: Sweep, pool: WorkerPool, run: int, page: Path) -> Record:
    job = Job(sweep.keys[run], run_settings(sweep, run))
    return pool.replay(
        job, ReplayRequest(_replay_title(sweep, run), str(page.resolve()), sweep.criteria)
    )


def _replay_title(sweep: Sweep, run: int) -> str:
    labels = ", ".join(f"{name} {label}" for name, label in sweep.design[run].labels.items())
    return f"{sweep.study_file.spec.name} run {run}: {labels}"
