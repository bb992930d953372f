"""The run loop: initialize a system, step it with its events and observers, and free its components in every case."""

from __future__ import annotations

import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ..core import component_log
from ..core.component import Component
from ..core.errors import ComponentError, InputError, Problem, join_alternatives
from ..core.recording import Recording
from ..core.stopwatch import Stopwatch
from ..core.system import System
from ..core.time_grid import TimeGrid
from ..process.float_mode import default_float_mode
from ..process.forks import attributing_forks, report_forks
from ..process.journal import MARKER_SIZE, Phase, calling_component, current_journal, suspending_deadline
from ..process.process_state import restoring_process_state
from . import Executor, Recorder, Termination, compile_plan, executor_class
from .initialization import instantiate_components
from .pacer import Pacer
from .run_checks import find_problems, find_space_problems
from .saving_recorder import SavingRecorder, write_header
from .settings import Event, Settings, StepHook

#: called with (completed macro steps, all macro steps); must not change the system
Observer = Callable[[int, int], None]


@dataclass(frozen=True)
class SimulationOutcome:
    """Result of a run.

    Attributes:
        recording: the recorded rows; after a failure, the rows until then.
        timing: wall time (s) of checking the system and compiling the plan ("wiring_seconds"), of extracting and instantiating
            ("instantiate_seconds"), of initialization mode ("initialize_seconds") and of the stepping loop ("loop_seconds").
        macro_steps: number of completed macro steps.
        termination: a component's request to end the simulation, if there was one.
        failure: the error that ended the run early, if there was one.
        real_time: lateness of the steps, see `pacer.Pacer.statistics`; None for a run without pacing.
    """

    recording: Recording
    timing: Mapping[str, float]
    macro_steps: int
    termination: Termination | None
    failure: BaseException | None
    real_time: Mapping[str, Any] | None = None

    @property
    def loop_seconds(self) -> float:
        """Wall time (s) of the stepping loop; 0 if it was not reached."""
        return self.timing.get("loop_seconds", 0.0)


def simulate(system: System, settings: Settings, observers: Sequence[Observer] = ()) -> SimulationOutcome:
    """Simulate a system of new components, and free them in every case.

    Args:
        system: the components must not have been used before.
        settings: when and how to simulate.
        observers: called about 100 times during the run.

    Returns:
        The outcome. An error during the run is its `failure`; the rows recorded before are in its `recording`.

    Raises:
        InputError: the system cannot be simulated with these settings.
        ComponentError: a component cannot be freed.
    """
    outcome = None
    try:
        with simulating(system, settings, observers) as outcome:
            pass
    except ComponentError as error:  # from terminate or free
        if outcome is None:
            raise
        outcome = replace(outcome, failure=error)
    return outcome


@contextmanager
def simulating(system: System, settings: Settings, observers: Sequence[Observer] = ()) -> Iterator[SimulationOutcome]:
    """Simulate a system like `simulate`, but terminate and free its components only at the end of the block.

    The block can save the outcome first, so that a crash in terminate or free cannot lose it.

    Args:
        system: the components must not have been used before.
        settings: when and how to simulate.
        observers: called about 100 times during the run.

    Yields:
        The outcome, after the last step.

    Raises:
        InputError: the system cannot be simulated with these settings.
        ComponentError: a component failed in terminate or free.
    """
    with default_float_mode(), ExitStack() as stack:
        stack.callback(report_forks)
        for name, component in system.components.items():
            stack.callback(_free_component, name, component)
        watch = Stopwatch()
        with watch.measure("wiring_seconds"):
            if problems := find_problems(system, settings) or _space_problems(settings):
                raise InputError(problems)
            executor = _create_executor(system, settings)
        outcome = _run_executor(executor, settings, observers, watch)
        yield outcome
        if outcome.failure is None:
            for name, component in system.components.items():
                with calling_component(name, "terminate", "end"):
                    component.terminate()


