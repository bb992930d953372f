"""A plan that is being simulated, and simulation of a system from its start to its end.

Initialize its components, step them with events and observers, and free them in every case.
"""

import os
import tempfile
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, closing, contextmanager, nullcontext, suppress
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from ..core import component_log
from ..core.component import Component
from ..core.errors import ComponentError, InputError, join_alternatives
from ..core.recording import Recording
from ..core.system import System
from ..process.float_mode import default_float_mode, is_default
from ..process.journal import (
    MARKER_SIZE,
    OVERWRITTEN,
    Journal,
    Phase,
    attributing_forks,
    calling_component,
    current_journal,
    report_forks,
    suspending_deadline,
)
from ..process.process_state import call_restoring_process_state, restoring_process_state
from . import Executor, Plan, Recorder, Termination, compile_plan, executor_class
from .component_states import ComponentStates, SavedState
from .initialization import instantiate_components
from .pacer import Pacer, Stopwatch
from .recorder import SavingRecorder, find_space_problems
from .settings import Settings

#: called with (completed macro steps, all macro steps); must not change the system
Observer = Callable[[int, int], None]

#: called with n before the macro step that starts at communication point n; may wait, and may set
#: variables like an event
StepHook = Callable[[int], None]


@dataclass(frozen=True)
class SimulationOutcome:
    """Result of a run.

    Attributes:
        recording: the recorded rows; after a failure, the rows until then.
        timing: wall time (s) of extracting and instantiating ("instantiate_seconds"), of
            initialization mode ("initialize_seconds") and of the stepping loop ("loop_seconds").
        macro_steps: number of completed macro steps.
        termination: a component's request to end the simulation, if there was one.
        failure: the error that ended the run early, if there was one.
        real_time: lateness of the steps, see `pacer.Pacer.statistics`; None for a run without
            pacing.
    """

    recording: Recording
    timing: Mapping[str, float]
    macro_steps: int
    termination: Termination | None
    failure: BaseException | None
    real_time: Mapping[str, Any] | None = None


