"""FMUs as components; the only package that uses FMPy at run time."""

from ...core.integration_methods import Method
from .co_simulation import CoSimulationFmu
from .description import DefaultExperiment, FmuDescription
from .driver import FmuComponent, FmuDriver
from .file import FmuFile, open_fmu
from .preflight.model_description import Interface
from .settings import InstanceSettings, Isolation, SolverSettings

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
    "open_fmu",
]

DEFAULT_SETTINGS = InstanceSettings()


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
    driver: type[FmuDriver] = CoSimulationFmu
    if file.description.interface == "model-exchange":
        from .model_exchange import ModelExchangeFmu

        driver = ModelExchangeFmu
    if isolation:
        from .isolated import IsolatedFmu

        return IsolatedFmu(driver, file, instance_name, settings, isolation)
    return driver(file, instance_name, settings)