def _space_problems(settings: Settings) -> list[Problem]:
    journal = current_journal()
    rows = (journal and journal.folder) or (settings.rows_file and settings.rows_file.parent)
    return find_space_problems(settings, rows or Path(tempfile.gettempdir()), csv=bool(journal and journal.csv_path))


def _free_component(name: str, component: Component) -> None:
    with calling_component(name, "free", "end"):
        component.free()


def _create_executor(system: System, settings: Settings) -> Executor:
    grid = TimeGrid.from_times(settings.start_time, settings.stop_time, settings.step_size)
    plan = compile_plan(system, grid, settings.columns.values())
    journal = current_journal()
    every = int((settings.record_interval or grid.step) / grid.step)
    if journal and journal.folder and not settings.rows_file:
        recorder: Recorder = SavingRecorder(plan, settings.columns, every, journal.folder)
    else:
        recorder = Recorder(plan, settings.columns, every, settings.rows_file)
    marker = None if journal is None else np.frombuffer(journal.memory, np.int64, MARKER_SIZE)
    return executor_class(settings.executor)(plan, recorder, marker, settings.require_finite)


def _run_executor(executor: Executor, settings: Settings, observers: Sequence[Observer], watch: Stopwatch) -> SimulationOutcome:
    journal, grid, recorder = current_journal(), executor.plan.grid, executor.recorder
    events: dict[int, list[Event]] = defaultdict(list)
    for event in settings.events:
        events[grid.index(event.time)].append(event)
    pacer = Pacer(grid, settings.real_time, settings.late) if settings.real_time else None
    failure = None
    try:
        with watch.measure("instantiate_seconds"):
            instantiate_components(executor.plan)
        with watch.measure("initialize_seconds"):
            executor.initialize()
        if journal and journal.folder:
            write_header(journal.folder, executor)
        if journal:
            journal.enter_phase(Phase.STEPPING, journal.deadlines.step)
        with (
            restoring_process_state(join_alternatives(executor.plan.system.components)),
            attributing_forks(executor.describe_call),
            watch.measure("loop_seconds"),
        ):
            _step_to_end(executor, events, observers, pacer, settings.step_hook)
    except (Exception, KeyboardInterrupt) as error:
        failure = error
    finally:
        executor.close()
    if journal:
        journal.enter_phase(Phase.IDLE)
    report_forks()
    component_log.report_dropped_messages()
    lateness = pacer.statistics() if pacer else None
    return SimulationOutcome(
        recorder.recording(), watch.seconds, executor.completed_steps, executor.termination, failure, lateness
    )


def _step_to_end(
    executor: Executor,
    events: Mapping[int, Sequence[Event]],
    observers: Sequence[Observer],
    pacer: Pacer | None,
    step_hook: StepHook | None,
) -> None:
    """Run all macro steps, interrupted at events and whenever the observers are called."""
    if pacer:
        pacer.start()
    components, count = executor.plan.system.components, executor.plan.grid.count
    observed = set(range(0, count, max(1, count // 100))) if observers else set()
    for stop in sorted({*(n for n in events if n < count), *observed, count}):
        if pacer or step_hook:
            _run_in_single_steps(executor, stop, pacer, step_hook)
        else:
            executor.run(stop)
        for observe in observers:
            observe(executor.completed_steps, count)
        if executor.termination:
            return
        for event in events.get(stop, ()):
            _apply_event(event, components)


def _run_in_single_steps(executor: Executor, stop: int, pacer: Pacer | None, step_hook: StepHook | None) -> None:
    """Run until communication point `stop` or until a component requests termination, with hook and pacer at every step."""
    for n in range(executor.completed_steps + 1, stop + 1):
        if step_hook:
            step_hook(n - 1)
        executor.run(n)
        if executor.termination:
            return
        if pacer:
            with suspending_deadline():
                pacer.wait(n)


def _apply_event(event: Event, components: Mapping[str, Component]) -> None:
    for name, values in event.values.items():
        for variable, value in values.items():
            components[name].set(variable, value)
