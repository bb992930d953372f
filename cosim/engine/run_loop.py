"""The run loop: initialize, step from event to event, tell the observers, and always clean up."""

from __future__ import annotations

import shutil
import tempfile
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from fractions import Fraction
from math import inf
from pathlib import Path
from typing import Any

import numpy as np

from ..core import component_log
from ..core.component import Component, Variable
from ..core.errors import ComponentError, InputError, Problem, join_alternatives
from ..core.recording import Recording
from ..core.stopwatch import Stopwatch
from ..core.system import Endpoint, System
from ..core.time_grid import TimeGrid
from ..process.float_mode import default_float_mode
from ..process.journal import Phase, calling_component, current_journal, suspending_deadline
from ..process.process_state import restoring_process_state
from . import MARKER_SIZE, Executor, ExecutorKind, Recorder, Termination, compile_plan, executor_class
from .pacer import LatePolicy, Pacer
from .saving_recorder import SavingRecorder, write_header

#: bytes that a recorded number takes in rows and in CSV, about; what takes less than so many is not looked at
_BYTES_PER_VALUE, _SIZE_CHECK_THRESHOLD = 8 + 20, 1_000_000_000

#: called with (finished macro steps, all macro steps); observers only look
Observer = Callable[[int, int], None]

#: called with n before the step that starts at communication point n; it may take its time, and set variables as events do
StepHook = Callable[[int], None]


@dataclass(frozen=True, slots=True)
class Event:
    """At `time` (s, exact), before the step that starts there, variables of components are set to values.

    An event after the stop time does not happen.
    """

    time: Fraction
    values: Mapping[str, Mapping[str, Any]]
    where: str = ""


@dataclass(frozen=True)
class Settings:
    """When and how a system is simulated; times in seconds, exact. `columns` maps recorded names to outputs.

    `finite`: a connected output that is not finite ends the run. `real_time`: simulated seconds per second on the wall, None for
    as fast as possible; `late` says what happens when a step is ready more than one step too late.
    `control` steers the run from outside, step by step.
    `rows_file`: where the rows are kept while the run goes on; by default in memory, or in a temporary file when they are many.
    """

    start_time: Fraction
    stop_time: Fraction
    step_size: Fraction
    columns: Mapping[str, Endpoint] = field(default_factory=dict)
    record_interval: Fraction | None = None
    events: Sequence[Event] = ()
    executor: ExecutorKind = "auto"
    require_finite: bool = True
    real_time: float | None = None
    late: LatePolicy = "warn"
    step_hook: StepHook | None = None
    rows_file: Path | None = None


@dataclass(frozen=True)
class SimulationOutcome:
    """What came of it. `failure` is the error that ended the run early; the rows until then are in the recording.

    `timing`: wall time (s) of checking the system and laying out the plan ("wiring_seconds"), extracting and instantiating
    ("instantiate_seconds"), initialization mode ("initialize_seconds") and the stepping loop alone ("loop_seconds").
    `real_time`: how well the run kept up, see `pacer.Pacer.statistics`; None when it was not asked to.
    """

    recording: Recording
    timing: Mapping[str, float]
    macro_steps: int
    termination: Termination | None
    failure: BaseException | None
    real_time: Mapping[str, Any] | None = None

    @property
    def loop_seconds(self) -> float:
        """Wall time of the stepping loop alone; 0 when it was not reached."""
        return self.timing.get("loop_seconds", 0.0)


def simulate(system: System, settings: Settings, observers: Sequence[Observer] = ()) -> SimulationOutcome:
    """Simulate a system whose components have just been made; they are freed in every case.

    Raises InputError when the system or the settings cannot be simulated. Failures while running are kept in the returned
    run, with everything recorded before.
    """
    run = None
    try:
        with simulating(system, settings, observers) as run:
            pass
    except ComponentError as error:  # while terminating
        if run is None:
            raise
        run = replace(run, failure=error)
    return run


@contextmanager
def simulating(system: System, settings: Settings, observers: Sequence[Observer] = ()) -> Iterator[SimulationOutcome]:
    """As `simulate`, but the components are terminated and freed when the block is left: whatever they do then, the run is safe.

    Raises ComponentError at the end when a component fails to terminate.
    """
    with default_float_mode(), ExitStack() as stack:
        for name, component in system.components.items():
            stack.callback(_free_component, name, component)
        watch = Stopwatch()
        with watch.measure("wiring_seconds"):
            if found := find_problems(system, settings):
                raise InputError(found)
            executor = _create_executor(system, settings)
        run = _run_executor(executor, settings, observers, watch)
        yield run
        if run.failure is None:
            for name, component in system.components.items():
                with calling_component(name, "terminate", "end"):
                    component.terminate()


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
            executor.instantiate()
        with watch.measure("initialize_seconds"):
            executor.initialize()
        if journal and journal.folder:
            write_header(journal.folder, executor)
        if journal:
            journal.enter_phase(Phase.STEPPING, journal.deadlines.step)
        with restoring_process_state(join_alternatives(executor.plan.system.components)), watch.measure("loop_seconds"):
            _step_to_end(executor, events, observers, pacer, settings.step_hook)
    except (Exception, KeyboardInterrupt) as error:
        failure = error
    finally:
        executor.close()
    if journal:
        journal.enter_phase(Phase.IDLE)
    component_log.report_dropped_messages()
    kept_up = pacer.statistics() if pacer else None
    return SimulationOutcome(
        recorder.recording(), watch.seconds, executor.completed_steps, executor.termination, failure, kept_up
    )


