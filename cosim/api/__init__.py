"""Python interface: load a scenario, and run it or step it."""

from ..results import Result
from . import presentation
from .execution import Execution, evaluate_scenario_checks
from .scenario_runs import load, run
from .simulation import Simulation

presentation.enable()

__all__ = ["Execution", "Result", "Simulation", "evaluate_scenario_checks", "load", "run"]
