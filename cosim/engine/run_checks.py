"""Checks of a system and its settings before a run, and of variables to set during a run."""

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence, Set
from dataclasses import replace
from fractions import Fraction
from math import ceil, gcd, inf, lcm, ulp

from ..core.component import Variable
from ..core.errors import InputError, Problem, abbreviate_names
from ..core.size_limits import MAX_DELAYED_VALUES, format_count
from ..core.system import Endpoint, System
from ..core.time_grid import TimeGrid, time_text
from .settings import Event, Settings

#: longest wall time of a step of a run in real time (s)
MAX_STEP_DURATION = 1_000_000
#: smallest step in units in the last place of the times; its length is then exact to 1 %
MIN_ULPS_PER_STEP = 100


def check_run(system: System, settings: Settings) -> TimeGrid:
    """Check that the system can be simulated with these settings; return its communication points.

    The last one is the stop time if the components whose steps do not end there can make a shorter
    last step. Otherwise it is the last point before it at which the steps of all components end.

    Raises:
        InputError: it cannot. The `subject` of each problem names the setting: ("stop_time",),
            ("components", NAME, "period"), ("events", "time"), ...
    """
    problems = [*system.problems(), *_find_event_problems(system, settings.events)]
    problems += _find_real_time_problems(settings)
    step = _fitting_step(system, settings)
    if step != settings.step_size:
        problems.append(_step_problem(system, settings, step))
    try:
        grid = TimeGrid.from_times(settings.start_time, settings.stop_time, step)
    except ValueError as error:
        problems.append(Problem(str(error), subject=("stop_time",)))
        if step <= 0:
            raise InputError(problems) from None
        grid = TimeGrid.from_times(settings.start_time, settings.start_time, step)
    problems += _find_resolution_problems(settings)
    problems += _find_period_problems(system, settings, grid)
    problems += _find_delay_problems(system)
    for event in settings.events:
        try:
            grid.index(event.time)
        except ValueError as error:
            problems.append(Problem(f"event time {error}", event.where, subject=("events", "time")))
    if problems:
        raise InputError(problems)
    if not components_with_fixed_steps(system, settings):
        return grid.ending_at(settings.stop_time)
    common = lcm(*(int(period / grid.step) for period in system.periods.values()))
    if 0 < grid.count < common:
        text = (
            f"the steps of all components end together only after {float(common * grid.step)!r} s, "
            "after the stop time"
        )
        raise InputError(Problem(text, subject=("stop_time",)))
    return replace(grid, count=grid.count - grid.count % common)


def components_with_fixed_steps(system: System, settings: Settings) -> list[str]:
    """Return the components whose last step cannot be short enough to end at the stop time."""
    duration = settings.stop_time - settings.start_time
    return [
        name
        for name, component in system.components.items()
        if not component.variable_step
        and (duration / system.periods.get(name, settings.step_size)).denominator != 1
    ]


def _find_real_time_problems(settings: Settings) -> Iterator[Problem]:
    factor = settings.real_time
    if factor is None:
        return
    if not 0 < factor < inf:
        yield Problem(f"expected a positive factor for real time, found {factor!r}")
    elif settings.step_size > MAX_STEP_DURATION * Fraction(factor):
        text = (
            f"a step of {float(settings.step_size)!r} s takes more than {MAX_STEP_DURATION} s of "
            "wall time"
        )
        yield Problem(f"{text} with the factor {factor!r} for real time")


def _find_resolution_problems(settings: Settings) -> Iterator[Problem]:
    """Yield a problem if the step size is too small for the resolution of times in float64."""
    largest = max(abs(float(settings.start_time)), abs(float(settings.stop_time)))
    if settings.step_size < MIN_ULPS_PER_STEP * Fraction(ulp(largest)):
        step = f"a step of {float(settings.step_size)!r} s is not resolved at t = {largest!r} s"
        text = f"{step}, where the times of components are {ulp(largest):.3g} s apart"
        yield Problem(
            f"{text}; make the step longer, or move the times towards 0", subject=("step_size",)
        )


def settable_variables(system: System) -> Iterator[tuple[str, Variable]]:
    """Yield (component, variable) for all variables that can be set during a run."""
    connected = {connection.target for connection in system.connections}
    for name, component in system.components.items():
        for variable in component.variables:
            if not not_settable_reason(name, variable, connected):
                yield name, variable


