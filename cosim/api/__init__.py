"""Python interface: load a scenario, and run it or step it."""

from .execution import Execution, evaluate_scenario_checks
from .scenario_runs import load, run
from .simulation import Simulation

__all__ = ["Execution", "Simulation", "evaluate_scenario_checks", "load", "run"]
