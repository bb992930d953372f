"""Preparation of a scenario: read it, create its components, connect and check them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from os.path import relpath
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ..components.fmi import FmuFile
from ..components.python_import import package_files
from ..core.component import Component
from ..core.errors import InputError, Problem
from ..core.stopwatch import Stopwatch
from ..core.system import System
from ..engine.settings import Settings
from ..process.float_mode import default_float_mode
from ..process.journal import as_component_error
from .component_factory import ComponentFactory
from .json_document import Document
from .named_functions import load_function, signal_problems
from .nested_systems import Node, load_scenario
from .schema import FunctionSpec, ScenarioSpec
from .system_builder import SystemBuilder

#: name, function and keyword arguments of a KPI or figure
NamedCall = tuple[str, Callable[..., Any], Mapping[str, Any]]


@dataclass(frozen=True, repr=False)
class PreparedRun:
    """Scenario that is ready to run once. Simulating it frees its components; without a simulation, call `free`."""

    root: Node
    spec: ScenarioSpec
    system: System
    settings: Settings
    component_factory: ComponentFactory
    #: wall time (s) of the preparation "load_seconds" and its parts "parse_seconds", "instantiate_seconds", "wiring_seconds"
    timing: Mapping[str, float]

    def __repr__(self) -> str:
        system, settings = self.system, self.settings
        times = f"{float(settings.start_time):g} s to {float(settings.stop_time):g} s in steps of {float(settings.step_size):g} s"
        return f"{self.spec.name}: {', '.join(system.components)}; {len(system.connections)} connections; {times}"

    @property
    def document(self) -> Document:
        """Scenario file, including the values that the caller changed by JSON pointers."""
        return self.root.document

    @property
    def checks(self) -> list[dict[str, Any]]:
        """Checks of the scenario in the form of `cosim.results.checks.evaluate_checks`."""
        return [check.model_dump(exclude_none=True) for check in self.spec.checks]

    def kpis(self) -> list[NamedCall]:
        """Import the KPI functions and return (name, function, arguments) of each."""
        return self._load_functions(self.spec.kpis)

    def figures(self) -> list[NamedCall]:
        """Import the figure functions and return (name, function, arguments) of each."""
        return self._load_functions(self.spec.figures)

    def figure_problems(self) -> list[Problem]:
        """Return a problem for every figure argument that names no recorded signal.

        These are no problems of the run itself, because sweeps draw no figures.
        """
        return list(signal_problems(self.root, "figures", self.settings.columns))

    def _load_functions(self, specs: Sequence[FunctionSpec]) -> list[NamedCall]:
        return [(spec.name, load_function(spec.python, self.root.folder), spec.arguments) for spec in specs]

    def files(self) -> dict[str, Path]:
        """Return all files that the run depends on, by their path relative to the scenario's folder.

        These are the scenario and its nested systems, FMUs, Python and Modelica sources, and input profiles.
        """
        own = [node.document.file for node in self.root.walk()]
        own += [self.root.folder / spec.file for spec in self.spec.inputs]
        calls = (*self.spec.kpis, *self.spec.figures, *([self.spec.scene] if self.spec.scene else []))
        modules = (spec.python.rpartition(":")[0] for spec in calls)
        functions = [self.root.folder / module for module in modules if module.endswith(".py")]
        python = [member for file in (*functions, *self.component_factory.python_files) for member in package_files(file)]
        files = {file.resolve() for file in (*own, *python, *self.component_factory.fmus, *self.component_factory.modelica_files)}
        return {Path(relpath(file, self.root.folder.resolve())).as_posix(): file for file in sorted(files)}

    def component_source(self, name: str) -> str:
        """Return the source of a component as the scenario names it: an FMU, a Python class, a Modelica model or a CSV file."""
        if found := self.root.find_component(name):
            node, own = found
            spec = node.spec.components[own]
            return spec.fmu or spec.python or spec.modelica or ""
        return self.spec.inputs[int(name.rpartition(".")[2])].file

    def free(self) -> None:
        """Free the components of a scenario that is not simulated."""
        _free_components(self.system.components)


@default_float_mode()
def prepare(
    scenario: str | Path,
    settings: Mapping[str, Any] | None = None,
    *,
    isolate_fmus: bool = False,
    sandbox: bool = False,
    loaded_fmus: Mapping[Path, FmuFile] = MappingProxyType({}),
) -> PreparedRun:
    """Read a scenario, create its components, connect and check them.

    Args:
        scenario: A path, or the name of a shipped scenario.
        settings: Values that the caller changes, by variable name or JSON pointer (see `load_scenario`).
        isolate_fmus: Run every FMU in a process of its own.
        sandbox: Like `isolate_fmus`, and confine these processes to their own files, without network access.
        loaded_fmus: FMU files that have already been read, by resolved path.

    Raises:
        InputError: Carries all problems, each with file, line and JSON path.
    """
    watch = Stopwatch()
    with watch.measure("load_seconds"):
        with watch.measure("parse_seconds"):
            loaded = load_scenario(scenario, settings)
        builder = SystemBuilder(loaded, isolate_fmus, sandbox, loaded_fmus)
        try:
            with watch.measure("instantiate_seconds"):
                builder.make_components()
            with watch.measure("wiring_seconds"):
                builder.build_system()
            if builder.problems:
                raise InputError(dict.fromkeys(builder.problems))
        except BaseException:
            _free_components(builder.components)
            raise
    return PreparedRun(loaded.root, loaded.spec, builder.system, builder.settings, builder.component_factory, watch.seconds)


def _free_components(components: Mapping[str, Component]) -> None:
    """Free all components, even if freeing one of them fails."""
    with ExitStack() as stack:
        for name, component in components.items():
            stack.enter_context(as_component_error(name, "free"))
            stack.callback(component.free)
