"""Functions that run on a worker of a Dask cluster.

Storage of files by content hash, and execution of jobs.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from ...results.files import write_file
from .bundle import cosim_fingerprint, fmu_paths
from .job import Job, RunKey, StudyContext
from .worker_pool import WorkerPool

_pools_lock = threading.Lock()
_worker_pools: dict[tuple[str, float | None], WorkerPool] = {}


@dataclass(frozen=True)
class StudyPackage:
    """Data that a worker needs to run the jobs of a study.

    Attributes:
        digest: hash of all files and of cosim.
        identity: fingerprint of the cosim that the worker must have.
        scenario: path of the scenario's file among `files`.
        files: content hash (SHA-256) of each file by its path.
        deadline: largest wall time of a run (s); None: no limit.
    """

    digest: str
    identity: str
    scenario: str
    files: Mapping[str, str]
    deadline: float | None


def fingerprint_probe() -> Callable[[], str]:
    """Return a function that returns the fingerprint of the worker's cosim.

    Dask sends it by value, so that it also runs on a worker without cosim.
    """

    def fingerprint() -> str:
        try:
            from cosim.studies.execution.bundle import cosim_fingerprint
        except ImportError:
            return "no cosim, or one without sweeps"
        return cosim_fingerprint()

    return fingerprint


def missing_hashes(files: Mapping[str, str], dask_worker: Any) -> list[str]:
    """Return the content hashes of the files that this worker lacks."""
    contents = _contents_folder(dask_worker)
    return sorted({sha for sha in files.values() if not (contents / sha).is_file()})


def store_contents(blobs: Mapping[str, bytes], dask_worker: Any) -> None:
    """Store contents under their hash.

    Raises:
        ValueError: if a content does not match its hash.
    """
    folder = _contents_folder(dask_worker)
    for sha, content in blobs.items():
        if sha256(content).hexdigest() != sha:
            raise ValueError(f"the content {sha} was damaged during the transfer")
        write_file(folder / sha, content)


def run_job(
    package: StudyPackage, key: RunKey, settings: Mapping[str, Any], check: bool
) -> dict[str, Any]:
    """Run or check a job on this worker and return the answer.

    Returns:
        {"record": ...} after a run and {"problems": ...} after a check; {"refused": fingerprint} if
        the worker has another cosim, and {"missing": True} if it lacks files.
    """
    from distributed import get_worker

    worker = get_worker()
    if _own_fingerprint() != package.identity:
        return {"worker": worker.address, "refused": _own_fingerprint()}
    if missing_hashes(package.files, worker):
        return {"worker": worker.address, "missing": True}
    pool, job = _worker_pool(package, worker), Job(key, settings)
    if check:
        return {"problems": [(problem.message, problem.where) for problem in pool.check(job)]}
    return {"record": pool.run(job).to_json()}


@cache
def _own_fingerprint() -> str:
    return cosim_fingerprint()


def _worker_pool(package: StudyPackage, worker: Any) -> WorkerPool:
    with _pools_lock:
        study = (package.digest, package.deadline)
        if study not in _worker_pools:
            root = _link_study_files(package, worker)
            context = StudyContext(
                root / package.scenario, root, package.deadline, fmu_paths(package.files)
            )
            _worker_pools[study] = WorkerPool(context)
        return _worker_pools[study]


def _contents_folder(worker: Any) -> Path:
    return _worker_folder(worker, "contents")


def _worker_folder(worker: Any, name: str) -> Path:
    folder = Path(worker.local_directory).resolve() / "cosim" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _link_study_files(package: StudyPackage, worker: Any) -> Path:
    """Link the stored files of a study into a folder, as its scenario expects them, and return the folder."""
    root = _worker_folder(worker, "trees") / package.digest
    for path, sha in package.files.items():
        file = root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.exists():
            os.link(_contents_folder(worker) / sha, file)
    return root
