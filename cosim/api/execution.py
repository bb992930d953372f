"""Evaluation of a run: its result with KPIs and checks."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

from ..core.errors import CosimError, InputError, Problem
from ..engine.plan_run import SimulationOutcome
from ..process.float_mode import default_float_mode
from ..results import Kpis, Result, RunMetadata
from ..results.checks import (
    CheckOutcome,
    Number,
    evaluate_all_checks,
    evaluate_checks,
    warn_non_finite,
)
from ..results.kpi import NoValue, evaluate_kpis, kpi_notes, kpi_senses, kpi_units
from ..scenario import PreparedRun
from ..scenario.input_limits import warn_exceeded_limits

#: modules that a run imports, for processes from which runs are forked
RUN_MODULES = (
    "cosim.api.execution",
    "cosim.components.fmi.isolated",
    "cosim.components.python_class",
    "cosim.components.python_fmu",
    "cosim.engine.native_executor",
    "cosim.kpis",
    "cosim.scenario.plausibility",
    "fmpy.fmi1",
    "fmpy.fmi2",
    "fmpy.fmi3",
    "numpy.random",
)


@default_float_mode()
def evaluate_outcome(prepared: PreparedRun, outcome: SimulationOutcome, complete: bool) -> Result:
    """Return the result of a run.

    Args:
        prepared: The scenario.
        outcome: What was recorded.
        complete: Also evaluate all KPIs and checks, unless the run failed.
    """
    timing = {**prepared.timing, **outcome.timing}
    timing["simulate_seconds"] = sum(outcome.timing.values())
    metadata: RunMetadata = {**prepared.metadata, **_outcome_metadata(prepared, outcome)}
    if complete or outcome.failure:
        warn_exceeded_limits(prepared, outcome.recording)
    result = Result(outcome.recording, timing=timing, metadata=metadata, failure=outcome.failure)
    return _evaluate_run(result, prepared) if complete and not outcome.failure else result


def _evaluate_run(result: Result, prepared: PreparedRun) -> Result:
    """Evaluate all KPIs and checks; the others are also evaluated if a KPI fails."""
    values: dict[str, Number] = {}
    failures: list[BaseException] = []
    functions = prepared.kpis()
    for kpi in functions:
        try:
            with _adding_location(prepared, "kpis", prepared.index_of_kpi(kpi[0])):
                values.update(evaluate_kpis(result, [kpi]))
        except (CosimError, KeyboardInterrupt) as error:
            failures.append(error)
    kpis = Kpis(
        {name: math.nan if isinstance(value, NoValue) else value for name, value in values.items()}
    )
    checks = evaluate_all_checks(kpis, prepared.checks)
    failed = [check.check["kpi"] for check in checks if not check.passed]
    # a signal may have another meaning in a user's component
    signals: dict[str, dict[str, str]] = {}
    for name, _, arguments in functions:
        if name in prepared.optional_kpis:
            texts = {key: each for key, each in arguments.items() if isinstance(each, str)}
            signals[name] = {key: text for key, text in texts.items() if text in result}
    about: RunMetadata = {
        "kpi_units": kpi_units(functions, kpis, result.units),
        "kpi_senses": kpi_senses(functions, kpis),
        "kpi_notes": kpi_notes(values, signals.items()),
        "check_notes": kpi_notes({name: values[name] for name in failed if name in values}),
    }
    return replace(
        result,
        kpis=kpis,
        metadata={**result.metadata, **about},
        checks=checks,
        failure=failures[0] if failures else None,
    )


def evaluate_scenario_checks(prepared: PreparedRun, result: Result) -> list[CheckOutcome]:
    """Evaluate the checks of a scenario.

    Args:
        prepared: The scenario.
        result: A result with KPIs.

    Returns:
        The outcome of each check, in the order of the scenario. A check of an optional KPI that was
        left out fails.

    Raises:
        InputError: A check names a KPI that the result does not have.
    """
    outcomes = []
    for i, check in enumerate(prepared.checks):
        with _adding_location(prepared, "checks", i):
            is_optional = check["kpi"].partition(".")[0] in prepared.optional_kpis
            outcomes += (evaluate_all_checks if is_optional else evaluate_checks)(
                result.kpis, [check]
            )
    return outcomes


@contextmanager
def _adding_location(prepared: PreparedRun, *path: str | int) -> Iterator[None]:
    """Add the JSON location to problems raised in this block."""
    try:
        yield
    except InputError as error:
        raise InputError(
            [Problem(str(problem), prepared.root.where(*path)) for problem in error.problems]
        ) from error


def _outcome_metadata(prepared: PreparedRun, outcome: SimulationOutcome) -> RunMetadata:
    """Return the metadata that is known after the run.

    Steps, timing, signals that are not finite, termination, failure.
    """
    failure = outcome.failure
    interrupted = isinstance(failure, KeyboardInterrupt)
    text = "interrupted" if interrupted else str(failure) or type(failure).__name__
    allows_all = prepared.spec.non_finite == "allow"
    termination, ended = outcome.termination, None
    if termination and termination.condition:
        ended = termination.condition._asdict()
    elif termination:
        ended = {"component": termination.component, "time": termination.time}
    return {
        "macro_steps": outcome.macro_steps,
        "real_time": outcome.real_time,
        "non_finite": {} if allows_all else warn_non_finite(outcome.recording),
        "terminated_by": ended,
        "failure": text if failure else None,
    }
