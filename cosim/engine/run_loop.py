"""The run loop: initialize a system, step it with its events and observers, and free its components in every case."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, nullcontext
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
from ..process.float_mode import default_float_mode
from ..process.forks import attributing_forks, report_forks
from ..process.journal import MARKER_SIZE, Phase, calling_component, current_journal, suspending_deadline
from ..process.process_state import restoring_process_state
from . import Executor, Plan, Recorder, Termination, compile_plan, executor_class
from .disk_space import find_space_problems
from .initialization import instantiate_components
from .pacer import Pacer
from .saving_recorder import SavingRecorder
from .settings import Event, Settings

#: called with (completed macro steps, all macro steps); must not change the system
Observer = Callable[[int, int], None]

#: called with n before the macro step that starts at communication point n; may wait, and may set variables like an event
StepHook = Callable[[int], None]


@dataclass(frozen=True)
class SimulationOutcome:
    """Result of a run.

    Attributes:
        recording: the recorded rows; after a failure, the rows until then.
        timing: wall time (s) of extracting and instantiating ("instantiate_seconds"), of initialization mode
            ("initialize_seconds") and of the stepping loop ("loop_seconds").
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


def simulate(
    system: System, settings: Settings, observers: Sequence[Observer] = (), step_hook: StepHook | None = None
) -> SimulationOutcome:
    """Simulate a system of new components, and free them in every case.

    Args:
        system: the components must not have been used before.
        settings: when and how to simulate.
        observers: called about 100 times during the run.
        step_hook: called before every macro step.

    Returns:
        The outcome. An error during the run is its `failure`; the rows recorded before are in its `recording`.

    Raises:
        InputError: the system cannot be simulated with these settings.
        ComponentError: a component cannot be freed.
    """
    outcome = None
    try:
        plan = compile_plan(system, settings)
    except BaseException:
        free_components(system.components)
        raise
    try:
        with simulating(plan, observers, step_hook) as outcome:
            pass
    except ComponentError as error:  # from terminate or free
        if outcome is None:
            raise
        outcome = replace(outcome, failure=error)
    return outcome


@contextmanager
def simulating(plan: Plan, observers: Sequence[Observer] = (), step_hook: StepHook | None = None) -> Iterator[SimulationOutcome]:
    """Simulate a plan like `simulate`, but terminate and free its components only at the end of the block.

    The block can save the outcome first, so that a crash in terminate or free cannot lose it.

    Args:
        plan: the compiled system.
        observers: called about 100 times during the run.
        step_hook: called before every macro step.

    Yields:
        The outcome, after the last step.

    Raises:
        InputError: the recorded rows are larger than the free disk space.
        ComponentError: a component failed in terminate or free.
    """
    components = plan.system.components
    completed = False
    with default_float_mode():
        try:
            if problems := _space_problems(plan):
                raise InputError(problems)
            outcome = _run(_create_executor(plan), observers, step_hook)
            yield outcome
            completed = outcome.failure is None
        finally:
            try:
                with restoring_process_state(join_alternatives(components)):
                    _end_components(components, terminate=completed)
            finally:
                report_forks()


def _end_components(components: Mapping[str, Component], terminate: bool) -> None:
    """Free all components, even if one of them fails; call `terminate` first if requested."""
    with ExitStack() as stack:
        stack.callback(free_components, components)
        for name, component in components.items() if terminate else ():
            with calling_component(name, "terminate", "end"):
                component.terminate()


def free_components(components: Mapping[str, Component]) -> None:
    """Free all components, even if freeing one of them fails.

    Raises:
        ComponentError: a component cannot be freed.
    """
    with ExitStack() as stack:
        for name, component in components.items():
            stack.callback(_free_component, name, component)


def _free_component(name: str, component: Component) -> None:
    with calling_component(name, "free", "end"):
        component.free()


def _space_problems(plan: Plan) -> list[Problem]:
    journal, settings = current_journal(), plan.settings
    rows = (journal and journal.folder) or (settings.rows_file and settings.rows_file.parent)
    return find_space_problems(plan, rows or Path(tempfile.gettempdir()), csv=bool(journal and journal.csv_path))


def _create_executor(plan: Plan) -> Executor:
    journal, settings = current_journal(), plan.settings
    if journal and journal.folder and not settings.rows_file:
        recorder: Recorder = SavingRecorder(plan, journal.folder)
    else:
        recorder = Recorder(plan, settings.rows_file)
    marker = None if journal is None else np.frombuffer(journal.memory, np.int64, MARKER_SIZE)
    return executor_class(settings.executor)(plan, recorder, marker)


def _run(executor: Executor, observers: Sequence[Observer], step_hook: StepHook | None) -> SimulationOutcome:
    journal, plan, watch = current_journal(), executor.plan, Stopwatch()
    settings, components = plan.settings, plan.system.components
    pacer = Pacer(plan.grid, settings.real_time, settings.late) if settings.real_time else None
    names, runs_foreign_code = join_alternatives(components), any(c.runs_foreign_code for c in components.values())
    failure = None
    try:
        with restoring_process_state(names):
            with watch.measure("instantiate_seconds"):
                instantiate_components(plan)
            with watch.measure("initialize_seconds"):
                executor.initialize()
        if journal:
            journal.enter_phase(Phase.STEPPING, journal.deadlines.step)
        loop_state = restoring_process_state(names) if runs_foreign_code else nullcontext()
        with loop_state, attributing_forks(executor.describe_call), watch.measure("loop_seconds"):
            _step_to_end(executor, observers, pacer, step_hook)
    except (Exception, KeyboardInterrupt) as error:
        failure = error
    finally:
        executor.close()
    if journal:
        journal.enter_phase(Phase.IDLE)
    report_forks()
    component_log.report_dropped_messages()
    recording, lateness = executor.recorder.recording(), pacer.statistics() if pacer else None
    return SimulationOutcome(recording, watch.seconds, executor.completed_steps, executor.termination, failure, lateness)


def _step_to_end(executor: Executor, observers: Sequence[Observer], pacer: Pacer | None, step_hook: StepHook | None) -> None:
    """Run all macro steps, interrupted at events and whenever the observers are called."""
    if pacer:
        pacer.start()
    plan, count = executor.plan, executor.plan.grid.count
    observed = set(range(0, count, max(1, count // 100))) if observers else set()
    for stop in sorted({*(n for n in plan.events if n < count), *observed, count}):
        if pacer or step_hook:
            _run_in_single_steps(executor, stop, pacer, step_hook)
        else:
            executor.run(stop)
        for observe in observers:
            observe(executor.completed_steps, count)
        if executor.termination:
            return
        for event in plan.events.get(stop, ()):
            _apply_event(event, plan.system.components)


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
