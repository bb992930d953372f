"""The engine of a Dask cluster (extra `cluster`): the same jobs, run by the workers of a scheduler.

No file system is shared: a worker that lacks files is sent them by content hash. Workers may come, go and be killed.
"""

from __future__ import annotations

import logging
import queue
from collections import Counter
from collections.abc import Iterable, Iterator
from typing import Any

from ..core.errors import CosimError, InputError, Problem
from .execution import cluster_worker
from .execution.bundle import absolute_paths, cosim_fingerprint
from .execution.job import Job, Record
from .execution.worker_pool import MAX_ATTEMPTS
from .study import Study

#: a scheduler must answer and show a worker within (s)
_CONNECT_TIMEOUT = 15.0
#: jobs in advance for each thread of the cluster
_JOBS_PER_THREAD = 3


class ClusterError(CosimError):
    """The cluster failed; what was finished is kept."""

    exit_code = 1


def require_cluster() -> None:
    """Raises InputError when the package that speaks to a cluster is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError('--scheduler needs the package distributed: pip install "fmi-cosim[cluster]"') from None


class ClusterRunner:
    """Submits jobs to a scheduler such as "tcp://host:8786"; a context.

    Raises InputError when nothing answers there, when files cannot be shipped, or when a worker has another cosim.
    """

    def __init__(self, study: Study, scheduler: str):
        require_cluster()
        _refuse_absolute_paths(study)
        self._bundle, self._scheduler = study.bundle, scheduler
        files = dict(self._bundle.files)
        deadline = study.spec.deadline
        self._package = cluster_worker.StudyPackage(
            self._bundle.digest, cosim_fingerprint(), str(self._bundle.scenario), files, deadline
        )
        self._finished: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._client = _connect_client(scheduler)

    def __enter__(self) -> ClusterRunner:
        try:
            self._check_versions(self._client.run(cluster_worker.fingerprint_probe()))
            for address in self._client.scheduler_info(n_workers=-1)["workers"]:
                self._send_files(address)
        except BaseException:
            self._client.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def check(self, job: Job) -> list[Problem]:
        """What keeps a job from being run."""
        answer = next(self._submit_all([job], check=True))
        return [Problem(message, where) for message, where in answer["problems"]]

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Records in the order in which runs end; only a few jobs are submitted in advance."""
        return (Record.from_json(answer["record"]) for answer in self._submit_all(jobs, check=False))

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
        except OSError:  # those of distributed's connections
            raise self._connection_lost() from None

    def _submit(self, job: Job, check: bool, waiting: dict[str, Job]) -> None:
        future = self._client.submit(cluster_worker.run_job, self._package, job.key, dict(job.settings), check, pure=False)
        waiting[future.key] = job
        future.add_done_callback(self._finished.put)

    def _next_answers(self, check: bool, waiting: dict[str, Job], kills: Counter[str]) -> Iterator[dict[str, Any]]:
        """The answer of a job that has ended, unless it must be submitted again."""
        future = self._wait_for_future()
        job = waiting.pop(future.key)
        answer = self._future_answer(future)
        if "refused" in answer:
            self._check_versions({answer["worker"]: answer["refused"]})
        if answer.get("missing"):
            self._send_files(answer["worker"])
        kills[job.key] += bool(answer.get("killed"))
        if kills[job.key] == MAX_ATTEMPTS:
            yield _killed_answer(job, check)
        elif answer.get("missing") or answer.get("killed"):
            self._submit(job, check, waiting)
        else:
            yield answer

    def _wait_for_future(self) -> Any:
        """The next future that has ended. Raises ClusterError when the scheduler is gone."""
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
        raise ClusterError(f"a worker failed: {type(error).__name__}: {error}") if error else self._connection_lost()

    def _connection_lost(self) -> ClusterError:
        return ClusterError(f'the connection to the scheduler "{self._scheduler}" was lost; the same command goes on')

    def _check_versions(self, found: dict[str, str]) -> None:
        own = self._package.identity
        if others := [f'worker "{address}" has cosim {it}, expected {own}' for address, it in found.items() if it != own]:
            raise InputError(others)

    def _send_files(self, address: str) -> None:
        """Send a worker what it lacks. One that ends meanwhile is none of our concern."""
        try:
            lacking = self._client.run(cluster_worker.missing_hashes, self._package.files, workers=[address])
            for hashes in lacking.values():
                self._client.run(cluster_worker.store_contents, self._bundle.read_contents(hashes), workers=[address])
        except (OSError, ValueError, KeyError) as error:
            if address in self._client.scheduler_info(n_workers=-1)["workers"]:
                raise ClusterError(f'files cannot be sent to worker "{address}": {error}') from None


def _refuse_absolute_paths(study: Study) -> None:
    scenario, read = study.study_file.scenario, study.study_file
    if problems := [
        found for each in study.all_setting_variants for found in read.locate_problems(absolute_paths(scenario, each), each)
    ]:
        raise InputError(dict.fromkeys(problems))


def _killed_answer(job: Job, check: bool) -> dict[str, Any]:
    text = f"the worker was killed {MAX_ATTEMPTS} times"
    return {"problems": [(text, "")]} if check else {"record": Record(job.key, failure=text).to_json()}


def _connect_client(scheduler: str) -> Any:
    """A client of a scheduler that has workers."""
    import distributed

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is said in our own words
    try:
        client = distributed.Client(scheduler, timeout=_CONNECT_TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f'no Dask scheduler answers at "{scheduler}": {error}') from None
    try:
        client.wait_for_workers(1, timeout=_CONNECT_TIMEOUT)
    except TimeoutError:
        client.close()
        raise InputError(f'the scheduler "{scheduler}" has no workers') from None
    return client
