"""The factory that creates a component from its entry in a scenario."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..components.fmi import (
    FmuFile,
    InstanceSettings,
    Interface,
    Isolation,
    SolverSettings,
    create_component,
)
from ..core.component import Component
from ..core.errors import InputError, nearest_file
from ..core.paths import is_file, resolve_path
from ..export.foreign.source_fmus import usable_fmu
from ..process.journal import calling_component
from .component_schema import ComponentSpec
from .nested_systems import Node

#: end of a source that "fmu" cannot name, and the keys that name it
_OTHER_SOURCE = re.compile(r"\.(py|mo)(?::\w+)?$")
_SOURCE_KEYS = {"py": "python", "mo": "modelica"}


class ComponentFactory:
    """Factory of components that reads every FMU file once, however many components use it.

    Args:
        isolation: How isolated FMUs run. An FMU is isolated if its component has `isolation`, if
            `isolate_fmus` is set, and from the second instance on if it allows only one instance
            per process.
        isolate_fmus: Isolate every FMU.
        loaded_fmus: FMU files that have already been read, by resolved path.
    """

    def __init__(
        self, isolation: Isolation, isolate_fmus: bool, loaded_fmus: Mapping[Path, FmuFile]
    ) -> None:
        self._isolation, self._isolate_fmus, self._loaded_fmus = (
            isolation,
            isolate_fmus,
            loaded_fmus,
        )
        #: FMU files in use, by resolved path and the interface that the scenario demands
        self.fmus: dict[tuple[Path, Interface | None], FmuFile] = {}
        #: solver of each Model Exchange FMU, by full name of its component
        self.solvers: dict[str, dict[str, Any]] = {}
        #: source files of the components made so far
        self.python_files: list[Path] = []
        self.modelica_files: list[Path] = []
        #: Modelica file of each FMU in the user's cache, by the resolved path of the FMU
        self.cached_fmus: dict[Path, Path] = {}

    def create(self, node: Node, name: str, values: Mapping[str, Any]) -> Component:
        """Create the component `name` of the system `node`.

        Args:
            node: The system.
            name: Name of the component in it.
            values: Values of variables that the scenario sets, by name; structural parameters among
                them size the arrays.

        Raises:
            InputError: The source of the component does not exist or cannot be used.
        """
        spec, full_name = node.spec.components[name], node.full_name(name)
        if spec.python is not None:
            return self._load_python(node, name, spec, full_name)
        if spec.fmu and (other := _OTHER_SOURCE.search(spec.fmu)):
            raise InputError(
                f'"{spec.fmu}" is not an FMU; it is named by "{_SOURCE_KEYS[other[1]]}" instead of '
                '"fmu"'
            )
        path = (
            self._build_modelica(node.folder, spec) if spec.fmu is None else node.folder / spec.fmu
        )
        solver = SolverSettings(spec.solver.method, spec.solver.step_size) if spec.solver else None
        settings = InstanceSettings(spec.tolerance, solver)
        interface = settings.interface
        key = resolve_path(path), interface
        used = self.fmus.get(key)
        needs_own_process = used is not None and used.description.once_per_process
        if used is None:
            loaded = None if interface else self._loaded_fmus.get(key[0])
            self.fmus[key] = loaded or usable_fmu(path, interface)
        elif (
            needs_own_process
        ):  # its process must not inherit the library that is loaded in this one
            self.fmus[key] = usable_fmu(path, interface)
        settings = settings.with_structural_parameters(self.fmus[key].description, values)
        isolated = self._isolate_fmus or spec.isolation is not None or needs_own_process
        component = create_component(
            self.fmus[key], full_name, settings, self._isolation if isolated else None
        )
        if (description := self.fmus[key].description).interface == "model-exchange":
            self.solvers[full_name] = settings.describe_solver(description.default_experiment)
        return component

    def _load_python(self, node: Node, name: str, spec: ComponentSpec, full_name: str) -> Component:
        from ..components.python_class import create_python_component, load_component

        assert spec.python is not None
        with calling_component(full_name, "loading the class", "load"):
            if name in node.document.objects:
                return create_python_component(
                    node.document.objects[name], spec.python, full_name, spec.arguments
                )
            self.python_files.append(node.folder / spec.python.rpartition(":")[0])
            return load_component(spec.python, node.folder, full_name, spec.arguments)

    def _build_modelica(self, folder: Path, spec: ComponentSpec) -> Path:
        """Return the FMU of "file.mo:Model", from the user's cache if source and tools are unchanged."""
        from ..export.build import cached_fmu

        reference = spec.modelica or ""
        file, _, model = reference.rpartition(":")
        if not file.endswith(".mo"):
            raise InputError(f'expected "file.mo:Model", found "{reference}"')
        if not is_file(folder / file):
            raise InputError(f'file "{file}" does not exist{nearest_file(folder / file)}')
        self.modelica_files.append(folder / file)
        fmu = cached_fmu(folder / file, model, [folder / library for library in spec.libraries])
        self.cached_fmus[resolve_path(fmu)] = folder / file
        return fmu
