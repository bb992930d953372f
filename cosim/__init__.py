"""FMI co-simulation of controllers and plants in lockstep.

>>> import cosim
>>> result = cosim.run("demo1_box")
>>> result["plant.uav.position.z"]
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .core import __version__

if TYPE_CHECKING:
    from .analysis.linearization import linearize
    from .analysis.loop_margins import margins
    from .analysis.trimming import trim
    from .api import Result, Simulation, load, run
    from .api.reference_comparison import compare
    from .api.single_fmu import simulate
    from .core.component import Component, Variable
    from .core.errors import CheckError, ComponentError, CosimError, InputError
    from .results.kpi import NoValue, Prefix, Signal, better, no_value, units
    from .studies.functions import regress, sweep, tune, worst_case

__all__ = [
    "CheckError",
    "Component",
    "ComponentError",
    "CosimError",
    "InputError",
    "NoValue",
    "Prefix",
    "Result",
    "Signal",
    "Simulation",
    "Variable",
    "__version__",
    "better",
    "compare",
    "linearize",
    "load",
    "margins",
    "no_value",
    "regress",
    "run",
    "simulate",
    "sweep",
    "trim",
    "tune",
    "units",
    "worst_case",
]

#: module of each name that is imported on first use, because `import cosim` must be fast
_MODULES = {
    **dict.fromkeys(("Result", "Simulation", "load", "run"), "api"),
    **dict.fromkeys(("Component", "Variable"), "core.component"),
    **dict.fromkeys(("CheckError", "ComponentError", "CosimError", "InputError"), "core.errors"),
    **dict.fromkeys(("NoValue", "Prefix", "Signal", "better", "no_value", "units"), "results.kpi"),
    **dict.fromkeys(("regress", "sweep", "tune", "worst_case"), "studies.functions"),
    "compare": "api.reference_comparison",
    "linearize": "analysis.linearization",
    "margins": "analysis.loop_margins",
    "simulate": "api.single_fmu",
    "trim": "analysis.trimming",
}


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    """Import a public name on first use."""
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_MODULES[name]}", __name__), name)
