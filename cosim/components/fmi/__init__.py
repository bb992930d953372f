"""FMUs as components; the only room that knows FMPy."""

from ...core.component import Component
from .description import DefaultExperiment, FmuDescription
from .file import FmuFile
from .fmi2 import Fmi2Instance
from .fmi3 import Fmi3Instance
from .isolated import Isolation

__all__ = ["DefaultExperiment", "FmuDescription", "FmuFile", "Isolation", "create_component"]


def create_component(
    file: FmuFile, instance_name: str, logging_on: bool = False, isolation: Isolation | None = None
) -> Component:
    """A component for the FMU, with `isolation` in a process of its own; no code of the FMU runs before `bind`.

    Raises InputError when the FMU cannot run on this machine.
    """
    kind = Fmi2Instance if file.description.major == 2 else Fmi3Instance
    if isolation:
        from .isolated.isolated_fmu import IsolatedFmu

        return IsolatedFmu(kind, file, instance_name, logging_on, isolation)
    return kind(file, instance_name, logging_on)
