"""Settings of one FMU instance."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Literal

#: integration method: explicit Euler and Runge-Kutta of order 4 at fixed step size, or CVODE with variable step size
Method = Literal["euler", "rk4", "cvode"]


@dataclass(frozen=True, slots=True)
class SolverSettings:
    """Integration method of a Model Exchange FMU.

    Attributes:
        method: The method.
        step_size: Largest step size of a method with fixed step size (s); by default that of the default experiment, or else the
            communication step size. The method uses the largest step size up to this one that divides the communication step.
    """

    method: Method = "cvode"
    step_size: Fraction | None = None


@dataclass(frozen=True, slots=True)
class InstanceSettings:
    """Settings of one FMU instance.

    Attributes:
        tolerance: Relative tolerance that the FMU receives, and that of a solver with variable step size; by default that of the
            default experiment. Without any, the FMU receives none, and the solver uses 1e-6.
        solver: Integration method of a Model Exchange FMU.
    """

    tolerance: float | None = None
    solver: SolverSettings = SolverSettings()
