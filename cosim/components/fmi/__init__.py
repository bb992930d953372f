"""FMUs as components; the only package that uses FMPy at run time."""

from collections.abc import Sequence
from typing import Protocol

from ...core.component import Component
from .description import DefaultExperiment, FmuDescription
from .file import FmuFile
from .fmi1 import Fmi1Instance
from .fmi2 import Fmi2Instance
from .fmi3_slave import Fmi3Slave
from .instance import FmuInstance
from .preflight import Interface
from .settings import InstanceSettings, Isolation, Method, SolverSettings

__all__ = [
    "DefaultExperiment",
    "FmuComponent",
    "FmuDescription",
    "FmuFile",
    "InstanceSettings",
    "Interface",
    "Isolation",
    "Method",
    "SolverSettings",
    "create_component",
]

DEFAULT_SETTINGS = InstanceSettings()


class FmuComponent(Component, Protocol):
    """Component of an FMU.

    Attributes:
        description: Model description of the FMU.
    """

    description: FmuDescription


def create_component(
    file: FmuFile,
    instance_name: str,
    settings: InstanceSettings = DEFAULT_SETTINGS,
    isolation: Isolation | None = None,
) -> FmuComponent:
    """Create a component for one instance of an FMU.

    No code of the FMU runs here: its binary is loaded by `Component.instantiate`. `loggingOn`,
    which enables the FMU's debug messages, is true if the logger "cosim.component" has the level
    DEBUG.

    Args:
        file: The FMU; instances of the same FMU share one `FmuFile`.
        instance_name: Name of the FMU instance, used in messages too.
        settings: Tolerance and integration method.
        isolation: Settings of a worker process for the FMU; None runs the FMU in the importer's
            process.

    Raises:
        InputError: The FMU has no usable binary for this platform, or a worker process is not
            possible on it.
    """
    description = file.description
    if description.interface == "model-exchange":
        from .model_exchange import Fmi1Model, Fmi2Model, Fmi3Model

        classes: Sequence[type[FmuInstance]] = (Fmi1Model, Fmi2Model, Fmi3Model)
    else:
        classes = (Fmi1Instance, Fmi2Instance, Fmi3Slave)
    instance_class = classes[description.major - 1]
    if isolation:
        from .isolated import IsolatedFmu

        return IsolatedFmu(instance_class, file, instance_name, settings, isolation)
    return instance_class(file, instance_name, settings)
