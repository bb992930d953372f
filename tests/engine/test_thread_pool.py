"""Concurrent calls: results in order, errors only after all calls have ended."""

import os
import signal
import time
from threading import Timer

import pytest

from cosim.engine.thread_pool import ThreadPool


@pytest.fixture
def threads():
    pool = ThreadPool(2)
    yield pool
    pool.close()


def reciprocal(x):
    return 1 / x


def test_results_are_in_order_and_an_error_is_raised(threads):
    assert threads.map(reciprocal, [1, 2, 4]) == [1, 0.5, 0.25]
    with pytest.raises(ZeroDivisionError):
        threads.map(reciprocal, [1, 0, 4])
    assert threads.map(reciprocal, [4, 2]) == [0.25, 0.5]


@pytest.mark.parametrize("failing_item", [0, 1], ids=["first item", "item on a thread"])
def test_an_error_is_raised_only_when_all_calls_have_ended(threads, failing_item):
    ended = []

    def fail_or_sleep(item):
        if item == failing_item:
            raise ValueError(item)
        time.sleep(0.2)
        ended.append(item)

    with pytest.raises(ValueError, match=str(failing_item)):
        threads.map(fail_or_sleep, [0, 1, 2])
    assert sorted(ended) == [item for item in range(3) if item != failing_item]


def test_an_interrupt_is_raised_only_when_all_calls_have_ended(threads):
    ended = []

    def sleep(seconds):
        time.sleep(seconds)
        ended.append(seconds)

    Timer(0.2, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        threads.map(sleep, [0.0, 0.6])
    assert ended == [0.0, 0.6]
