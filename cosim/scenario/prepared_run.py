"""A scenario that is ready to run."""

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
from .nested_systems import Node, Scenario, load_scenario
from .schema import FunctionSpec, ScenarioSpec
from .system_builder import SystemBuilder

NamedCall = tuple[str, Callable[..., Any], Mapping[str, Any]]


@dataclass(frozen=True, repr=False)
class PreparedRun:
    """A scenario ready to run. Its components live until `simulate` or `free`."""

    root: Node
    spec: ScenarioSpec
    system: System
    settings: Settings
    component_factory: ComponentFactory
    #: wall time (s) of "load_seconds" (all), of it "parse_seconds", "instantiate_seconds" and "wiring_seconds"
    timing: Mapping[str, float]

    def __repr__(self) -> str:
        system, settings = self.system, self.settings
        times = f"{float(settings.start_time):g} s to {float(settings.stop_time):g} s in steps of {float(settings.step_size):g} s"
        return f"{self.spec.name}: {', '.join(system.components)}; {len(system.connections)} connections; {times}"

    @property
    def document(self) -> Document:
        """The scenario file, with the changes from outside in its value."""
        return self.root.document

    @property
    def checks(self) -> list[dict[str, Any]]:
        """The scenario's checks as `cosim.results.kpi.evaluate_checks` takes them."""
        return [check.model_dump(exclude_none=True) for check in self.spec.checks]

    def kpis(self) -> list[NamedCall]:
        """(name, function, arguments) of every KPI."""
        return self._load_functions(self.spec.kpis)

    def figures(self) -> list[NamedCall]:
        """(name, function, arguments) of every figure."""
        return self._load_functions(self.spec.figures)

    def figure_problems(self) -> list[Problem]:
        """Why figures could not be drawn from what is recorded, which is no matter where none are drawn, as in sweeps."""
        return list(signal_problems(self.root, "figures", self.settings.columns))

    def _load_functions(self, specs: Sequence[FunctionSpec]) -> list[NamedCall]:
        return [(spec.name, load_function(spec.python, self.root.folder), spec.arguments) for spec in specs]

    def files(self) -> dict[str, Path]:
        """All files that the run depends on, by their path from the scenario: scenario, FMUs, Python, Modelica, profiles."""
        own = [node.document.file for node in self.root.walk()]
        own += [self.root.folder / spec.file for spec in self.spec.inputs]
        calls = (*self.spec.kpis, *self.spec.figures, *([self.spec.scene] if self.spec.scene else []))
        places = (spec.python.rpartition(":")[0] for spec in calls)
        functions = [self.root.folder / place for place in places if place.endswith(".py")]
        python = [member for file in (*functions, *self.component_factory.python_files) for member in package_files(file)]
        files = {file.resolve() for file in (*own, *python, *self.component_factory.fmus, *self.component_factory.modelica_files)}
        return {Path(relpath(file, self.root.folder.resolve())).as_posix(): file for file in sorted(files)}

    def component_source(self, name: str) -> str:
        """Where a component comes from, in words."""
        for node, own in self.root.leaves():
            if node.full_name(own) == name:
                spec = node.spec.components[own]
                return spec.fmu or spec.python or spec.modelica or ""
        return self.spec.inputs[int(name.rpartition(".")[2])].file

    def free(self) -> None:
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
    """Read, wire and check a scenario; `settings` are changes from outside (see `tree.load`).

    With `apart` every FMU runs in a process of its own; with `sandbox` also, and those that do are confined. `prepared` are
    FMU files by resolved path that were read before.

    Raises InputError with every problem found, each with file, line and JSON path.
    """
    watch = Stopwatch()
    with watch.measure("load_seconds"):
        with watch.measure("parse_seconds"):
            loaded = load_scenario(scenario, settings)
        return _build_run(loaded, SystemBuilder(loaded, isolate_fmus, sandbox, loaded_fmus), watch)


def _build_run(loaded: Scenario, assembler: SystemBuilder, watch: Stopwatch) -> PreparedRun:
    try:
        with watch.measure("instantiate_seconds"):
            assembler.make_components()
        with watch.measure("wiring_seconds"):
            assembler.build_system()
        if assembler.problems:
            raise InputError(dict.fromkeys(assembler.problems))
    except BaseException:
        _free_components(assembler.components)
        raise
    return PreparedRun(loaded.root, loaded.spec, assembler.system, assembler.settings, assembler.component_factory, watch.seconds)


def _free_components(components: Mapping[str, Component]) -> None:
    """Free all of them, even when one fails to be freed."""
    with ExitStack() as stack:
        for name, component in components.items():
            stack.enter_context(as_component_error(name, "free"))
            stack.callback(component.free)
