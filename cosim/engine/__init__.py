"""The flat plan of a system and its executors."""

from typing import Literal

from .executor import Executor, Termination
from .native_executor import NativeExecutor, native_available
from .plan import Plan, compile_plan
from .python_executor import PythonExecutor
from .recorder import Recorder

ExecutorKind = Literal["auto", "native", "python"]

EXECUTORS: dict[str, type[Executor]] = {"native": NativeExecutor, "python": PythonExecutor}


def executor_class(kind: ExecutorKind) -> type[Executor]:
    """The executor of that kind; "auto" is the native one where it was built. Raises ValueError where it was not."""
    if kind == "native" and not native_available():
        raise ValueError("the native executor was not built: install cosim where a C compiler is found")
    return EXECUTORS["python" if kind == "auto" and not native_available() else "native" if kind == "auto" else kind]


__all__ = [
    "EXECUTORS",
    "Executor",
    "ExecutorKind",
    "Plan",
    "Recorder",
    "Termination",
    "native_available",
    "compile_plan",
    "executor_class",
]
