"""Runner of jobs on a Dask cluster (extra `cluster`), and the functions that run on its workers.

No shared file system is needed: files are sent to the workers that lack them, which store them by
content hash. Workers may join, leave and be killed.
"""

from __future__ import annotations

import logging
import os
import queue
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

from ..core.errors import CosimError, InputError, Problem
from ..results.files import write_file
from .execution.bundle import absolute_paths, cosim_fingerprint, fmu_paths
from .execution.job import Job, Record, RunKey, StudyContext
from .execution.worker_pool import MAX_ATTEMPTS, WorkerPool
from .study import Study

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
    contents = _worker_folder(dask_worker, "contents")
    return sorted({sha for sha in files.values() if not (contents / sha).is_file()})


def store_contents(blobs: Mapping[str, bytes], dask_worker: Any) -> None:
    """Store contents under their hash.

    Raises:
        ValueError: if a content does not match its hash.
    """
    folder = _worker_folder(dask_worker, "contents")
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


_own_fingerprint = cache(cosim_fingerprint)


def _worker_pool(package: StudyPackage, worker: Any) -> WorkerPool:
    with _pools_lock:
        study = (package.digest, package.deadline)
        if study not in _worker_pools:
            # links to the stored files, at the paths that the scenario expects
            root = _worker_folder(worker, "trees") / package.digest
            for path, sha in package.files.items():
                file = root / path
                file.parent.mkdir(parents=True, exist_ok=True)
                if not file.exists():
                    os.link(_worker_folder(worker, "contents") / sha, file)
            context = StudyContext(
                root / package.scenario, root, package.deadline, fmu_paths(package.files)
            )
            _worker_pools[study] = WorkerPool(context)
        return _worker_pools[study]


def _worker_folder(worker: Any, name: str) -> Path:
    folder = Path(worker.local_directory).resolve() / "cosim" / name
    folder.mkdir(parents=True, exist_ok=True)
    return folder


#: time limit for the scheduler to answer and to have a worker (s)
_CONNECT_TIMEOUT = 15.0
#: jobs submitted in advance per thread of the cluster
_JOBS_PER_THREAD = 3


class ClusterError(CosimError):
    """Failure of the cluster; finished runs are kept."""

    exit_code = 1


