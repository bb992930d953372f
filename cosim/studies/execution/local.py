"""The engine of one machine: several lanes side by side."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait

from ...core.errors import Problem
from .job import Job, Record, StudyContext
from .worker_pool import WorkerPool


class LocalRunner:
    """Runs `workers` jobs at a time; a context, at whose end all runs are ended."""

    def __init__(self, order: StudyContext, workers: int):
        self.worker_pool, self._workers = WorkerPool(order), workers

    def __enter__(self) -> LocalRunner:
        return self

    def __exit__(self, *_: object) -> None:
        self.worker_pool.close()

    def check(self, job: Job) -> list[Problem]:
        """What keeps a job from being run."""
        return self.worker_pool.check(job)

    def run_jobs(self, jobs: Iterable[Job]) -> Iterator[Record]:
        """Records in the order in which runs end; only a few jobs are made in advance. Each thread waits for a lane."""
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
