"""The run loop: initialize, step from event to event, tell the observers, and always clean up."""

from __future__ import annotations

import time as wall
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from .component import Component
from .engine import Executor, Kind, Recorder, Termination, compile_plan, executor_kind
from .errors import InputError, Problem
from .recording import Recording
from .system import Endpoint, System
from .timing import Grid

#: called with (finished macro steps, all macro steps); observers only look
Observer = Callable[[int, int], None]


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

    `finite`: a connected output that is not finite ends the run.
    """

    start_time: Fraction
    stop_time: Fraction
    step_size: Fraction
    columns: Mapping[str, Endpoint] = field(default_factory=dict)
    record_interval: Fraction | None = None
    events: Sequence[Event] = ()
    executor: Kind = "auto"
    finite: bool = True


@dataclass(frozen=True)
class Run:
    """What came of it. `failure` is the error that ended the run early; the rows until then are in the recording."""

    recording: Recording
    loop_seconds: float
    macro_steps: int
    termination: Termination | None
    failure: BaseException | None


def simulate(system: System, settings: Settings, observers: Sequence[Observer] = ()) -> Run:
    """Simulate a system whose components have just been made; they are freed in every case.

    Raises InputError when the system or the settings cannot be simulated. Failures while running are kept in the returned
    run, with everything recorded before.
    """
    with ExitStack() as stack:
        for component in system.components.values():
            stack.callback(component.free)
        if found := problems(system, settings):
            raise InputError(found)
        grid = Grid.of(settings.start_time, settings.stop_time, settings.step_size)
        plan = compile_plan(system, grid, settings.columns.values())
        recorder = Recorder(plan, settings.columns, int((settings.record_interval or grid.step) / grid.step))
        executor = executor_kind(settings.executor)(plan, recorder, finite=settings.finite)
        events = {grid.index(event.time): [] for event in settings.events}  # type: dict[int, list[Event]]
        for event in settings.events:
            events[grid.index(event.time)].append(event)
        failure, loop_seconds = None, 0.0
        try:
            executor.initialize()
            began = wall.perf_counter()
            try:
                _loop(executor, events, observers)
            finally:
                loop_seconds = wall.perf_counter() - began
            for component in system.components.values():
                component.terminate()
        except (Exception, KeyboardInterrupt) as error:
            failure = error
        return Run(recorder.recording(), loop_seconds, executor.finished, executor.termination, failure)


def _loop(executor: Executor, events: Mapping[int, Sequence[Event]], observers: Sequence[Observer]) -> None:
    """From event to event and from look to look of the observers."""
    components, count = executor.plan.system.components, executor.plan.grid.count
    looks = set(range(0, count, max(1, count // 100))) if observers else set()
    for stop in sorted({*(n for n in events if n < count), *looks, count}):
        executor.run(stop)
        for observe in observers:
            observe(executor.finished, count)
        if executor.termination:
            return
        for event in events.get(stop, ()):
            _act(event, components)


def _act(event: Event, components: Mapping[str, Component]) -> None:
    for name, values in event.values.items():
        for variable, value in values.items():
            components[name].set(variable, value)


def problems(system: System, settings: Settings) -> list[Problem]:
    """Everything that keeps a system from being simulated with these settings; empty when it can run."""
    found = [*system.problems(), *_event_problems(system, settings.events)]
    try:
        grid = Grid.of(settings.start_time, settings.stop_time, settings.step_size)
    except ValueError as error:
        found.append(Problem(str(error), subject=("stop_time",)))
        if settings.step_size <= 0:
            return found
        grid = Grid.of(settings.start_time, settings.start_time, settings.step_size)
    found += _period_problems(system, grid)
    interval = settings.record_interval or grid.step
    if interval < grid.step or (interval / grid.step).denominator != 1:
        text = f"recording interval {float(interval)!r} s is no multiple of the step size {float(grid.step)!r} s"
        found.append(Problem(text, subject=("record", "interval")))
    for event in settings.events:
        try:
            grid.index(event.time)
        except ValueError as error:
            found.append(Problem(f"event time {error}", event.where))
    return found


def _period_problems(system: System, grid: Grid) -> Iterator[Problem]:
    step, duration = float(grid.step), float(grid.step * grid.count)
    for name, period in system.periods.items():
        subject = ("components", name, "period")
        ratio = period / grid.step
        if ratio < 1 or ratio.denominator != 1:
            yield Problem(f"period {float(period)!r} s is no multiple of the step size {step!r} s", subject=subject)
        elif grid.count % int(ratio):
            yield Problem(f"the duration {duration!r} s is no multiple of the period {float(period)!r} s", subject=subject)


def _event_problems(system: System, events: Iterable[Event]) -> list[Problem]:
    """Events may set tunable parameters and inputs that nothing feeds."""
    fed = {connection.target for connection in system.connections}
    found = []
    for event in events:
        for name, values in event.values.items():
            variables = {variable.name: variable for variable in system.components[name].variables}
            for variable_name in values:
                variable = variables[variable_name]
                if variable.causality == "input" and any(Endpoint(name, slot) in fed for slot in variable.slots):
                    text = f"{name}.{variable_name} is fed by a connection, an event cannot set it"
                elif variable.causality != "input" and (variable.causality, variable.variability) != ("parameter", "tunable"):
                    text = f"{name}.{variable_name} is neither a tunable parameter nor an input, an event cannot set it"
                else:
                    continue
                found.append(Problem(text, event.where))
    return found
