"""The flat plan of a system and its executor."""

from .executor import Executor, Termination
from .plan import Plan, compile_plan
from .recorder import Recorder

__all__ = ["Executor", "Plan", "Recorder", "Termination", "compile_plan"]
