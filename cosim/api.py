"""The Python interface: load a scenario, run it, look at the result."""

from __future__ import annotations

import platform
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from . import __version__
from .errors import CosimError
from .kpi import CheckOutcome, evaluate_checks, evaluate_kpis
from .results import Result
from .scenario import Assembly, assemble
from .simulate import Observer, Run, simulate

#: packages whose versions can change a result
_PACKAGES = ("numpy", "scipy", "fmpy", "pybullet", "pybullet-arm64", "pythonfmu")


def load(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
) -> Assembly:
    """A scenario, read, wired and checked, ready to run once.

    `scenario` is a path, or the name of a shipped scenario. `parameters` sets variables ("uav.vtol.landing_time") or, by
    JSON pointer ("/components/plant/arguments/environment/seed"), anything in the file. Raises InputError with all problems.
    """
    times = {"/stop_time": stop_time, "/step_size": step_size}
    return assemble(scenario, {**{key: value for key, value in times.items() if value is not None}, **(parameters or {})})


def run(
    scenario: str | Path,
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: float | str | None = None,
    step_size: float | str | None = None,
    observers: Sequence[Observer] = (),
) -> Result:
    """Run a scenario in this process (see `load`) and evaluate its KPIs.

    Raises InputError when it cannot start. When a component fails while running, the ComponentError carries everything
    recorded until then as its attribute `result`.
    """
    return execute(load(scenario, parameters, stop_time=stop_time, step_size=step_size), observers)


def execute(assembly: Assembly, observers: Sequence[Observer] = ()) -> Result:
    """Simulate an assembled scenario and evaluate its KPIs; see `run`."""
    began = time.perf_counter()
    outcome = simulate(assembly.system, assembly.settings, observers)
    timing = {"loop_seconds": outcome.loop_seconds, "simulate_seconds": time.perf_counter() - began}
    metadata = _metadata(assembly, outcome)
    result = Result(outcome.recording, timing=timing, metadata=metadata)
    if outcome.failure is not None:
        outcome.failure.result = result  # type: ignore[attr-defined]
        raise outcome.failure
    return _with_kpis(result, assembly)


def _with_kpis(result: Result, assembly: Assembly) -> Result:
    """The result with all KPIs; when some fail, the first error carries the result with the others."""
    kpis: dict[str, Any] = {}
    failures: list[BaseException] = []
    for kpi in assembly.kpis():
        try:
            kpis |= evaluate_kpis(result, [kpi])
        except (CosimError, KeyboardInterrupt) as error:
            failures.append(error)
    result = replace(result, kpis=kpis)
    if failures:
        failures[0].result = result  # type: ignore[attr-defined]
        raise failures[0]
    return result


def checks(assembly: Assembly, result: Result) -> list[CheckOutcome]:
    """The scenario's checks held against a result."""
    return evaluate_checks(result.kpis, assembly.checks)


def _metadata(assembly: Assembly, outcome: Run) -> dict[str, Any]:
    termination = outcome.termination
    return {
        "name": assembly.spec.name,
        "scenario": assembly.document.value,
        "scenario_file": str(assembly.document.file.resolve()),
        "macro_steps": outcome.macro_steps,
        "terminated_by": {"component": termination.component, "time": termination.time} if termination else None,
        "failure": "interrupted" if isinstance(outcome.failure, KeyboardInterrupt) else _text(outcome.failure),
        "versions": {"cosim": __version__, "python": platform.python_version(), **_versions()},
        "machine": {"system": platform.system(), "machine": platform.machine()},
        "sha256": {name: sha256(file.read_bytes()).hexdigest() for name, file in assembly.files().items()},
    }


def _text(failure: BaseException | None) -> str | None:
    return None if failure is None else str(failure) or type(failure).__name__


def _versions() -> dict[str, str]:
    found = {}
    for package in _PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found
