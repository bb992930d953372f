"""Python interface: load a scenario and run it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

from .core.errors import ComponentError, CosimError, InputError, Problem
from .engine.pacer import LatePolicy
from .engine.plan_run import Observer, SimulationOutcome, StepHook
from .engine.run_loop import simulating
from .results import Kpis, Result
from .results.checks import CheckOutcome, evaluate_all_checks, evaluate_checks
from .results.kpi import evaluate_kpis, kpi_senses, kpi_units
from .results.non_finite import warn_non_finite
from .scenario import IsolationMode, PreparedRun, load

__all__ = ["Execution", "evaluate_scenario_checks", "execute", "executing", "load", "run"]


class LoadOptions(TypedDict, total=False):
    """Keyword arguments of `load` that `run` passes on; `load` documents them."""

    stop_time: float | str | None
    step_size: float | str | None
    real_time: float | None
    late: LatePolicy
    isolation: IsolationMode
    sandbox: bool


def run(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    observers: Sequence[Observer] = (),
    **options: Unpack[LoadOptions],
) -> Result:
    """Run a scenario in this process and evaluate its KPIs and checks.

    Runs in several threads of one process are safe, also in an event loop (`asyncio.to_thread(cosim.run, ...)`) and after a fork.
    Only one thread at a time loads or steps components, because FMUs may change the state of the whole process. This state
    (working directory, environment, locale and others) is restored before another thread continues. Therefore an observer must
    not wait for a run of another thread. If all components of several runs are isolated FMUs, these runs step at the same time.

    Args:
        scenario: Path of a scenario file, or the name of a shipped scenario.
        parameters: Values that replace those of the file, see `load`.
        observers: Functions called about 100 times per run with the number of finished and of all macro steps.
        **options: `stop_time`, `step_size`, `real_time`, `late`, `isolation` and `sandbox`, see `load`.

    Returns:
        The recorded signals, KPIs and outcomes of the checks. A check that is not met raises no error.

    Raises:
        InputError: The scenario cannot be run, or a KPI refuses its arguments.
        ComponentError: A component or a KPI function failed. As with every error raised after the simulation began, the attribute
            `result` of the exception holds what was recorded until then.
        LateError: The run fell behind real time and `late` is "fail".
    """
    return execute(load(scenario, parameters, **options), observers)


@dataclass(frozen=True)
class Execution:
    """A finished run.

    Attributes:
        result: Recorded signals, KPIs and checks, as far as they were computed.
        failure: The error that ended the run early; None if there was none.
    """

    result: Result
    failure: BaseException | None = None


@contextmanager
def executing(
    prepared: PreparedRun, observers: Sequence[Observer] = (), step_hook: StepHook | None = None
) -> Iterator[Execution]:
    """Simulate a prepared run and evaluate its KPIs; terminate and free the components when the block ends.

    Args:
        prepared: A run that was not executed before.
        observers: See `run`.
        step_hook: Called with n before the macro step that starts at communication point n.

    Yields:
        The result, and the failure that ended the run early.

    Raises:
        ComponentError: A component failed to terminate; raised at the end of the block.
    """
    began = time.perf_counter()
    with simulating(prepared.plan, observers, step_hook) as outcome:
        timing = {**_add_timings(prepared.timing, outcome.timing), "simulate_seconds": time.perf_counter() - began}
        metadata = {**prepared.metadata, **_outcome_metadata(prepared, outcome)}
        result = Result(outcome.recording, timing=timing, metadata=metadata)
        yield Execution(result, outcome.failure) if outcome.failure else _evaluate_run(result, prepared)


def execute(prepared: PreparedRun, observers: Sequence[Observer] = ()) -> Result:
    """Simulate a prepared run and evaluate its KPIs and checks; see `run` for result and errors."""
    execution = None
    try:
        with executing(prepared, observers) as execution:
            pass
    except ComponentError as error:  # while terminating
        error.result = execution.result if execution else None
        raise
    if execution.failure:
        vars(execution.failure)["result"] = execution.result  # any exception has it, a KeyboardInterrupt too
        raise execution.failure
    return execution.result


def _add_timings(first: Mapping[str, float], second: Mapping[str, float]) -> dict[str, float]:
    """Return the sum of the durations of each name."""
    return {part: first.get(part, 0.0) + second.get(part, 0.0) for part in {**first, **second}}


def _evaluate_run(result: Result, prepared: PreparedRun) -> Execution:
    """Evaluate all KPIs and checks; the others are also evaluated if a KPI fails."""
    kpis = Kpis()
    failures: list[BaseException] = []
    functions = prepared.kpis()
    for kpi in functions:
        try:
            with _adding_location(prepared, "kpis", prepared.index_of_kpi(kpi[0])):
                kpis.update(evaluate_kpis(result, [kpi]))
        except (CosimError, KeyboardInterrupt) as error:
            failures.append(error)
    about = {"kpi_units": kpi_units(functions, kpis, result.units), "kpi_senses": kpi_senses(functions, kpis)}
    checks = evaluate_all_checks(kpis, prepared.checks)
    evaluated = replace(result, kpis=kpis, metadata={**result.metadata, **about}, checks=checks)
    return Execution(evaluated, failures[0] if failures else None)


def evaluate_scenario_checks(prepared: PreparedRun, result: Result) -> list[CheckOutcome]:
    """Evaluate the checks of a scenario.

    Args:
        prepared: The scenario.
        result: A result with KPIs.

    Returns:
        The outcome of each check, in the order of the scenario. A check of an optional KPI that was left out is not met.

    Raises:
        InputError: A check names a KPI that the result does not have.
    """
    outcomes = []
    for i, check in enumerate(prepared.checks):
        with _adding_location(prepared, "checks", i):
            is_optional = check["kpi"].partition(".")[0] in prepared.optional_kpis
            outcomes += (evaluate_all_checks if is_optional else evaluate_checks)(result.kpis, [check])
    return outcomes


@contextmanager
def _adding_location(prepared: PreparedRun, *path: str | int) -> Iterator[None]:
    """Add the JSON location to problems raised in this block."""
    try:
        yield
    except InputError as error:
        raise InputError([Problem(str(problem), prepared.root.where(*path)) for problem in error.problems]) from error


def _outcome_metadata(prepared: PreparedRun, outcome: SimulationOutcome) -> dict[str, Any]:
    """Return the metadata that is known after the run: steps, timing, signals that are not finite, termination, failure."""
    termination = outcome.termination
    return {
        "macro_steps": outcome.macro_steps,
        "real_time": outcome.real_time,
        "non_finite": {} if prepared.spec.non_finite == "allow" else warn_non_finite(outcome.recording),
        "terminated_by": {"component": termination.component, "time": termination.time} if termination else None,
        "failure": "interrupted" if isinstance(outcome.failure, KeyboardInterrupt) else _failure_text(outcome.failure),
    }


def _failure_text(failure: BaseException | None) -> str | None:
    """Return the text of a failure, its class name if the text is empty."""
    return None if failure is None else str(failure) or type(failure).__name__
