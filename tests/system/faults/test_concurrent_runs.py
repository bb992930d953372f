"""Runs in threads, in an event loop and after a fork: each gives the usual result, and the process
stays as it was.
"""

from __future__ import annotations

import asyncio
import locale
import multiprocessing
import os
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fault_fmu import FaultFmus, lag_output, scenario

import cosim

THREADS, RUNS = 8, 24
END = lag_output(10)


@pytest.fixture
def healthy(fmus: FaultFmus, version: int, monkeypatch: pytest.MonkeyPatch) -> str:
    """A scenario in the working directory, by its relative path."""
    monkeypatch.chdir(fmus.folder)
    return scenario(fmus.folder, fmus(version), record={"signals": ["lag.y"]}).name


@pytest.fixture(autouse=True)
def unchanged_process() -> Iterator[None]:
    before = process_state()
    yield
    assert process_state() == before


def process_state() -> tuple[Any, ...]:
    mask = os.umask(0o22)
    os.umask(mask)
    return (
        Path.cwd(),
        mask,
        dict(os.environ) | {"PYTEST_CURRENT_TEST": ""},
        locale.setlocale(locale.LC_ALL),
    )


def end_value(path: str, **options: Any) -> float:
    return float(cosim.run(path, **options)["lag.y"][-1])


def in_threads(function: Callable[..., Any], *items: Any) -> list[Any]:
    with ThreadPoolExecutor(THREADS) as pool:
        return list(pool.map(function, items, timeout=60))


def test_runs_in_threads(healthy):
    assert in_threads(end_value, *[healthy] * RUNS) == [END] * RUNS


def test_isolated_runs_in_threads(healthy):
    assert (
        in_threads(lambda path: end_value(path, isolation="fmu"), *[healthy] * THREADS)
        == [END] * THREADS
    )


def test_runs_of_one_process_step_in_turns(healthy):
    stepping: list[int] = []
    most = []

    def observe(step: int, count: int) -> None:
        stepping.append(step)
        most.append(len(stepping))
        if step == count:
            stepping.clear()

    in_threads(lambda path: cosim.run(path, observers=[observe]), *[healthy] * THREADS)
    assert max(most) == 11


def test_isolated_runs_step_at_the_same_time(healthy):
    barrier = threading.Barrier(2, timeout=20)
    observers = [lambda *_: barrier.wait()]
    assert in_threads(
        lambda path: end_value(path, isolation="fmu", observers=observers), healthy, healthy
    ) == [END, END]


@pytest.mark.parametrize(
    "function", ["load", "EnterInitializationMode", "DoStep", "Terminate", "FreeInstance"]
)
@pytest.mark.parametrize(
    "change", ["change_folder", "change_umask", "change_environment", "change_locale"]
)
def test_a_change_of_the_process_is_undone_and_blamed_on_its_author(
    fmus, function, change, monkeypatch, caplog
):
    monkeypatch.chdir(fmus.folder)
    good = scenario(fmus.folder, fmus(2)).rename(fmus.folder / "good.json").name
    rude_fmu = fmus(2, f"{function} 1 {change}", "rude")
    rude = scenario(fmus.folder, rude_fmu, components={"rude": {"fmu": str(rude_fmu)}}).name
    in_threads(cosim.run, *[good, rude] * 2)
    authors = {
        record.getMessage().partition(":")[0]
        for record in caplog.records
        if "of the process" in record.getMessage()
    }
    assert authors == {"rude"}


def test_a_run_within_a_run(healthy):
    inner = []
    result = cosim.run(
        healthy, observers=[lambda step, _: inner.append(end_value(healthy)) if step == 5 else None]
    )
    assert (inner, result["lag.y"][-1]) == ([END], END)


def test_in_an_event_loop(healthy):
    async def main() -> list[float]:
        direct = end_value(healthy)
        return [
            direct,
            *await asyncio.gather(*(asyncio.to_thread(end_value, healthy) for _ in range(THREADS))),
        ]

    with ThreadPoolExecutor(
        1
    ) as pool:  # a browser test before this one may have left a loop in the main thread
        assert pool.submit(asyncio.run, main()).result() == [END] * (THREADS + 1)


def test_in_a_working_directory_that_was_removed(healthy, tmp_path, monkeypatch):
    path = Path(healthy).resolve()
    (tmp_path / "gone").mkdir()
    with monkeypatch.context() as context:
        context.chdir(tmp_path / "gone")
        (tmp_path / "gone").rmdir()
        assert end_value(str(path)) == END
    os.chdir(tmp_path)


def forked(function: Callable[[], bool]) -> bool:
    """Call a function in a forked child; return whether it returned True in time."""
    child = os.fork()
    if child == 0:
        try:
            os._exit(0 if function() else 1)
        finally:
            os._exit(2)
    watchdog = threading.Timer(20, os.kill, (child, 9))
    watchdog.start()
    status = os.waitpid(child, 0)[1]
    watchdog.cancel()
    return status == 0


@pytest.mark.parametrize("isolation", ["none", "fmu"])
def test_after_a_fork(healthy, isolation):
    assert end_value(healthy, isolation=isolation) == END
    assert forked(lambda: end_value(healthy, isolation=isolation) == END)
    assert end_value(healthy, isolation=isolation) == END


def test_in_a_pool_of_forked_processes(healthy):
    assert end_value(healthy) == END
    with multiprocessing.get_context("fork").Pool(2) as pool:
        assert pool.map_async(end_value, [healthy] * 4).get(timeout=30) == [END] * 4


@pytest.mark.parametrize("order", ["", "DoStep 1 change_folder"])
def test_after_a_fork_during_a_run_of_another_thread(fmus, order, monkeypatch):
    monkeypatch.chdir(fmus.folder)
    good = scenario(fmus.folder, fmus(3)).rename(fmus.folder / "good.json").name
    other = scenario(fmus.folder, fmus(2, order, "other")).name
    folder, reached, proceed = Path.cwd(), threading.Event(), threading.Event()

    def observe(step: int, _count: int) -> None:
        if step == 5:
            reached.set()
            proceed.wait(20)

    thread = threading.Thread(target=cosim.run, args=(other,), kwargs={"observers": [observe]})
    thread.start()
    assert reached.wait(20)
    done = forked(lambda: Path.cwd() == folder and end_value(good) == END)
    proceed.set()
    thread.join()
    assert done
