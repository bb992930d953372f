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
from .execution.bundle import absolute_paths, identity
from .execution.job import Job, Record
from .execution.worker_pool import ATTEMPTS
from .study import Study

#: a scheduler must answer and show a worker within (s)
_PATIENCE = 15.0
#: jobs in advance for each thread of the cluster
_AHEAD = 3


class ClusterError(CosimError):
    """The cluster failed; what was finished is kept."""

    exit_code = 1


def require_cluster() -> None:
    """Raises InputError when the package that speaks to a cluster is not installed."""
    try:
        import distributed  # noqa: F401
    except ImportError:
        raise InputError('--scheduler needs the package distributed: pip install "fmi-cosim[cluster]"') from None


class ClusterEngine:
    """Submits jobs to a scheduler such as "tcp://host:8786"; a context.

    Raises InputError when nothing answers there, when files cannot be shipped, or when a worker has another cosim.
    """

    def __init__(self, study: Study, scheduler: str):
        require_cluster()
        _refuse_absolute_paths(study)
        self._bundle, self._scheduler = study.bundle, scheduler
        files = dict(self._bundle.files)
        deadline = study.spec.deadline
        self._cargo = cluster_worker.Cargo(self._bundle.digest, identity(), str(self._bundle.scenario), files, deadline)
        self._done: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._client = _connect(scheduler)

    def __enter__(self) -> ClusterEngine:
        try:
            self._refuse_others(self._client.run(cluster_worker.probe()))
            for address in self._client.scheduler_info(n_workers=-1)["workers"]:
                self._ship(address)
        except BaseException:
            self._client.close()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def check(self, job: Job) -> list[Problem]:
        """What keeps a job from being run."""
        answer = next(self._answers([job], check=True))
        return [Problem(message, where) for message, where in answer["problems"]]

    def results(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Records in the order in which runs end; only a few jobs are submitted in advance."""
        return (Record.from_json(answer["record"]) for answer in self._answers(jobs, check=False))

    def _answers(self, jobs: Iterable[Job], check: bool) -> Iterator[dict[str, Any]]:
        window = _AHEAD * max(1, sum(self._client.nthreads().values()))
        waiting: dict[str, Job] = {}
        kills: Counter[str] = Counter()
        try:
            for job in jobs:
                self._submit(job, check, waiting)
                while len(waiting) >= window:
                    yield from self._next(check, waiting, kills)
            while waiting:
                yield from self._next(check, waiting, kills)
        except OSError:  # those of distributed's connections
            raise self._gone() from None

    def _submit(self, job: Job, check: bool, waiting: dict[str, Job]) -> None:
        future = self._client.submit(cluster_worker.work, self._cargo, job.key, dict(job.settings), check, pure=False)
        waiting[future.key] = job
        future.add_done_callback(self._done.put)

    def _next(self, check: bool, waiting: dict[str, Job], kills: Counter[str]) -> Iterator[dict[str, Any]]:
        """The answer of a job that has ended, unless it must be submitted again."""
        future = self._wait()
        job = waiting.pop(future.key)
        answer = self._result(future)
        if "refused" in answer:
            self._refuse_others({answer["worker"]: answer["refused"]})
        if answer.get("missing"):
            self._ship(answer["worker"])
        kills[job.key] += bool(answer.get("killed"))
        if kills[job.key] == ATTEMPTS:
            yield _lost(job, check)
        elif answer.get("missing") or answer.get("killed"):
            self._submit(job, check, waiting)
        else:
            yield answer

    def _wait(self) -> Any:
        """The next future that has ended. Raises ClusterError when the scheduler is gone."""
        while self._client.status == "running":
            try:
                return self._done.get(timeout=0.5)
            except queue.Empty:
                continue
        raise self._gone()

    def _result(self, future: Any) -> dict[str, Any]:
        from distributed import KilledWorker

        if future.status == "finished":
            answer: dict[str, Any] = future.result()
            return answer
        error = future.exception() if future.status == "error" else None
        if isinstance(error, KilledWorker):
            return {"killed": True}
        raise ClusterError(f"a worker failed: {type(error).__name__}: {error}") if error else self._gone()

    def _gone(self) -> ClusterError:
        return ClusterError(f'the connection to the scheduler "{self._scheduler}" was lost; the same command goes on')

    def _refuse_others(self, found: dict[str, str]) -> None:
        own = self._cargo.identity
        if others := [f'worker "{address}" has cosim {it}, expected {own}' for address, it in found.items() if it != own]:
            raise InputError(others)

    def _ship(self, address: str) -> None:
        """Send a worker what it lacks. One that ends meanwhile is none of our concern."""
        try:
            lacking = self._client.run(cluster_worker.missing, self._cargo.files, workers=[address])
            for hashes in lacking.values():
                self._client.run(cluster_worker.receive, self._bundle.contents(hashes), workers=[address])
        except (OSError, ValueError, KeyError) as error:
            if address in self._client.scheduler_info(n_workers=-1)["workers"]:
                raise ClusterError(f'files cannot be sent to worker "{address}": {error}') from None


def _refuse_absolute_paths(study: Study) -> None:
    scenario, read = study.read.scenario, study.read
    if problems := [found for each in study.all_variants for found in read.located(absolute_paths(scenario, each), each)]:
        raise InputError(dict.fromkeys(problems))


def _lost(job: Job, check: bool) -> dict[str, Any]:
    text = f"the worker was killed {ATTEMPTS} times"
    return {"problems": [(text, "")]} if check else {"record": Record(job.key, failure=text).to_json()}


def _connect(scheduler: str) -> Any:
    """A client of a scheduler that has workers."""
    import distributed

    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is said in our own words
    try:
        client = distributed.Client(scheduler, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f'no Dask scheduler answers at "{scheduler}": {error}') from None
    try:
        client.wait_for_workers(1, timeout=_PATIENCE)
    except TimeoutError:
        client.close()
        raise InputError(f'the scheduler "{scheduler}" has no workers') from None
    return client