def not_settable_reason(name: str, variable: Variable, connected: Set[Endpoint]) -> str:
    """Return why a variable cannot be set during a run.

    "" for tunable parameters and for inputs without a connection.
    """
    if variable.causality == "input" and any(
        Endpoint(name, scalar) in connected for scalar in variable.scalar_names
    ):
        return f"{name}.{variable.name} is fed by a connection"
    if variable.causality != "input" and (variable.causality, variable.variability) != (
        "parameter",
        "tunable",
    ):
        return f"{name}.{variable.name} is neither a tunable parameter nor an input"
    return ""


def _find_event_problems(system: System, events: Iterable[Event]) -> Iterator[Problem]:
    connected = {connection.target for connection in system.connections}
    for event in events:
        for name, values in event.values.items():
            variables = {variable.name: variable for variable in system.components[name].variables}
            for variable_name in values:
                if reason := not_settable_reason(name, variables[variable_name], connected):
                    yield Problem(f"{reason}, an event cannot set it", event.where)


def _fitting_step(system: System, settings: Settings) -> Fraction:
    """Return a step size that divides all intervals, if the given one does not fit them.

    The given one if it is at most as long as all periods and divides one of several.
    """
    step, intervals = settings.step_size, _intervals(system, settings)
    if step <= 0:
        return step
    divides_none = len(intervals) > 1 and all((each / step).denominator != 1 for each in intervals)
    if not divides_none and all(period >= step for period in system.periods.values()):
        return step
    common = _common_divisor(intervals)
    ratio = ceil(common / step)
    decade = 10 ** (len(str(ratio)) - 1)
    divisor = next(k * decade for k in (1, 2, 4, 5, 8, 10) if k * decade >= ratio)
    return Fraction(common, divisor)


def _intervals(system: System, settings: Settings) -> list[Fraction]:
    """Return the periods and the recording interval (s), which the step size must divide."""
    return [*system.periods.values(), *filter(None, [settings.record_interval])]


def _common_divisor(intervals: Sequence[Fraction]) -> Fraction:
    """Return the largest number that divides all intervals."""
    denominator = lcm(*(each.denominator for each in intervals))
    return Fraction(gcd(*(int(each * denominator) for each in intervals)), denominator)


def _step_problem(system: System, settings: Settings, fitting: Fraction) -> Problem:
    """Return the problem of a step size that does not fit, with the valid ones."""
    step, common = settings.step_size, _common_divisor(_intervals(system, settings))
    longer = [name for name, period in system.periods.items() if period < step]
    unfit = longer or [
        name for name, period in system.periods.items() if (period / step).denominator != 1
    ]
    fault = (
        f"is longer than the period of {abbreviate_names(longer, 3)}"
        if longer
        else f"divides no period of {abbreviate_names(unfit, 3)}"
    )
    example = "" if fitting == common else f", such as {time_text(fitting)}"
    text = (
        f"step size {float(step)!r} s {fault}: expected {time_text(common)} or a whole fraction of "
        f"it{example}"
    )
    return Problem(text, subject=("step_size",))


def _find_period_problems(system: System, settings: Settings, grid: TimeGrid) -> Iterator[Problem]:
    """Yield the problems of single periods and of the recording interval.

    A too short duration is one problem.
    """
    interval = settings.record_interval or grid.step
    if interval < grid.step or (interval / grid.step).denominator != 1:
        text = (
            f"recording interval {float(interval)!r} s is no multiple of the step size "
            f"{float(grid.step)!r} s"
        )
        yield Problem(text, subject=("record", "interval"))
    late: dict[str, Fraction] = {}
    for name, period in system.periods.items():
        ratio = period / grid.step
        if ratio.denominator != 1:
            text = (
                f"period {float(period)!r} s is no multiple of the step size {float(grid.step)!r} s"
            )
            yield Problem(text, subject=("components", name, "period"))
        elif 0 < grid.count < ratio:
            late[name] = period
    if late:
        duration, longest = float(grid.step * grid.count), float(max(late.values()))
        text = (
            f"the duration {duration!r} s is shorter than the period of {abbreviate_names(late, 3)}"
        )
        yield Problem(
            f"{text}: expected at least {longest!r} s",
            subject=("stop_time",) if len(late) > 1 else ("components", *late, "period"),
        )


def _find_delay_problems(system: System) -> Iterator[Problem]:
    """Yield a problem if delays store too many values, at the connections that store most."""
    stored: Counter[str] = Counter()
    for connection in system.connections:
        stored[connection.where] += connection.delay
    total = stored.total()
    if total > MAX_DELAYED_VALUES:
        text = (
            f"the delays store {format_count(total)} values, expected at most "
            f"{format_count(MAX_DELAYED_VALUES)}"
        )
        yield Problem(text, max(stored, key=lambda where: stored[where]), subject=("connections",))