def _step_to_end(
    executor: Executor,
    events: Mapping[int, Sequence[Event]],
    observers: Sequence[Observer],
    pacer: Pacer | None,
    control: StepHook | None,
) -> None:
    """From event to event and from look to look of the observers."""
    if pacer:
        pacer.start()
    components, count = executor.plan.system.components, executor.plan.grid.count
    looks = set(range(0, count, max(1, count // 100))) if observers else set()
    for stop in sorted({*(n for n in events if n < count), *looks, count}):
        _advance_to(executor, stop, pacer, control)
        for observe in observers:
            observe(executor.completed_steps, count)
        if executor.termination:
            return
        for event in events.get(stop, ()):
            _apply_event(event, components)


def _advance_to(executor: Executor, stop: int, pacer: Pacer | None, control: StepHook | None) -> None:
    """To communication point `stop`, or until a component asks to terminate."""
    if pacer is None and control is None:
        executor.run(stop)
        return
    for n in range(executor.completed_steps + 1, stop + 1):
        if control:
            control(n - 1)
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


def find_problems(system: System, settings: Settings) -> list[Problem]:
    """Everything that keeps a system from being simulated with these settings; empty when it can run."""
    found = [*system.problems(), *_find_event_problems(system, settings.events)]
    if settings.real_time is not None and not 0 < settings.real_time < inf:
        found.append(Problem(f"expected a positive factor for real time, found {settings.real_time!r}"))
    try:
        grid = TimeGrid.from_times(settings.start_time, settings.stop_time, settings.step_size)
    except ValueError as error:
        found.append(Problem(str(error), subject=("stop_time",)))
        if settings.step_size <= 0:
            return found
        grid = TimeGrid.from_times(settings.start_time, settings.start_time, settings.step_size)
    found += _find_period_problems(system, grid)
    interval = settings.record_interval or grid.step
    if interval < grid.step or (interval / grid.step).denominator != 1:
        text = f"recording interval {float(interval)!r} s is no multiple of the step size {float(grid.step)!r} s"
        found.append(Problem(text, subject=("record", "interval")))
    elif text := _find_disk_space_problem(settings, grid, int(interval / grid.step)):
        found.append(Problem(text, subject=("step_size",)))
    for event in settings.events:
        try:
            grid.index(event.time)
        except ValueError as error:
            found.append(Problem(f"event time {error}", event.where, subject=("events",)))
    return found


def _find_disk_space_problem(settings: Settings, grid: TimeGrid, every: int) -> str:
    """Why there is no room for what is to be recorded; "" when there is."""
    rows = grid.count // every + 1
    size = rows * (len(settings.columns) + 1) * _BYTES_PER_VALUE
    if size < _SIZE_CHECK_THRESHOLD:
        return ""
    journal = current_journal()
    folder = (journal and journal.folder) or Path(tempfile.gettempdir())
    free = shutil.disk_usage(folder).free
    table = f"{rows} rows of {len(settings.columns)} signals take about {size / 1e9:.3g} GB"
    text = f"{table}, {free / 1e9:.3g} GB are free in {folder}"
    return f'{text}; make the step longer, or set "record": {{"interval": ...}}' if size > free else ""


def _find_period_problems(system: System, grid: TimeGrid) -> Iterator[Problem]:
    step, duration = float(grid.step), float(grid.step * grid.count)
    for name, period in system.periods.items():
        subject = ("components", name, "period")
        ratio = period / grid.step
        if ratio < 1 or ratio.denominator != 1:
            yield Problem(f"period {float(period)!r} s is no multiple of the step size {step!r} s", subject=subject)
        elif grid.count % int(ratio):
            yield Problem(f"the duration {duration!r} s is no multiple of the period {float(period)!r} s", subject=subject)


def settable_variables(system: System) -> Iterator[tuple[str, Variable]]:
    """Components and their variables that can be set while a run goes on."""
    fed = {connection.target for connection in system.connections}
    for name, component in system.components.items():
        for variable in component.variables:
            if not _not_settable_reason(name, variable, fed):
                yield name, variable


def _not_settable_reason(name: str, variable: Variable, fed: Set[Endpoint]) -> str:
    """Why an event cannot set a variable; it can set tunable parameters and inputs that nothing feeds."""
    if variable.causality == "input" and any(Endpoint(name, slot) in fed for slot in variable.scalar_names):
        return f"{name}.{variable.name} is fed by a connection, an event cannot set it"
    if variable.causality != "input" and (variable.causality, variable.variability) != ("parameter", "tunable"):
        return f"{name}.{variable.name} is neither a tunable parameter nor an input, an event cannot set it"
    return ""


def _find_event_problems(system: System, events: Iterable[Event]) -> list[Problem]:
    fed = {connection.target for connection in system.connections}
    found = []
    for event in events:
        for name, values in event.values.items():
            variables = {variable.name: variable for variable in system.components[name].variables}
            texts = (_not_settable_reason(name, variables[variable_name], fed) for variable_name in values)
            found += [Problem(text, event.where) for text in texts if text]
    return found
