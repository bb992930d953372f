"""FMUs as components; the only package that uses FMPy at run time."""

import logging

from ...core.component import Component
from ...core.component_log import LOGGER_NAME
from .description import DefaultExperiment, FmuDescription
from .file import FmuFile
from .fmi2 import Fmi2Instance
from .fmi3 import Fmi3Instance
from .isolated import Isolation

__all__ = ["DefaultExperiment", "FmuDescription", "FmuFile", "Isolation", "create_component"]


def create_component(file: FmuFile, instance_name: str, isolation: Isolation | None = None) -> Component:
    """Create a component for one instance of an FMU.

    No code of the FMU runs here: its binary is loaded by `Component.instantiate`. `loggingOn`, which enables the FMU's debug
    messages, is true if the logger "cosim.component" has the level DEBUG.

    Args:
        file: The FMU; instances of the same FMU share one `FmuFile`.
        instance_name: Name of the FMU instance, used in messages too.
        isolation: Settings of a worker process for the FMU; None runs the FMU in the importer's process.

    Raises:
        InputError: The FMU has no usable binary for this platform, or a worker process is not possible on it.
    """
    logging_on = logging.getLogger(LOGGER_NAME).isEnabledFor(logging.DEBUG)
    instance_class = Fmi2Instance if file.description.major == 2 else Fmi3Instance
    if isolation:
        from .isolated.isolated_fmu import IsolatedFmu

        return IsolatedFmu(instance_class, file, instance_name, logging_on, isolation)
    return instance_class(file, instance_name, logging_on)
