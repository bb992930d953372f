"""Preparation of a scenario: read it, create its components, connect and check them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from hashlib import sha256
from os.path import relpath
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

from ..components.fmi import FmuFile
from ..components.python_import import package_files
from ..core.errors import Problem
from ..core.stopwatch import Stopwatch
from ..core.system import System
from ..engine.pacer import LatePolicy
from ..engine.plan import Plan
from ..engine.plan_run import free_components
from ..engine.settings import Settings
from ..process.float_mode import default_float_mode
from ..process.process_state import exclusive_process_state
from .component_factory import ComponentFactory
from .json_document import Document
from .named_functions import load_function, signal_problems
from .nested_systems import Node, load_scenario
from .overview import describe_software, describe_system
from .schema import FunctionSpec, ScenarioSpec
from .schema_types import accepted
from .system_builder import PROFILE_PREFIX, SystemBuilder

IsolationMode = Literal["fmu", "none"]

#: name, function and keyword arguments of a KPI or figure
NamedCall = tuple[str, Callable[..., Any], Mapping[str, Any]]


@dataclass(frozen=True, repr=False)
class PreparedRun:
    """Scenario that is ready to run once. Simulating it frees its components; without a simulation, call `free`."""

    root: Node
    spec: ScenarioSpec
    plan: Plan
    component_factory: ComponentFactory
    #: reasons why optional KPIs and figures are left out; `spec` does not contain these
    left_out: Sequence[Problem]
    #: wall time (s) of the preparation "load_seconds" and its parts "parse_seconds", "instantiate_seconds", "wiring_seconds"
    timing: Mapping[str, float]

    def __repr__(self) -> str:
        system, settings = self.system, self.settings
        times = f"{float(settings.start_time):g} s to {float(settings.stop_time):g} s in steps of {float(settings.step_size):g} s"
        return f"{self.spec.name}: {', '.join(system.components)}; {len(system.connections)} connections; {times}"

    @property
    def system(self) -> System:
        """Components and connections."""
        return self.plan.system

    @property
    def settings(self) -> Settings:
        """Time span, step size, recorded signals and events."""
        return self.plan.settings

    @property
    def document(self) -> Document:
        """Scenario file, including the values that the caller changed by JSON pointers."""
        return self.root.document

    @property
    def checks(self) -> list[dict[str, Any]]:
        """Checks of the scenario in the form of `cosim.results.checks.evaluate_checks`."""
        return [check.model_dump(exclude_none=True) for check in self.spec.checks]

    @property
    def optional_kpis(self) -> set[str]:
        """Names of the KPIs that may be left out."""
        return {spec.name for spec in self._all_kpis if spec.optional}

    def index_of_kpi(self, name: str) -> int:
        """Return the index of a KPI in the scenario."""
        return [spec.name for spec in self._all_kpis].index(name)

    @property
    def _all_kpis(self) -> Sequence[FunctionSpec]:
        assert isinstance(self.root.spec, ScenarioSpec)
        return self.root.spec.kpis

    def kpis(self) -> list[NamedCall]:
        """Import the KPI functions and return (name, function, arguments) of each."""
        return _load_functions(self.spec.kpis, self.root.folder)

    def figures(self) -> list[NamedCall]:
        """Import the figure functions and return (name, function, arguments) of each."""
        return _load_functions(self.spec.figures, self.root.folder)

    def figure_problems(self) -> list[Problem]:
        """Return a problem for every figure argument that names no recorded signal.

        These are no problems of the run itself, because sweeps draw no figures.
        """
        return list(signal_problems(self.root, "figures", self.settings.columns))

    @cached_property
    @exclusive_process_state()  # paths may be relative, and a component of another thread may change the working directory
    def metadata(self) -> dict[str, Any]:
        """Metadata of the run that are known before it: scenario, system, versions, hashes of all files."""
        return {
            "name": self.spec.name,
            "scenario": self._resolved_document(),
            "scenario_file": str(self.document.file.resolve()),
            "system": describe_system(self.system, self.sources),
            **describe_software(),
            "sha256": {name: sha256(file.read_bytes()).hexdigest() for name, file in self.files().items()},
        }

    def _resolved_document(self) -> dict[str, Any]:
        """Return the expanded scenario with the values of all arguments, without the functions that are left out."""
        functions = self.spec.model_dump(include={"kpis", "figures", "scene"}, exclude_defaults=True, by_alias=True)
        value: dict[str, Any] = self.document.value
        return {key: functions.get(key, item) for key, item in value.items()}

    def files(self) -> dict[str, Path]:
        """Return all files that the run depends on, by their path relative to the scenario's folder.

        These are the scenario and its nested systems, FMUs, Python and Modelica sources, and input profiles.
        """
        own = [file for node in self.root.walk() for file in node.document.files]
        own += [self.root.folder / spec.file for spec in self.spec.inputs]
        calls = (*self.spec.kpis, *self.spec.figures, *([self.spec.scene] if self.spec.scene else []))
        modules = (spec.python.rpartition(":")[0] for spec in calls)
        functions = (self.root.folder / module for module in modules if module.endswith(".py"))
        factory, folder = self.component_factory, self.root.folder.resolve()
        data = {file.resolve() for file in (*own, *factory.fmus, *factory.modelica_files)}
        files = data | package_files((*functions, *factory.python_files))
        return {relpath(file, folder).replace(os.sep, "/"): file for file in sorted(files, key=str)}

    @property
    def sources(self) -> dict[str, str]:
        """Source of each component as the scenario names it: an FMU, a Python class, a Modelica model or a CSV file."""
        specs = {node.full_name(name): node.spec.components[name] for node, name in self.root.leaves()}
        profiles = {f"{PROFILE_PREFIX}.{i}": spec.file for i, spec in enumerate(self.spec.inputs)}
        return {name: spec.fmu or spec.python or spec.modelica or "" for name, spec in specs.items()} | profiles

    def free(self) -> None:
        """Free the components of a scenario that is not simulated."""
        free_components(self.system.components)


@default_float_mode()
@exclusive_process_state()
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
    loaded_fmus: Mapping[Path, FmuFile] = MappingProxyType({}),
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
        loaded_fmus: FMU files that have already been read, by resolved path.

    Returns:
        A prepared run, which can be executed once.

    Raises:
        InputError: The scenario cannot be run; `problems` lists all reasons, each with file, line and JSON path.
    """
    times = {"/stop_time": stop_time, "/step_size": step_size}
    settings = {**{key: value for key, value in times.items() if value is not None}, **(parameters or {})}
    watch = Stopwatch()
    with watch.measure("load_seconds"):
        with watch.measure("parse_seconds"):
            loaded = load_scenario(scenario, settings)
        builder = SystemBuilder(loaded, isolation == "fmu", sandbox, loaded_fmus)
        try:
            with watch.measure("instantiate_seconds"):
                builder.make_components()
            with watch.measure("wiring_seconds"):
                plan = builder.build_plan(real_time, late)
        except BaseException:
            free_components(builder.components)
            raise
    return PreparedRun(loaded.root, builder.spec, plan, builder.component_factory, builder.left_out, watch.seconds)


def import_figures(scenario: str | Path, parameters: Mapping[str, Any] | None = None) -> list[NamedCall]:
    """Import the figure functions of a scenario without loading its components.

    Args:
        scenario: See `load`.
        parameters: See `load`.

    Returns:
        (name, function, arguments) of each figure.

    Raises:
        InputError: The scenario cannot be read, or a function cannot be imported.
    """
    loaded = load_scenario(scenario, parameters)
    return _load_functions([spec for _, spec in accepted(loaded.spec.figures)], loaded.root.folder)


@exclusive_process_state()  # as for `PreparedRun.metadata`
def _load_functions(specs: Sequence[FunctionSpec], folder: Path) -> list[NamedCall]:
    return [(spec.name, load_function(spec.python, folder), spec.arguments) for spec in specs]
