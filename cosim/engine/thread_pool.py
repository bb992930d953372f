"""Concurrent calls on a pool of threads.

A separate module, since importing `concurrent.futures` takes milliseconds.
"""

from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


class ThreadPool:
    """Pool of `size` threads that work at the same time as the calling thread."""

    def __init__(self, size: int):
        self._executor = ThreadPoolExecutor(size, thread_name_prefix="cosim")

    def map(self, function: Callable[[Item], Result], items: Sequence[Item]) -> list[Result]:
        """Call `function` with every item.

        With the first one in this thread, with the others in the pool.

        Returns or raises only when all calls have ended, since a component must not be freed during
        its step.

        Args:
            function: called with one item; may raise.
            items: at least one item.

        Returns:
            The results in the order of `items`.

        Raises:
            KeyboardInterrupt: the process was interrupted.
            BaseException: the first error in the order of `items`.
        """
        futures = [self._executor.submit(function, item) for item in items[1:]]
        try:
            return [function(items[0]), *(future.result() for future in futures)]
        except BaseException:
            _wait_for(futures)
            raise

    def close(self) -> None:
        """End the threads."""
        self._executor.shutdown()


def _wait_for(futures: Sequence[Future[Result]]) -> None:
    """Wait until all calls have ended; raise a KeyboardInterrupt received meanwhile only then."""
    interrupt: KeyboardInterrupt | None = None
    while not all(future.done() for future in futures):
        try:
            wait(futures)
        except KeyboardInterrupt as error:
            interrupt = error
    if interrupt:
        raise interrupt
