"""Factory of the components of FMUs, which reads every FMU file once."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..components.fmi import (
    FmuFile,
    InstanceSettings,
    Interface,
    Isolation,
    create_component,
    open_fmu,
)
from ..core.component import Component
from ..core.paths import resolve_path
from ..export.foreign import add_binary
from .sources import Creation


class ComponentFactory:
    """Factory of the components of FMUs, however many components use the same file.

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
        self._isolation, self._isolate_fmus = isolation, isolate_fmus
        self._loaded_fmus = loaded_fmus
        #: FMU files in use, by resolved path and the interface that the scenario demands
        self.fmus: dict[tuple[Path, Interface | None], FmuFile] = {}
        #: solver of each Model Exchange FMU, by full name of its component
        self.solvers: dict[str, dict[str, Any]] = {}

    def instantiate(
        self, creation: Creation, path: Path, settings: InstanceSettings, isolated: bool
    ) -> Component:
        """Create the component of an FMU.

        Args:
            creation: The component.
            path: Path of the FMU.
            settings: Tolerance and solver.
            isolated: Run it in a separate process in any case.
        """
        interface = settings.interface
        key = resolve_path(path), interface
        used = self.fmus.get(key)
        needs_own_process = used is not None and used.description.once_per_process
        if used is None:
            loaded = None if interface else self._loaded_fmus.get(key[0])
            self.fmus[key] = loaded or open_fmu(path, interface, add_binary)
        elif needs_own_process:
            # its process must not inherit the library that is loaded in this one
            self.fmus[key] = open_fmu(path, interface, add_binary)
        file = self.fmus[key]
        settings = settings.with_structural_parameters(file.description, creation.values)
        isolated = isolated or self._isolate_fmus or needs_own_process
        component = create_component(
            file, creation.name, settings, self._isolation if isolated else None
        )
        if file.description.interface == "model-exchange":
            experiment = file.description.default_experiment
            self.solvers[creation.name] = settings.describe_solver(experiment)
        return component
