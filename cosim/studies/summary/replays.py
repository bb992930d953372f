"""Replays of single runs of a sweep: one page each, called after the key of its run, so that it is made once."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

from ..execution.job import Job, Record
from ..execution.local import LocalEngine
from ..execution.worker_pool import Shop
from ..sweep import Sweep

FOLDER = "replays"


def page_of(sweep: Sweep, run: int) -> str:
    """Where the replay of a run is, in the folder of the sweep."""
    return f"{FOLDER}/{sweep.keys[run]}.html"


def settings_of(sweep: Sweep, run: int) -> dict[str, Any]:
    """Settings that show a run: it records all that the scenario itself records, not only what the sweep needs."""
    settings = sweep.study.job(sweep.design[run].settings).settings
    return {name: value for name, value in settings.items() if not name.startswith("/record")}


def write_replays(sweep: Sweep, runs: Iterable[int], folder: Path, workers: int) -> dict[int, str]:
    """Run these runs again and write their replays where there is none; returns the cause for each that could not be written."""
    pages = {run: folder / page_of(sweep, run) for run in dict.fromkeys(runs)}
    missing = {run: page for run, page in pages.items() if not page.exists()}
    (folder / FOLDER).mkdir(exist_ok=True)
    with LocalEngine(sweep.study.order, workers) as engine, ThreadPoolExecutor(workers) as pool:
        records = pool.map(partial(_write, sweep, engine.shop), missing, missing.values())
        causes = {run: record.failure for run, record in zip(missing, records, strict=True)}
    return {run: causes[run] for run, page in missing.items() if not page.exists()}


def _write(sweep: Sweep, shop: Shop, run: int, page: Path) -> Record:
    labels = ", ".join(f"{name} {label}" for name, label in sweep.design[run].labels.items())
    job = Job(sweep.keys[run], settings_of(sweep, run))
    return shop.replay(job, f"{sweep.read.spec.name} run {run}: {labels}", page)
