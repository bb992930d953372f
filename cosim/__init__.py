"""cosim: FMI co-simulation of controllers and plants in lockstep.

import cosim
result = cosim.run("demo1_box")
result["plant.uav.position.z"]
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from .core.version import __version__

if TYPE_CHECKING:
    from .api import load, run
    from .core.errors import CheckError, ComponentError, CosimError, InputError
    from .results import Result

__all__ = ["CheckError", "ComponentError", "CosimError", "InputError", "Result", "__version__", "load", "run"]

_PUBLIC_NAMES = {"load": "api", "run": "api", "Result": "results"} | {
    name: "core.errors" for name in ("CheckError", "ComponentError", "CosimError", "InputError")
}


def __dir__() -> list[str]:
    return __all__


def __getattr__(name: str) -> Any:
    """Import public names when they are first used, so that `import cosim` costs nothing."""
    if name not in _PUBLIC_NAMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f".{_PUBLIC_NAMES[name]}", __name__), name)
