"""The Python interface: load a scenario, run it, look at the result."""

from __future__ import annotations

import platform
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any, Literal

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

#: packages whose versions can change a result
_PACKAGES = ("numpy", "scipy", "fmpy", "pybullet", "pybullet-arm64", "pythonfmu")


def load(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
    real_time: float | None = None,
    late: LatePolicy = "warn",
    isolation: Literal["fmu", "none"] = "none",
    sandbox: bool = False,
) -> PreparedRun:
    """A scenario, read, wired and checked, ready to run once.

    `scenario` is a path, or the name of a shipped scenario. `parameters` sets variables ("uav.vtol.landing_time") or, by
    JSON pointer ("/components/plant/arguments/environment/seed"), anything in the file. `real_time` is the number of simulated
    seconds per second on the wall (None: as fast as possible); with `late="fail"` a run that falls more than one step behind ends
    with a LateError. With `isolation="fmu"` every FMU runs in a process of its own; with `sandbox` also, and such processes read
    and write only what is theirs and have no network. Raises InputError with all problems.
    """
    times = {"/stop_time": stop_time, "/step_size": step_size}
    settings = {**{key: value for key, value in times.items() if value is not None}, **(parameters or {})}
    assembly = prepare(scenario, settings, isolate_fmus=isolation == "fmu", sandbox=sandbox)
    return replace(assembly, settings=replace(assembly.settings, real_time=real_time, late=late))


def run(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
    real_time: float | None = None,
    late: LatePolicy = "warn",
    isolation: Literal["fmu", "none"] = "none",
    sandbox: bool = False,
    observers: Sequence[Observer] = (),
) -> Result:
    """Run a scenario in this process (see `load`) and evaluate its KPIs.

    Raises InputError when it cannot start. When a component fails while running, the ComponentError carries everything
    recorded until then as its attribute `result`.
    """
    assembly = load(
        scenario,
        parameters,
        stop_time=stop_time,
        step_size=step_size,
        real_time=real_time,
        late=late,
        isolation=isolation,
        sandbox=sandbox,
    )
    return execute(assembly, observers)


@dataclass(frozen=True)
class Execution:
    """A run that has ended; with a `failure`, `result` holds what was recorded and computed until then."""

    result: Result
    failure: BaseException | None = None


@contextmanager
def executing(assembly: PreparedRun, observers: Sequence[Observer] = ()) -> Iterator[Execution]:
    """Simulate an assembled scenario and evaluate its KPIs; when the block is left, the components are terminated and freed.

    Raises ComponentError at the end when a component fails to terminate.
    """
    began = time.perf_counter()
    metadata = _run_metadata(assembly)
    write_metadata(metadata)
    with simulating(assembly.system, assembly.settings, observers) as outcome:
        timing = {**_add_timings(assembly.timing, outcome.timing), "simulate_seconds": time.perf_counter() - began}
        result = Result(outcome.recording, timing=timing, metadata={**metadata, **_outcome_metadata(outcome)})
        yield Execution(result, outcome.failure) if outcome.failure else _evaluate_run(result, assembly)


def execute(assembly: PreparedRun, observers: Sequence[Observer] = ()) -> Result:
    """Simulate an assembled scenario and evaluate its KPIs; see `run`."""
    execution = None
    try:
        with executing(assembly, observers) as execution:
            pass
    except ComponentError as error:  # while terminating
        error.result = execution.result if execution else None
        raise
    if execution.failure:
        vars(execution.failure)["result"] = execution.result  # any exception has it, a KeyboardInterrupt too
        raise execution.failure
    return execution.result


def _add_timings(first: Mapping[str, float], second: Mapping[str, float]) -> dict[str, float]:
    return {part: first.get(part, 0.0) + second.get(part, 0.0) for part in {**first, **second}}


def _evaluate_run(result: Result, assembly: PreparedRun) -> Execution:
    """The result with all KPIs; when some fail, the others are there all the same."""
    kpis = Kpis()
    failures: list[BaseException] = []
    functions = assembly.kpis()
    for i, kpi in enumerate(functions):
        try:
            with _adding_location(assembly, "kpis", i):
                kpis.update(evaluate_kpis(result, [kpi]))
        except (CosimError, KeyboardInterrupt) as error:
            failures.append(error)
    about = {"kpi_units": kpi_units(functions, kpis, result.units), "kpi_senses": kpi_senses(functions, kpis)}
    held = evaluate_all_checks(kpis, assembly.checks)
    evaluated = replace(result, kpis=kpis, metadata={**result.metadata, **about}, checks=held)
    return Execution(evaluated, failures[0] if failures else None)


def evaluate_scenario_checks(assembly: PreparedRun, result: Result) -> list[CheckOutcome]:
    """The scenario's checks held against a result. Raises InputError for those of KPIs that it does not have."""
    outcomes = []
    for i, check in enumerate(assembly.checks):
        with _adding_location(assembly, "checks", i):
            outcomes += evaluate_checks(result.kpis, [check])
    return outcomes


@contextmanager
def _adding_location(assembly: PreparedRun, *path: str | int) -> Iterator[None]:
    """What is refused in this block gets its place in the scenario file."""
    try:
        yield
    except InputError as error:
        raise InputError([Problem(str(problem), assembly.root.where(*path)) for problem in error.problems]) from error


def _run_metadata(assembly: PreparedRun) -> dict[str, Any]:
    """What describes a run before it has begun."""
    return {
        "name": assembly.spec.name,
        "scenario": assembly.document.value,
        "scenario_file": str(assembly.document.file.resolve()),
        "system": describe_system(assembly),
        "versions": {"cosim": __version__, "python": platform.python_version(), **_package_versions()},
        "machine": {"system": platform.system(), "machine": platform.machine()},
        "sha256": {name: sha256(file.read_bytes()).hexdigest() for name, file in assembly.files().items()},
    }


def _outcome_metadata(outcome: SimulationOutcome) -> dict[str, Any]:
    """How a run has ended."""
    termination = outcome.termination
    return {
        "macro_steps": outcome.macro_steps,
        "real_time": outcome.real_time,
        "terminated_by": {"component": termination.component, "time": termination.time} if termination else None,
        "failure": "interrupted" if isinstance(outcome.failure, KeyboardInterrupt) else _failure_text(outcome.failure),
    }


def _failure_text(failure: BaseException | None) -> str | None:
    return None if failure is None else str(failure) or type(failure).__name__


def _package_versions() -> dict[str, str]:
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
