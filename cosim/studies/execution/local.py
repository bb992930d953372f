"""Runner of jobs on this machine, by several worker processes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from ...core.errors import Problem
from .job import Job, Record, StudyContext
from .worker_pool import WorkerPool


class LocalRunner:
    """Runner of `workers` jobs at a time on this machine; leaving its context ends all runs."""

    def __init__(self, context: StudyContext, workers: int):
        self.worker_pool, self._workers = WorkerPool(context), workers

    def __enter__(self) -> LocalRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self.worker_pool.close()

    def check(self, job: Job) -> list[Problem]:
        """Return the problems for which a job cannot be run."""
        return self.worker_pool.check(job)

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Run the jobs and yield their records in the order in which the runs end.

        Only a few jobs are taken from the iterable in advance. Each thread waits for a worker
        process.
        """
        pending: set[Future[Record]] = set()
        pool = ThreadPoolExecutor(self._workers)
        try:
            for job in jobs:
                pending.add(pool.submit(self.worker_pool.run, job))
                if len(pending) >= 2 * self._workers:
                    done, pending = wait(pending, return_when=FIRST_COMPLETED)
                    yield from (future.result() for future in done)
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                yield from (future.result() for future in done)
        except BaseException:
            self.worker_pool.close()
            raise
        finally:
            pool.shutdown(cancel_futures=True)
