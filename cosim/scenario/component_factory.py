"""The kinds of components a scenario can name, and how each is made."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from ..components.fmi import FmuFile, Isolation, create_component
from ..core.component import Component
from ..core.errors import InputError
from ..core.paths import is_file, resolve_path
from .nested_systems import Node
from .schema import ComponentSpec


class ComponentFactory:
    """Makes components; every FMU file is read once, however many components use it.

    `isolation` is how FMUs run that run in processes of their own: those that ask for it, with `apart` all of them, and the
    further instances of an FMU that allows one per process. `prepared` are FMU files by resolved path that were read before.
    """

    def __init__(self, isolation: Isolation, isolate_fmus: bool, loaded_fmus: Mapping[Path, FmuFile]) -> None:
        self._isolation, self._isolate_fmus, self._loaded_fmus = isolation, isolate_fmus, loaded_fmus
        self.fmus: dict[Path, FmuFile] = {}
        #: source files of components
        self.python_files: list[Path] = []
        self.modelica_files: list[Path] = []

    def create(self, node: Node, name: str) -> Component:
        """The component `name` of a system. Raises InputError."""
        spec = node.spec.components[name]
        source = next(source for source in _FACTORY_METHODS if getattr(spec, source) is not None)
        return _FACTORY_METHODS[source](self, node.folder, spec, node.full_name(name))

    def from_fmu(self, folder: Path, spec: ComponentSpec, name: str) -> Component:
        assert spec.fmu is not None
        return self._instantiate_fmu(folder / spec.fmu, spec, name)

    def from_modelica(self, folder: Path, spec: ComponentSpec, name: str) -> Component:
        """Built on demand: the FMU comes from the per-user cache when source and tools are unchanged."""
        from ..export.build import cached_fmu

        assert spec.modelica is not None
        file, _, model = spec.modelica.rpartition(":")
        if not file.endswith(".mo"):
            raise InputError(f'expected "file.mo:Model", found "{spec.modelica}"')
        if not is_file(folder / file):
            raise InputError(f'file "{file}" does not exist')
        self.modelica_files.append(folder / file)
        return self._instantiate_fmu(cached_fmu(folder / file, model), spec, name)

    def from_python(self, folder: Path, spec: ComponentSpec, name: str) -> Component:
        from ..components.python_class import load_component

        assert spec.python is not None
        self.python_files.append(folder / spec.python.rpartition(":")[0])
        return load_component(spec.python, folder, name, spec.arguments)

    def _instantiate_fmu(self, path: Path, spec: ComponentSpec, name: str) -> Component:
        file = self.fmus.get(resolve_path(path))
        alone = file is not None and file.description.once_per_process
        if file is None or alone:  # a library that was loaded before would be the same one in a worker
            file = self._loaded_fmus.get(resolve_path(path)) if file is None else None
            file = self.fmus[resolve_path(path)] = file or FmuFile(path)
        apart = self._isolate_fmus or spec.isolation is not None or alone
        return create_component(file, name, isolation=self._isolation if apart else None)


_FACTORY_METHODS: Mapping[str, Callable[[ComponentFactory, Path, ComponentSpec, str], Component]] = {
    "fmu": ComponentFactory.from_fmu,
    "python": ComponentFactory.from_python,
    "modelica": ComponentFactory.from_modelica,
}