def require_cluster() -> None:
    """Raise InputError if the package `distributed` is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError(
            '--scheduler needs the package distributed: pip install "fmi-cosim[cluster]"'
        ) from None


class ClusterRunner:
    """Runner that submits jobs to a Dask scheduler; use it as a context manager."""

    def __init__(self, study: Study, scheduler: str):
        """Connect to a scheduler.

        Args:
            study: the study whose jobs are run.
            scheduler: its address, such as "tcp://host:8786".

        Raises:
            InputError: if no scheduler answers or if files cannot be shipped; on entering the
                context, if a worker has another cosim.
        """
        require_cluster()
        problems: dict[Problem, None] = {}
        for settings in study.all_setting_variants:
            found = absolute_paths(study.study_file.scenario, settings)
            problems |= dict.fromkeys(study.study_file.locate_problems(found, settings))
        if problems:
            raise InputError(problems)
        self._bundle, self._scheduler = study.bundle, scheduler
        files = dict(self._bundle.files)
        deadline = study.spec.deadline
        self._package = StudyPackage(
            self._bundle.digest, cosim_fingerprint(), str(self._bundle.scenario), files, deadline
        )
        self._finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._client = _connect_client(scheduler)

    def __enter__(self) -> ClusterRunner:
        try:
            self._check_versions(self._client.run(fingerprint_probe()))
            for address in self._client.scheduler_info(n_workers=-1)["workers"]:
                self._send_files(address)
        except BaseException:
            self._client.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def check(self, job: Job) -> list[Problem]:
        """Return the problems for which a job cannot be run."""
        answer = next(self._submit_all([job], check=True))
        return [Problem(message, where) for message, where in answer["problems"]]

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Run the jobs and yield their records in the order in which the runs end.

        Few jobs are submitted in advance.
        """
        return (
            Record.from_json(answer["record"]) for answer in self._submit_all(jobs, check=False)
        )

    def _submit_all(self, jobs: Iterable[Job], check: bool) -> Iterator[dict[str, Any]]:
        window = _JOBS_PER_THREAD * max(1, sum(self._client.nthreads().values()))
        waiting: dict[str, Job] = {}
        kills: Counter[str] = Counter()
        try:
            for job in jobs:
                self._submit(job, check, waiting)
                while len(waiting) >= window:
                    yield from self._next_answers(check, waiting, kills)
            while waiting:
                yield from self._next_answers(check, waiting, kills)
        except OSError:  # connection errors of distributed
            raise self._connection_lost() from None

    def _submit(self, job: Job, check: bool, waiting: dict[str, Job]) -> None:
        future = self._client.submit(
            run_job, self._package, job.key, dict(job.settings), check, pure=False
        )
        waiting[future.key] = job
        future.add_done_callback(self._finished.put)

    def _next_answers(
        self, check: bool, waiting: dict[str, Job], kills: Counter[str]
    ) -> Iterator[dict[str, Any]]:
        """Wait for a job to end, and yield its answer unless it must be submitted again."""
        future = self._wait_for_future()
        job = waiting.pop(future.key)
        answer = self._future_answer(future)
        if "refused" in answer:
            self._check_versions({answer["worker"]: answer["refused"]})
        if answer.get("missing"):
            self._send_files(answer["worker"])
        kills[job.key] += bool(answer.get("killed"))
        if kills[job.key] == MAX_ATTEMPTS:
            text = f"the worker was killed {MAX_ATTEMPTS} times"
            record = Record(job.key, failure=text)
            yield {"problems": [(text, "")]} if check else {"record": record.to_json()}
        elif answer.get("missing") or answer.get("killed"):
            self._submit(job, check, waiting)
        else:
            yield answer

    def _wait_for_future(self) -> Any:
        """Return the next future that has ended; raise ClusterError if the scheduler has gone."""
        while self._client.status == "running":
            try:
                return self._finished.get(timeout=0.5)
            except queue.Empty:
                continue
        raise self._connection_lost()

    def _future_answer(self, future: Any) -> dict[str, Any]:
        from distributed import KilledWorker

        if future.status == "finished":
            answer: dict[str, Any] = future.result()
            return answer
        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker):
            return {"killed": True}
        raise (
            ClusterError(f"a worker failed: {type(error).__name__}: {error}")
            if error
            else self._connection_lost()
        )

    def _connection_lost(self) -> ClusterError:
        return ClusterError(
            f'the connection to the scheduler "{self._scheduler}" was lost; the same command '
            "continues the study"
        )

    def _check_versions(self, fingerprints: dict[str, str]) -> None:
        own = self._package.identity
        if others := [
            f'worker "{address}" has cosim {other}, expected {own}'
            for address, other in fingerprints.items()
            if other != own
        ]:
            raise InputError(others)

    def _send_files(self, address: str) -> None:
        """Send a worker the files that it lacks.

        Errors of a worker that has left the cluster are ignored.
        """
        try:
            missing = self._client.run(missing_hashes, self._package.files, workers=[address])
            for hashes in missing.values():
                self._client.run(
                    store_contents,
                    self._bundle.read_contents(hashes),
                    workers=[address],
                )
        except (OSError, ValueError, KeyError) as error:
            if address in self._client.scheduler_info(n_workers=-1)["workers"]:
                raise ClusterError(f'files cannot be sent to worker "{address}": {error}') from None


def _connect_client(scheduler: str) -> Any:
    """Connect to a scheduler that has workers; raise InputError if there is none."""
    import distributed

    connect: Any = distributed.Client
    logging.getLogger("distributed").setLevel(
        logging.CRITICAL
    )  # this module reports the errors that matter
    try:
        client = connect(scheduler, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f'no Dask scheduler answers at "{scheduler}": {error}') from None
    try:
        client.wait_for_workers(1, timeout=_CONNECT_TIMEOUT)
    except TimeoutError:
        client.close()
        raise InputError(f'the scheduler "{scheduler}" has no workers') from None
    return client
