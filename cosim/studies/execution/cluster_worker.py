"""What happens on a worker of a cluster: files are kept by content hash, and jobs run as on any other machine."""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from .bundle import cosim_fingerprint, fmu_paths
from .job import Job, StudyContext
from .worker_pool import WorkerPool

_pools_lock = threading.Lock()
_worker_pools: dict[tuple[str, float | None], WorkerPool] = {}


@dataclass(frozen=True)
class StudyPackage:
    """What a worker must have to run the jobs of a study: files by their path, and a run's deadline (s)."""

    digest: str
    identity: str
    scenario: str
    files: Mapping[str, str]
    deadline: float | None


def fingerprint_probe() -> Callable[[], str]:
    """A function that says which cosim a worker has, if any; it travels by value, so it needs none to run."""

    def found() -> str:
        try:
            from cosim.studies.execution.bundle import cosim_fingerprint
        except ImportError:
            return "no cosim, or one without sweeps"
        return cosim_fingerprint()

    return found


def missing_hashes(files: Mapping[str, str], dask_worker: Any) -> list[str]:
    """Hashes of contents that this worker does not have."""
    contents = _contents_folder(dask_worker)
    return sorted({sha for sha in files.values() if not (contents / sha).is_file()})


def store_contents(blobs: Mapping[str, bytes], dask_worker: Any) -> None:
    """Keep contents under their hash. Raises ValueError when one is not what its hash says."""
    folder = _contents_folder(dask_worker)
    for sha, content in blobs.items():
        if sha256(content).hexdigest() != sha:
            raise ValueError(f"the content {sha} was damaged on its way")
        part = folder / f"{sha}.{os.getpid()}.part"
        part.write_bytes(content)
        part.replace(folder / sha)


def run_job(cargo: StudyPackage, key: str, settings: Mapping[str, Any], check: bool) -> dict[str, Any]:
    """Run or check a job; the answer says instead what this worker lacks ("missing") or why it cannot ("refused")."""
    from distributed import get_worker

    worker = get_worker()
    if _own_fingerprint() != cargo.identity:
        return {"worker": worker.address, "refused": _own_fingerprint()}
    if missing_hashes(cargo.files, worker):
        return {"worker": worker.address, "missing": True}
    shop, job = _worker_pool(cargo, worker), Job(key, settings)
    if check:
        return {"problems": [(problem.message, problem.where) for problem in shop.check(job)]}
    return {"record": shop.run(job).to_json()}


@cache
def _own_fingerprint() -> str:
    return cosim_fingerprint()


def _worker_pool(cargo: StudyPackage, worker: Any) -> WorkerPool:
    with _pools_lock:
        place = (cargo.digest, cargo.deadline)
        if place not in _worker_pools:
            root = _link_study_files(cargo, worker)
            _worker_pools[place] = WorkerPool(StudyContext(root / cargo.scenario, root, cargo.deadline, fmu_paths(cargo.files)))
        return _worker_pools[place]


def _contents_folder(worker: Any) -> Path:
    return _worker_folder(worker, "contents")


def _worker_folder(worker: Any, name: str) -> Path:
    folder = Path(worker.local_directory).resolve() / "cosim" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _link_study_files(cargo: StudyPackage, worker: Any) -> Path:
    """The files of a study where its scenario looks for them."""
    root = _worker_folder(worker, "trees") / cargo.digest
    for path, sha in cargo.files.items():
        file = root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.exists():
            os.link(_contents_folder(worker) / sha, file)
    return root
