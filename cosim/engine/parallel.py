"""Components of one stage that step at the same time, on threads.

A stage has read everything before its first component steps, so the order in which its components step has no influence on any
value; neither has stepping them at once. Python components take no part: they would only wait for each other.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from queue import SimpleQueue
from threading import Event, Thread
from typing import Generic, TypeVar

from ..core.component import NativeDoStep
from ..core.system import Parallel
from .component_step import ScheduledStep

#: macro steps in which the steps of components are measured before anything runs on threads
MEASURED_STEPS = 3
#: a component whose step takes as long as this (s) is worth a thread: handing over takes some 50 us
MIN_PARALLEL_DURATION = 100e-6

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(eq=False)
class ParallelGroup:
    """The turns of one stage that may be taken at the same time, and the lanes in which they are once that was decided."""

    steps: Sequence[ScheduledStep]
    parallel: Parallel
    partitions: Sequence[Sequence[ScheduledStep]] = ()

    def exclusive_groups(self) -> Mapping[object, list[ScheduledStep]]:
        """Turns that may not be taken at the same time, together."""
        groups: dict[object, list[ScheduledStep]] = defaultdict(list)
        for turn in self.steps:
            groups[turn.first_call if self.parallel is True else turn.step.component.shared_code].append(turn)
        return groups

    def partition(self, seconds: Mapping[int, float], processors: int) -> None:
        """Choose the lanes from the measured step of each turn, by the turn's first number.

        "auto" asks for two lanes of long steps at least, and puts instances of one FMU file into one lane, for their code may
        have state in common; True takes every component as independent and worth a thread.
        """
        groups = self.exclusive_groups()
        costs = {key: sum(seconds[turn.first_call] for turn in group) for key, group in groups.items()}
        worthy = [key for key, cost in costs.items() if self.parallel is True or cost >= MIN_PARALLEL_DURATION]
        count = min(max(2, processors) if self.parallel is True else processors, len(worthy))
        self.partitions = _balance_load(groups, costs, count) if count > 1 else ()


def _balance_load(
    groups: Mapping[object, Sequence[ScheduledStep]], costs: Mapping[object, float], count: int
) -> list[list[ScheduledStep]]:
    """The groups in `count` lanes of about equal cost: the longest first, each to the lane that has least to do."""
    lanes: list[list[ScheduledStep]] = [[] for _ in range(count)]
    loads = [0.0] * count
    for key in sorted(groups, key=lambda key: -costs[key]):
        least = loads.index(min(loads))
        lanes[least] += groups[key]
        loads[least] += costs[key]
    return [sorted(lane, key=lambda turn: turn.first_call) for lane in lanes if lane]


def releases_gil(turn: ScheduledStep) -> bool:
    """Whether the turn steps in C, without the interpreter."""
    return any(isinstance(call.native, NativeDoStep) for call in turn.calls)


@dataclass(eq=False)
class _Task(Generic[Item, Result]):
    work: Item
    result: Result | None = None
    error: BaseException | None = None
    done: Event = field(default_factory=Event)

    def run(self, function: Callable[[Item], Result]) -> None:
        try:
            self.result = function(self.work)
        except BaseException as error:
            self.error = error
        self.done.set()


class ThreadPool(Generic[Item, Result]):
    """Threads that do pieces of work at the same time as the calling thread."""

    def __init__(self, size: int, function: Callable[[Item], Result]):
        self._function = function
        self._tasks: SimpleQueue[_Task[Item, Result] | None] = SimpleQueue()
        self._threads = [Thread(target=self._run_tasks, name=f"cosim-{i}", daemon=True) for i in range(size)]
        for thread in self._threads:
            thread.start()

    def _run_tasks(self) -> None:
        while task := self._tasks.get():
            task.run(self._function)

    def map(self, items: Sequence[Item]) -> list[Result]:
        """The outcomes, in order; raises the first error. Returns, and is interrupted, only when nobody works any more."""
        tasks: list[_Task[Item, Result]] = [_Task(work) for work in items]
        for task in tasks[1:]:
            self._tasks.put(task)
        tasks[0].run(self._function)
        interrupt = None
        for task in tasks:
            while not task.done.is_set():
                try:
                    task.done.wait()
                except KeyboardInterrupt as error:
                    interrupt = error
        if failure := interrupt or next((task.error for task in tasks if task.error), None):
            raise failure
        return [task.result for task in tasks]  # type: ignore[misc]

    def close(self) -> None:
        """Let the threads end."""
        for _ in self._threads:
            self._tasks.put(None)
        for thread in self._threads:
            thread.join()
