"""Preparation of a scenario: read it, create its components, connect and check them."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import Decimal
from fractions import Fraction
from functools import cached_property, lru_cache
from hashlib import sha256
from os.path import relpath
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from ..components.fmi import FmuFile, Isolation
from ..core import resources
from ..core.errors import Problem
from ..core.paths import resolve_path
from ..core.system import System
from ..core.text import count_noun
from ..core.time_grid import exact_fraction, fraction_text
from ..engine.pacer import LatePolicy, Stopwatch
from ..engine.plan import Plan
from ..engine.plan_run import free_components
from ..process.float_mode import default_float_mode
from ..process.journal import Deadlines, current_journal
from ..process.process_state import exclusive_process_state
from ..results import RunMetadata
from ..results.kpi import NamedCall
from .component_sources import ComponentFactory
from .evaluation_schema import FunctionSpec
from .file_paths import SHIPPED
from .json_document import Document
from .named_functions import load_function, signal_problems
from .nested_systems import Node, files_of_system, load_scenario
from .overview import describe_software, describe_system
from .schema import ScenarioSpec
from .system_builder import PROFILE_PREFIX, SystemBuilder

IsolationMode = Literal["fmu", "none"]
#: time (s) in Python
TimeValue = float | str | Fraction | Decimal


@dataclass(frozen=True, repr=False)
class PreparedRun:
    """Scenario that is ready to run once.

    Simulating it frees its components; without a simulation, call `free`.
    """

    root: Node
    spec: ScenarioSpec
    plan: Plan
    component_factory: ComponentFactory
    #: reasons why optional KPIs and figures are left out; `spec` does not contain these
    left_out: Sequence[Problem]
    #: values of variables that the caller sets, by name
    assignments: Mapping[str, Any]
    #: wall time (s) of the preparation "load_seconds" and its parts "parse_seconds",
    #: "create_seconds" (of the components), "wiring_seconds"
    timing: Mapping[str, float]

    def __repr__(self) -> str:
        system, settings = self.system, self.plan.settings
        times = (
            f"{float(settings.start_time):g} s to {float(settings.stop_time):g} s in steps of "
            f"{float(settings.step_size):g} s"
        )
        return (
            f"{self.spec.name}: {', '.join(system.components)}; "
            f"{count_noun(len(system.connections), 'connection')}; {times}"
        )

    @property
    def system(self) -> System:
        """Components and connections."""
        return self.plan.system

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
        return list(signal_problems(self.root, "figures", self.plan.settings.columns))

    @cached_property
    # paths may be relative, and a component of another thread may change the working directory
    @exclusive_process_state()
    def metadata(self) -> RunMetadata:
        """Metadata of the run that are known before it.

        Scenario, system, versions, hashes of all files.
        """
        return {
            **self.origin,
            "system": describe_system(self.system, self.sources, self.component_factory.solvers),
            **describe_software(),
            "sha256": {
                name: sha256(file.read_bytes()).hexdigest() for name, file in self.files().items()
            },
        }

    @property
    def origin(self) -> RunMetadata:
        """Name, content and file of the scenario, and the caller's values of variables.

        The content is expanded and has the values of all arguments. Functions that are left out do
        not appear.
        """
        functions = self.spec.model_dump(
            include={"kpis", "figures", "scene"}, exclude_defaults=True, by_alias=True
        )
        value: dict[str, Any] = self.document.value
        return {
            "name": self.spec.name,
            "scenario": {key: functions.get(key, item) for key, item in value.items()},
            "scenario_file": str(self.document.file.resolve()),
            "parameters": dict(self.assignments),
        }

    def files(self) -> dict[str, Path]:
        """Return all files that the run depends on, by their path from the scenario's folder.

        Files that cosim ships have names such as "cosim:fmus/mixer.fmu", except for those of
        shipped scenarios.

        These are the scenario and its nested systems, FMUs, Python and Modelica sources, and
        input profiles.
        """
        folder, shipped = str(self.root.folder.resolve()), _shipped()
        files = {file.resolve() for file in files_of_system(self.root, self.spec, is_loaded=True)}
        return {_name_of_file(str(file), folder, shipped): file for file in sorted(files, key=str)}

    @property
    def sources(self) -> dict[str, str]:
        """Source of each component as the scenario names it.

        An FMU, a Python class, a Modelica model or a CSV file.

        One that cosim ships has a name such as "cosim:fmus/mixer.fmu", except for those of shipped
        scenarios.
        """
        sources = {}
        root, shipped = str(self.root.folder.resolve()), _shipped()
        for node, name in self.root.leaves():

            def shown(path: str, folder: Path = node.folder) -> str:
                known = _name_of_file(str(resolve_path(folder / path)), root, shipped)
                return known if known.startswith(SHIPPED) else path

            sources[node.full_name(name)] = node.spec.components[name].label(shown)
        profiles = {f"{PROFILE_PREFIX}.{i}": spec.file for i, spec in enumerate(self.spec.inputs)}
        return {**sources, **profiles}

    def free(self) -> None:
        """Free the components of a scenario that is not simulated."""
        free_components(self.system.components)


def _shipped() -> str:
    """Return the folder of the files that cosim ships."""
    return str(resources.root().resolve())


@lru_cache(1024)  # a run names over a hundred files, and runs in one process name the same ones
def _name_of_file(file: str, folder: str, shipped: str) -> str:
    is_shipped = Path(file).is_relative_to(shipped) and not Path(folder).is_relative_to(shipped)
    name = relpath(file, shipped if is_shipped else folder).replace(os.sep, "/")
    return f"{SHIPPED}{name}" if is_shipped else name


@default_float_mode()
@exclusive_process_state()
def load(
    scenario: str | Path | Mapping[str, Any],
    parameters: Mapping[str, Any] | None = None,
    *,
    stop_time: TimeValue | None = None,
    step_size: TimeValue | None = None,
    real_time: float | None = None,
    late: LatePolicy = "warn",
    isolation: IsolationMode = "none",
    sandbox: bool = False,
    settings_folder: Path | None = None,
    loaded_fmus: Mapping[Path, FmuFile] = MappingProxyType({}),
) -> PreparedRun:
    """Read, connect and check a scenario.

    Args:
        scenario: Path of a scenario file, the name of a shipped scenario, or the content of a
            scenario file.
        parameters: Values that replace those of the file. A key is the name of a variable
            ("uav.vtol.landing_time") or the JSON pointer of any entry
            ("/components/plant/arguments/environment/seed").
        stop_time: End of the simulation (s), a number or a fraction, also as text ("1/3"); None: as
            in the file.
        step_size: Macro step (s), a number or a fraction, also as text ("1/60"); None: as in the
            file.
        real_time: Simulated seconds per second of wall time; None: as fast as possible.
        late: Reaction to a real-time run that falls more than one step behind: "warn", or "fail"
            for a LateError.
        isolation: "fmu" runs every FMU in a separate process; "none" does so only where the
            scenario sets `isolation`, or where an FMU that allows one instance per process is used
            again.
        sandbox: Run every FMU in a separate process that reads and writes only its own files, has
            no network and starts no programs.
        settings_folder: Folder that paths in `parameters` start from; None: the working directory.
        loaded_fmus: FMU files that have already been read, by resolved path.

    Returns:
        A prepared run, which can be executed once.

    Raises:
        InputError: The scenario cannot be run; `problems` lists all reasons, each with file, line
            and JSON path.
    """
    times = {"/stop_time": stop_time, "/step_size": step_size}
    settings = {
        **{key: _json_time(value) for key, value in times.items() if value is not None},
        **(parameters or {}),
    }
    watch = Stopwatch()
    with watch.measure("load_seconds"):
        with watch.measure("parse_seconds"):
            loaded = load_scenario(scenario, settings, settings_folder)
        isolate_fmus = isolation == "fmu" or sandbox
        if isolate_fmus:
            reason = (
                "expected a file, because Python objects exist in this process only; set "
                '"isolation" of single FMUs instead'
            )
            loaded.root.document.refuse_objects(reason, classes=True)
        deadlines = Deadlines(**loaded.spec.deadlines.model_dump())
        if journal := current_journal():
            journal.deadlines = deadlines
        factory = ComponentFactory(Isolation(deadlines, sandbox), isolate_fmus, loaded_fmus)
        builder = SystemBuilder(loaded, factory)
        try:
            with watch.measure("create_seconds"):
                builder.make_components()
            with watch.measure("wiring_seconds"):
                plan = builder.build_plan(real_time, late)
        except BaseException:
            free_components(builder.components)
            raise
    return PreparedRun(
        loaded.root,
        builder.spec,
        plan,
        factory,
        builder.left_out,
        loaded.assignments,
        watch.seconds,
    )


def _json_time(value: TimeValue) -> float | str:
    """Return a time as JSON has it: a number, or a fraction as text if no number is exact.

    What is no time stays as it is.
    """
    plain = value.item() if isinstance(value, np.generic) else value
    if not isinstance(plain, str | Fraction | Decimal) or (isinstance(plain, str) and "/" in plain):
        return plain
    try:
        exact = exact_fraction(str(plain))
        number = float(exact)
        return number if exact_fraction(number) == exact else fraction_text(exact)
    except (ValueError, ArithmeticError):
        return str(plain)


@exclusive_process_state()  # as for `PreparedRun.metadata`
def _load_functions(specs: Sequence[FunctionSpec], folder: Path) -> list[NamedCall]:
    return [(spec.name, load_function(spec.python, folder), spec.arguments) for spec in specs]
