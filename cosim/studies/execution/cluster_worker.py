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

from .bundle import fmus, identity
from .job import Job, Order
from .worker_pool import Shop

_lock = threading.Lock()
_shops: dict[tuple[str, float | None], Shop] = {}


@dataclass(frozen=True)
class Cargo:
    """What a worker must have to run the jobs of a study: files by their path, and a run's deadline (s)."""

    digest: str
    identity: str
    scenario: str
    files: Mapping[str, str]
    deadline: float | None


def probe() -> Callable[[], str]:
    """A function that says which cosim a worker has, if any; it travels by value, so it needs none to run."""

    def found() -> str:
        try:
            from cosim.studies.execution.bundle import identity
        except ImportError:
            return "no cosim, or one without sweeps"
        return identity()

    return found


def missing(files: Mapping[str, str], dask_worker: Any) -> list[str]:
    """Hashes of contents that this worker does not have."""
    contents = _contents(dask_worker)
    return sorted({sha for sha in files.values() if not (contents / sha).is_file()})


def receive(blobs: Mapping[str, bytes], dask_worker: Any) -> None:
    """Keep contents under their hash. Raises ValueError when one is not what its hash says."""
    folder = _contents(dask_worker)
    for sha, content in blobs.items():
        if sha256(content).hexdigest() != sha:
            raise ValueError(f"the content {sha} was damaged on its way")
        part = folder / f"{sha}.{os.getpid()}.part"
        part.write_bytes(content)
        part.replace(folder / sha)


def work(cargo: Cargo, key: str, settings: Mapping[str, Any], check: bool) -> dict[str, Any]:
    """Run or check a job; the answer says instead what this worker lacks ("missing") or why it cannot ("refused")."""
    from distributed import get_worker

    worker = get_worker()
    if _identity() != cargo.identity:
        return {"worker": worker.address, "refused": _identity()}
    if missing(cargo.files, worker):
        return {"worker": worker.address, "missing": True}
    shop, job = _shop(cargo, worker), Job(key, settings)
    if check:
        return {"problems": [(problem.message, problem.where) for problem in shop.check(job)]}
    return {"record": shop.run(job).to_json()}


@cache
def _identity() -> str:
    return identity()


def _shop(cargo: Cargo, worker: Any) -> Shop:
    with _lock:
        place = (cargo.digest, cargo.deadline)
        if place not in _shops:
            root = _tree(cargo, worker)
            _shops[place] = Shop(Order(root / cargo.scenario, root, cargo.deadline, fmus(cargo.files)))
        return _shops[place]


def _contents(worker: Any) -> Path:
    return _folder(worker, "contents")


def _folder(worker: Any, name: str) -> Path:
    folder = Path(worker.local_directory).resolve() / "cosim" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def _tree(cargo: Cargo, worker: Any) -> Path:
    """The files of a study where its scenario looks for them."""
    root = _folder(worker, "trees") / cargo.digest
    for path, sha in cargo.files.items():
        file = root / path
        file.parent.mkdir(parents=True, exist_ok=True)
        if not file.exists():
            os.link(_contents(worker) / sha, file)
    return root