class PlanRun:
    """A plan that is being simulated.

    Call `initialize`, then `advance` as often as needed, and `close` in every case.

    Every method that runs components sets the default floating-point mode, and restores the state
    of the process that components have changed. The first error is final: the components are then
    in an unknown state, and `close` only frees them.

    Attributes:
        executor: steps the components.
        failure: the error that ended the simulation early, if there was one.
        is_finished: true at the last communication point, and after a component has requested
            termination.
    """

    def __init__(
        self, plan: Plan, step_hook: StepHook | None = None, executor: type[Executor] | None = None
    ):
        """Create the executor of a plan.

        Args:
            plan: the compiled system. The run owns its components, and frees them also if it cannot
                be created.
            step_hook: called before every macro step.
            executor: class of the executor; None: as the settings of the plan choose it.

        Raises:
            InputError: the recorded rows are larger than the free disk space.
        """
        self._components, settings = plan.system.components, plan.settings
        try:
            journal = current_journal()
            # a later run of this process, such as that of a KPI that simulates, has no journal
            self._journal = journal = journal if journal and journal.claim() else None
            rows_file = settings.rows_file
            folder = (journal and journal.folder) or (rows_file and rows_file.parent)
            if problems := find_space_problems(
                plan,
                folder or Path(tempfile.gettempdir()),
                csv=bool(journal and journal.writes_csv),
            ):
                raise InputError(problems)
            self.executor = _create_executor(plan, executor, self._journal)
        except BaseException:
            free_components(self._components)
            raise
        self.failure: BaseException | None = None
        self._plan, self._step_hook, self._watch = plan, step_hook, Stopwatch()
        self._pacer = (
            Pacer(plan.grid, settings.real_time, settings.late) if settings.real_time else None
        )
        self._names = join_alternatives(self._components)
        self._runs_foreign_code = any(
            component.runs_foreign_code for component in self._components.values()
        )
        self._event_points = sorted(n for n in plan.events if n < plan.grid.count)
        #: values to set in the next step: name of a component and values by variable
        self._pending: list[tuple[str, Mapping[str, Any]]] = []
        self.is_finished = self._is_initialized = self._is_closed = False
        self._states = ComponentStates(self._components, self.accessing)

    def initialize(self) -> None:
        """Bring the components to step mode, record the initial outputs and apply the first events.

        Raises:
            ComponentError: a component failed.
            InputError: a component cannot be instantiated.
        """
        try:
            with default_float_mode(), restoring_process_state(self._names):
                with self._watch.measure("instantiate_seconds"):
                    instantiate_components(self._plan)
                with self._watch.measure("initialize_seconds"):
                    self.executor.initialize()
        except BaseException as error:
            self.failure = error
            raise
        self._is_initialized = True
        if self._pacer:
            self._pacer.start()
        self.advance(0)

    def advance(self, end: int, observers: Sequence[Observer] = ()) -> None:
        """Run macro steps until communication point `end`, or until a component requests the end.

        Args:
            end: number of a communication point, at most that of the stop time.
            observers: called about 100 times.

        Raises:
            ComponentError: a component failed.
            LateError: the run fell behind real time.
        """
        journal, began = self._journal, perf_counter()
        if journal:
            journal.enter_phase(Phase.STEPPING, journal.deadlines.step)
        try:
            with (
                nullcontext() if is_default() else default_float_mode(),
                attributing_forks(self.executor.describe_call),
            ):
                if self._runs_foreign_code:
                    call_restoring_process_state(self._names, self._run_to_stops, end, observers)
                else:
                    self._run_to_stops(end, observers)
        except BaseException as error:
            self.failure = error
            raise
        finally:
            self._watch.add("loop_seconds", perf_counter() - began)
            if journal:
                if not journal.is_valid:  # overwritten: the supervisor reports it, and has the rows
                    os._exit(70)
                journal.enter_phase(Phase.IDLE)
            self.is_finished = self.executor.is_finished
            if self.failure or (
                self.is_finished and not self._states
            ):  # else a saved state may be restored
                self.executor.close()

    def _run_to_stops(self, end: int, observers: Sequence[Observer]) -> None:
        """Run up to `end`, interrupted at events and whenever the observers are called."""
        executor, begin, events = self.executor, self.executor.completed_steps, self._event_points
        if self._pending:
            self._set_pending()
        if not (observers or events or self._pacer or self._step_hook):
            executor.run(end)
            return
        observed = range(begin, end, max(1, (end - begin) // 100)) if observers else ()
        between = (
            events[bisect_left(events, begin) : bisect_right(events, end)] if events else events
        )
        for stop in sorted({*between, *observed, end}) if between or observed else (end,):
            if self._pacer or self._step_hook:
                self._run_in_single_steps(stop)
            else:
                executor.run(stop)
            for observe in observers:
                observe(executor.completed_steps, self._plan.grid.count)
            if executor.termination:
                return
            if stop > begin or not end:
                self._apply_events(stop)

    def _run_in_single_steps(self, stop: int) -> None:
        """Run until communication point `stop` or a request to end, with hook and pacer."""
        for n in range(self.executor.completed_steps + 1, stop + 1):
            if self._step_hook:
                self._step_hook(n - 1)
            self.executor.run(n)
            if self.executor.termination:
                return
            if self._pacer:
                with suspending_deadline():
                    self._pacer.wait(n)

    def _apply_events(self, point: int) -> None:
        for event in self._plan.events.get(point, ()) if point < self._plan.grid.count else ():
            for name, values in event.values.items():
                for variable, value in values.items():
                    self._components[name].set(variable, value)

    def set_in_next_step(self, component: str, values: Mapping[str, Any]) -> None:
        """Set variables of a component before the next call of a component.

        Until then nothing is called, so that the process needs no protection.

        Args:
            component: name of the component.
            values: checked values by the names of tunable parameters and unconnected inputs.
        """
        self._pending.append((component, values))

    def _set_pending(self) -> None:
        pending, self._pending = self._pending, []
        for component, values in pending:
            with calling_component(component, "set", "step", self.executor.time):
                for variable, value in values.items():
                    self._components[component].set(variable, value)

    @contextmanager
    def accessing(self, component: str, function: str) -> Iterator[None]:
        """Protect the process from a component that is called between two steps in this block.

        Raises:
            ComponentError: the component failed, which ends the simulation.
        """
        time = self.executor.time
        try:
            with (
                default_float_mode(),
                restoring_process_state(component if not self._pending else self._names),
            ):
                if self._pending:
                    self._set_pending()
                with calling_component(component, function, "step", time):
                    yield
        except ComponentError as error:
            self.failure = error
            raise

    def save(self) -> SavedState:
        """Return the present state of the executor and of all components.

        Raises:
            InputError: a component cannot return to a state.
            ComponentError: a component failed.
        """
        return SavedState(self._states, self.executor.save(), self._states.save())

    def restore(self, saved: SavedState) -> None:
        """Return to a state that `save` returned; the rows recorded since then are forgotten.

        Raises:
            InputError: the state belongs to another simulation, or to this one before it was reset.
            ComponentError: a component failed.
        """
        if saved.owner is not self._states:
            raise InputError(
                "the state was saved by another simulation, or by this one before it was reset"
            )
        self._states.restore(saved.components)
        self.executor.restore(saved.executor)
        self.is_finished = self.executor.is_finished
        if self._pacer:
            self._pacer.start(self.executor.completed_steps)

    def outcome(self) -> SimulationOutcome:
        """Return everything recorded and measured so far."""
        report_forks()
        component_log.report_dropped_messages()
        executor, lateness = self.executor, self._pacer.statistics() if self._pacer else None
        recording = executor.recorder.recording()
        return SimulationOutcome(
            recording,
            self._watch.seconds,
            executor.completed_steps,
            executor.termination,
            self.failure,
            lateness,
        )

    def close(self) -> None:
        """Terminate the components unless one of them failed, and free them all.

        Later calls do nothing.

        A component that fails here changes no result, so its failure is logged as a warning.

        Raises:
            ComponentError: a component has overwritten memory that is not its own.
        """
        if self._is_closed:
            return
        self._is_closed = True
        self.executor.close()
        try:
            with default_float_mode(), restoring_process_state(self._names):
                try:
                    if not self.failure:
                        self._states.free_all()
                finally:
                    try:
                        if self._is_initialized and not self.failure:
                            for name, component in self._components.items():
                                _call_or_warn(name, "terminate", component.terminate)
                    finally:
                        free_components(self._components)
        finally:
            report_forks()


def free_components(components: Mapping[str, Component]) -> None:
    """Free all components; a failure is logged as a warning."""
    with ExitStack() as stack:
        for name, component in components.items():
            stack.callback(_call_or_warn, name, "free", component.free)


def _call_or_warn(component: str, name: str, function: Callable[[], None]) -> None:
    """Call a function of a component after its last step; log a warning if it fails.

    Raises:
        ComponentError: the component has overwritten memory that is not its own, so the results may
            be wrong.
    """
    try:
        with calling_component(component, name, "end"):
            function()
    except ComponentError as error:
        if error.reason == OVERWRITTEN:
            raise
        component_log.log_message(
            component, component_log.WARNING, f"{error.function} failed: {error.reason}"
        )


def _create_executor(
    plan: Plan, executor: type[Executor] | None, journal: Journal | None
) -> Executor:
    settings = plan.settings
    if journal and journal.folder and not settings.rows_file:
        recorder: Recorder = SavingRecorder(plan, journal.folder)
    else:
        recorder = Recorder(plan, settings.rows_file)
    marker = None if journal is None else np.frombuffer(journal.memory, np.int64, MARKER_SIZE)
    return (executor or executor_class(settings.executor))(plan, recorder, marker)


def simulate(
    system: System,
    settings: Settings,
    observers: Sequence[Observer] = (),
    step_hook: StepHook | None = None,
) -> SimulationOutcome:
    """Simulate a system of new components, and free them in every case.

    Args:
        system: the components must not have been used before.
        settings: when and how to simulate.
        observers: called about 100 times during the run.
        step_hook: called before every macro step.

    Returns:
        The outcome. An error during the run is its `failure`; the rows recorded before are in its
        `recording`.

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
def simulating(
    plan: Plan, observers: Sequence[Observer] = (), step_hook: StepHook | None = None
) -> Iterator[SimulationOutcome]:
    """Simulate a plan like `simulate`, but free its components only at the end of the block.

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
    with default_float_mode(), closing(PlanRun(plan, step_hook)) as run:
        with suppress(Exception, KeyboardInterrupt):  # it is the failure of the outcome
            run.initialize()
            run.advance(plan.grid.count, observers)
        try:
            yield run.outcome()
        except BaseException as error:
            run.failure = run.failure or error
            raise
