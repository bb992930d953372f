"""Python interface: load a scenario and run it."""

from __future__ import annotations

import platform
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack

from .core.errors import ComponentError, CosimError, InputError, Problem
from .core.version import __version__
from .engine.pacer import LatePolicy
from .engine.run_loop import Observer, SimulationOutcome, simulating
from .process.run_files.folder import write_metadata
from .results import Kpis, Result
from .results.checks import CheckOutcome, evaluate_all_checks, evaluate_checks
from .results.kpi import evaluate_kpis, kpi_senses, kpi_units
from .scenario import PreparedRun, prepare
from .scenario.overview import describe_system

IsolationMode = Literal["fmu", "none"]

#: packages whose versions can change a result
_PACKAGES = ("numpy", "scipy", "fmpy", "pybullet", "pybullet-arm64", "pythonfmu")


class LoadOptions(TypedDict, total=False):
    """Keyword arguments of `load` that `run` passes on; `load` documents them."""

    stop_time: float | str | None
    step_size: float | str | None
    real_time: float | None
    late: LatePolicy
    isolation: IsolationMode
    sandbox: bool


def load(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
    real_time: float | None = None,
    late: LatePolicy = "warn",
    isolation: IsolationMode = "none",
    sandbox: bool = False,
) -> PreparedRun:
    """Read, connect and check a scenario.

    Args:
        scenario: Path of a scenario file, or the name of a shipped scenario.
        parameters: Values that replace those of the file. A key is the name of a variable ("uav.vtol.landing_time") or the JSON
            pointer of any entry ("/components/plant/arguments/environment/seed").
        stop_time: End of the simulation (s), a number or a fraction such as "1/3"; None: as in the file.
        step_size: Macro step (s), a number or a fraction such as "1/60"; None: as in the file.
        real_time: Simulated seconds per second of wall time; None: as fast as possible.
        late: Reaction to a real-time run that falls more than one step behind: "warn", or "fail" for a LateError.
        isolation: "fmu" runs every FMU in a separate process; "none" does so only where the scenario sets `isolation`, or where
            an FMU that allows one instance per process is used again.
        sandbox: Run every FMU in a separate process that reads and writes only its own files, has no network and starts no
            programs.

    Returns:
        A prepared run, which can be executed once.

    Raises:
        InputError: The scenario cannot be run; `problems` lists all reasons.
    """
    times = {"/stop_time": stop_time, "/step_size": step_size}
    settings = {**{key: value for key, value in times.items() if value is not None}, **(parameters or {})}
    prepared = prepare(scenario, settings, isolate_fmus=isolation == "fmu", sandbox=sandbox)
    return replace(prepared, settings=replace(prepared.settings, real_time=real_time, late=late))


def run(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    observers: Sequence[Observer] = (),
    **options: Unpack[LoadOptions],
) -> Result:
    """Run a scenario in this process and evaluate its KPIs and checks.

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
def executing(prepared: PreparedRun, observers: Sequence[Observer] = ()) -> Iterator[Execution]:
    """Simulate a prepared run and evaluate its KPIs; terminate and free the components when the block ends.

    Args:
        prepared: A run that was not executed before.
        observers: See `run`.

    Yields:
        The result, and the failure that ended the run early.

    Raises:
        InputError: The system cannot be simulated.
        ComponentError: A component failed to terminate; raised at the end of the block.
    """
    began = time.perf_counter()
    metadata = _run_metadata(prepared)
    write_metadata(metadata)
    with simulating(prepared.system, prepared.settings, observers) as outcome:
        timing = {**_add_timings(prepared.timing, outcome.timing), "simulate_seconds": time.perf_counter() - began}
        result = Result(outcome.recording, timing=timing, metadata={**metadata, **_outcome_metadata(outcome)})
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
    """Evaluate KPIs and checks; a KPI that fails does not keep the others from being evaluated."""
    kpis = Kpis()
    failures: list[BaseException] = []
    functions = prepared.kpis()
    for i, kpi in enumerate(functions):
        try:
            with _adding_location(prepared, "kpis", i):
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
        The outcome of each check, in the order of the scenario.

    Raises:
        InputError: A check names a KPI that the result does not have.
    """
    outcomes = []
    for i, check in enumerate(prepared.checks):
        with _adding_location(prepared, "checks", i):
            outcomes += evaluate_checks(result.kpis, [check])
    return outcomes


@contextmanager
def _adding_location(prepared: PreparedRun, *path: str | int) -> Iterator[None]:
    """Add the JSON location to problems raised in this block."""
    try:
        yield
    except InputError as error:
        raise InputError([Problem(str(problem), prepared.root.where(*path)) for problem in error.problems]) from error


def _run_metadata(prepared: PreparedRun) -> dict[str, Any]:
    """Return the metadata that is known before the run: scenario, versions, hashes."""
    return {
        "name": prepared.spec.name,
        "scenario": prepared.document.value,
        "scenario_file": str(prepared.document.file.resolve()),
        "system": describe_system(prepared),
        "versions": {"cosim": __version__, "python": platform.python_version(), **_package_versions()},
        "machine": {"system": platform.system(), "machine": platform.machine()},
        "sha256": {name: sha256(file.read_bytes()).hexdigest() for name, file in prepared.files().items()},
    }


def _outcome_metadata(outcome: SimulationOutcome) -> dict[str, Any]:
    """Return the metadata that is known after the run: steps, timing, termination, failure."""
    termination = outcome.termination
    return {
        "macro_steps": outcome.macro_steps,
        "real_time": outcome.real_time,
        "terminated_by": {"component": termination.component, "time": termination.time} if termination else None,
        "failure": "interrupted" if isinstance(outcome.failure, KeyboardInterrupt) else _failure_text(outcome.failure),
    }


def _failure_text(failure: BaseException | None) -> str | None:
    """Return the text of a failure, its class name if the text is empty."""
    return None if failure is None else str(failure) or type(failure).__name__


def _package_versions() -> dict[str, str]:
    """Return the versions of those of `_PACKAGES` that are installed."""
    versions = {}
    for package in _PACKAGES:
        try:
            versions[package] = version(package)
        except PackageNotFoundError:
            continue
    return versions
