"""FMUs of one stage that step at the same time, on threads.

All inputs of a stage are set before its first component steps, so neither the order of the steps
nor running them concurrently changes a value. Python components are excluded, since they would wait
for each other's interpreter lock.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import chain
from typing import TYPE_CHECKING, NamedTuple

from ..core.component import SUCCESS_STATUSES, NativeDoStep, PreparedCall
from ..core.errors import join_alternatives
from ..core.resources import available_processors
from ..core.system import Parallel
from ..process import float_mode
from ..process.journal import calling_several_components
from .plan import Phase, ScheduledStep, Step
from .schedule import Schedule
from .step_runner import StepRunner

if TYPE_CHECKING:
    from .thread_pool import ThreadPool

#: macro steps whose durations are measured before any step runs on a thread (also in _native.c)
MEASURED_STEPS = 3
#: shortest step (s) for which a thread pays off: passing a step to a thread takes about 50 us
MIN_PARALLEL_DURATION = 100e-6


@dataclass(eq=False)
class ParallelGroup:
    """Steps of one stage that may run at the same time, and their partition onto threads."""

    steps: Sequence[ScheduledStep]
    parallel: Parallel
    partitions: Sequence[Sequence[ScheduledStep]] = ()

    def exclusive_groups(self) -> Mapping[object, list[ScheduledStep]]:
        """Return the steps in groups; steps of one group must not run at the same time."""
        groups: dict[object, list[ScheduledStep]] = defaultdict(list)
        for step in self.steps:
            groups[
                step.first_call if self.parallel is True else step.step.component.shared_code
            ].append(step)
        return groups

    def partition(self, durations: Mapping[int, float], processors: int) -> None:
        """Choose the partitions from measured durations; none if threads do not pay off.

        "auto" requires at least two exclusive groups of long steps. It keeps instances of one FMU
        file in one partition, since their code may share state. True treats every component as
        independent and worth a thread.

        Args:
            durations: measured doStep durations (s) by the number of the step's first call.
            processors: number of available processors.
        """
        groups = self.exclusive_groups()
        costs: dict[object, float] = defaultdict(float)
        for key, group in groups.items():
            for step in group:
                costs[key] += durations[step.first_call]
        if self.parallel is True:
            count = min(max(2, processors), len(groups))
        else:
            long = sum(cost >= MIN_PARALLEL_DURATION for cost in costs.values())
            count = min(processors, long)
        self.partitions = _balance_load(groups, costs, count) if count > 1 else ()


def _balance_load(
    groups: Mapping[object, Sequence[ScheduledStep]], costs: Mapping[object, float], count: int
) -> list[list[ScheduledStep]]:
    """Distribute groups over `count` partitions of similar cost.

    Each group, longest first, to the least loaded partition.
    """
    partitions: list[list[ScheduledStep]] = [[] for _ in range(count)]
    loads = [0.0] * count
    for key in sorted(groups, key=lambda key: -costs[key]):
        least_loaded = loads.index(min(loads))
        partitions[least_loaded] += groups[key]
        loads[least_loaded] += costs[key]
    return [
        sorted(partition, key=lambda step: step.first_call) for partition in partitions if partition
    ]


def releases_gil(step: ScheduledStep) -> bool:
    """Return whether the step runs in C without the interpreter lock."""
    return any(isinstance(call.native, NativeDoStep) for call in step.calls)


class ParallelSteps:
    """Stages that may step on threads, and the decision after the first steps which of them do."""

    def __init__(self, runner: StepRunner):
        self._runner = runner
        #: by the index of the phase: the steps that may run at the same time, and the one step that
        #: replaces them
        self._candidates: dict[int, tuple[ParallelGroup, ScheduledStep]] = {}
        self._threads: ThreadPool | None = None

    @property
    def has_candidates(self) -> bool:
        """A phase has steps that may run at the same time."""
        return bool(self._candidates)

    def find_candidates(self, phases: Sequence[Phase], schedule: Schedule) -> None:
        """Schedule one parallel step for each phase with independent steps in C."""
        for index, (phase, steps) in enumerate(zip(phases, schedule.phases, strict=True)):
            group = ParallelGroup([step for step in steps if releases_gil(step)], phase.parallel)
            if phase.parallel and len(group.exclusive_groups()) > 1:
                name = join_alternatives(step.step.name for step in group.steps)
                step = Step(name, group.steps[0].step.component, 1, 0.0)
                call = PreparedCall(self._run_group, (group,), "parallel step")
                self._candidates[index] = group, schedule.add_step(step, [call])

    def decide(self, schedule: Schedule, durations: Mapping[int, float]) -> None:
        """Replace the steps of each phase that pays off by their parallel step; create the threads.

        Args:
            schedule: its phases are changed in place.
            durations: measured doStep durations (s) by the number of the step's first call.
        """
        largest = 1
        for index, (group, parallel_step) in self._candidates.items():
            group.partition(durations, available_processors())
            if group.partitions:
                schedule.phases[index] = [
                    parallel_step,
                    *(s for s in schedule.phases[index] if not releases_gil(s)),
                ]
            largest = max(largest, len(group.partitions))
        self._candidates = {}
        if largest > 1:
            from .thread_pool import ThreadPool

            self._threads = ThreadPool(largest - 1)

    def withdraw_candidates(self) -> None:
        """Let the steps of all phases run one after another, unless it was decided otherwise."""
        self._candidates = {}

    def _run_group(self, group: ParallelGroup) -> int:
        assert self._threads is not None
        run_partition = partial(run_due, n=self._runner.completed_steps)
        with calling_several_components():
            found = self._threads.map(run_partition, group.partitions)
        failures = chain.from_iterable(found)
        for failure in sorted(failures, key=lambda failure: failure.step.first_call):
            if failure.status is None:
                self._runner.restore_float_mode(failure.step.step.name)
                continue
            self._runner.handle_status(failure.step, failure.call, failure.status)
            self._runner.run_step(failure.step, failure.call_index + 1)
        return self._runner.termination_status

    def close(self) -> None:
        """End the threads."""
        if self._threads:
            self._threads.close()


class StepFailure(NamedTuple):
    """Call `call_index` of a step that returned `status`.

    A status None means that it changed the floating-point mode.
    """

    step: ScheduledStep
    call_index: int
    status: int | None

    @property
    def call(self) -> PreparedCall:
        """The call that failed."""
        return self.step.calls[self.call_index]


def run_due(steps: Sequence[ScheduledStep], n: int) -> list[StepFailure]:
    """Run the steps that are due in macro step `n`, in order; return those that stopped early."""
    due = (step for step in steps if n % step.step.divisor == 0)
    failures = []
    for step in due:
        for index, call in enumerate(step.calls):
            status = call.function(*call.arguments)
            if status not in SUCCESS_STATUSES:
                failures.append(StepFailure(step, index, status))
                break
        if float_mode.is_changed() or float_mode.enabled_traps():
            float_mode.set_default()
            failures.append(StepFailure(step, -1, None))
    return failures
