"""Simulation of a system or a plan from its start to its end."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from dataclasses import replace

from ..core.errors import ComponentError
from ..core.system import System
from ..process.float_mode import default_float_mode
from . import Plan, compile_plan
from .plan_run import Observer, PlanRun, SimulationOutcome, StepHook, free_components
from .settings import Settings


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
