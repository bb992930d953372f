"""The factory that creates a component from its entry in a scenario."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..components.fmi import FmuFile, Isolation, create_component
from ..core.component import Component
from ..core.errors import InputError
from ..core.paths import is_file, resolve_path
from .nested_systems import Node


class ComponentFactory:
    """Factory of components that reads every FMU file once, however many components use it.

    Args:
        isolation: How isolated FMUs run. An FMU is isolated if its component has `isolation`, if `isolate_fmus` is set, and
            from the second instance on if it allows only one instance per process.
        isolate_fmus: Isolate every FMU.
        loaded_fmus: FMU files that have already been read, by resolved path.
    """

    def __init__(self, isolation: Isolation, isolate_fmus: bool, loaded_fmus: Mapping[Path, FmuFile]) -> None:
        self._isolation, self._isolate_fmus, self._loaded_fmus = isolation, isolate_fmus, loaded_fmus
        #: FMU files in use, by resolved path
        self.fmus: dict[Path, FmuFile] = {}
        #: source files of the components made so far
        self.python_files: list[Path] = []
        self.modelica_files: list[Path] = []

    def create(self, node: Node, name: str) -> Component:
        """Create the component `name` of the system `node`.

        Raises:
            InputError: The source of the component does not exist or cannot be used.
        """
        spec, full_name = node.spec.components[name], node.full_name(name)
        if spec.python is not None:
            from ..components.python_class import load_component

            self.python_files.append(node.folder / spec.python.rpartition(":")[0])
            return load_component(spec.python, node.folder, full_name, spec.arguments)
        path = self._build_modelica(node.folder, spec.modelica or "") if spec.fmu is None else node.folder / spec.fmu
        is_another_instance = resolve_path(path) in self.fmus
        file = self._fmu_file(path)
        needs_own_process = is_another_instance and file.description.once_per_process
        isolated = self._isolate_fmus or spec.isolation is not None or needs_own_process
        return create_component(file, full_name, isolation=self._isolation if isolated else None)

    def _build_modelica(self, folder: Path, reference: str) -> Path:
        """Return the FMU of "file.mo:Model", from the user's cache if source and tools are unchanged."""
        from ..export.build import cached_fmu

        file, _, model = reference.rpartition(":")
        if not file.endswith(".mo"):
            raise InputError(f'expected "file.mo:Model", found "{reference}"')
        if not is_file(folder / file):
            raise InputError(f'file "{file}" does not exist')
        self.modelica_files.append(folder / file)
        return cached_fmu(folder / file, model)

    def _fmu_file(self, path: Path) -> FmuFile:
        """Return the FMU file at `path`: that of an earlier instance, one read before, or a new one."""
        key = resolve_path(path)
        used = self.fmus.get(key)
        if used is None:
            self.fmus[key] = self._loaded_fmus.get(key) or FmuFile(path)
        elif used.description.once_per_process:  # a worker process must not inherit the loaded library
            self.fmus[key] = FmuFile(path)
        return self.fmus[key]
