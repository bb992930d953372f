"""The flat plan of a system and the executors that run it."""

from .executor import Executor
from .native_executor import NativeExecutor, native_available
from .plan import Plan, compile_plan
from .python_executor import PythonExecutor
from .recorder import Recorder
from .settings import ExecutorKind
from .step_runner import Termination

EXECUTORS: dict[str, type[Executor]] = {"native": NativeExecutor, "python": PythonExecutor}


def executor_class(kind: ExecutorKind) -> type[Executor]:
    """Return the executor class of this kind; "auto" is the native executor if it was built.

    Raises:
        ValueError: the native executor is required but was not built.
        InputError: the native executor was built from other sources.
    """
    if kind == "native" and not native_available():
        raise ValueError(
            "the native executor was not built: install cosim on a machine with a C compiler"
        )
    if kind == "auto":
        return EXECUTORS["native" if native_available() else "python"]
    return EXECUTORS[kind]


__all__ = [
    "EXECUTORS",
    "Executor",
    "ExecutorKind",
    "Plan",
    "Recorder",
    "Termination",
    "compile_plan",
    "executor_class",
    "native_available",
]
