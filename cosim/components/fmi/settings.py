"""Settings of one FMU instance and of its worker process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

from ...core.integration_methods import METHODS, Method
from ...process.journal import Deadlines
from .description import DefaultExperiment, FmuDescription
from .preflight.model_description import Interface

#: relative tolerance of a solver with variable step size, if neither the settings nor the FMU have
#: one
DEFAULT_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class SolverSettings:
    """Integration method of a Model Exchange FMU.

    Attributes:
        method: The method.
        step_size: Largest step size of a method with fixed step size (s); by default that of the
            default experiment, or else the communication step size. The method uses the largest
            step size up to this one that divides the communication step.
    """

    method: Method = "cvode"
    step_size: Fraction | None = None


@dataclass(frozen=True, slots=True)
class InstanceSettings:
    """Settings of one FMU instance.

    Attributes:
        tolerance: Relative tolerance that the FMU receives, and that of a solver with variable step
            size; by default that of the default experiment. Without any, the FMU receives none, and
            the solver uses 1e-6.
        solver: Integration method, which selects Model Exchange; None: Co-Simulation, or cvode if
            the FMU does not offer it.
        structural_parameters: Values that are set in Configuration Mode, before the start values.
    """

    tolerance: float | None = None
    solver: SolverSettings | None = None
    structural_parameters: Mapping[str, int] = field(default_factory=dict)

    def with_structural_parameters(
        self, description: FmuDescription, values: Mapping[str, Any]
    ) -> InstanceSettings:
        """Return the settings with those of the values that are valid sizes.

        The check of the start values refuses the others.
        """
        names = {
            variable.name
            for variable in description.variables
            if variable.causality == "structuralParameter"
        }
        sizes = {
            name: value
            for name, value in values.items()
            if name in names and type(value) is int and value > 0
        }
        return replace(self, structural_parameters=sizes)

    @property
    def interface(self) -> Interface | None:
        """Interface that the settings select; None: the preferred one of the FMU."""
        return "model-exchange" if self.solver else None

    @property
    def method(self) -> Method:
        """Integration method of a Model Exchange FMU."""
        return self.solver.method if self.solver else "cvode"

    def solver_tolerance(self, experiment: DefaultExperiment) -> float:
        """Return the relative tolerance of a solver with variable step size.

        Args:
            experiment: Default experiment of the FMU.
        """
        return self.tolerance or experiment.tolerance or DEFAULT_TOLERANCE

    def solver_step_size(self, experiment: DefaultExperiment) -> Fraction | None:
        """Return the largest step size (s) of a solver with fixed step size.

        None: the communication step size.
        """
        return (self.solver and self.solver.step_size) or experiment.step_size

    def describe_solver(self, experiment: DefaultExperiment) -> dict[str, Any]:
        """Return the method with its tolerance or its largest step size (s).

        None is the communication step size.
        """
        if METHODS[self.method].variable_step:
            return {"method": self.method, "tolerance": self.solver_tolerance(experiment)}
        step_size = self.solver_step_size(experiment)
        return {"method": self.method, "step_size": None if step_size is None else float(step_size)}


@dataclass(frozen=True)
class Isolation:
    """Settings of a worker process.

    Attributes:
        deadlines: Largest wall times of calls into the FMU (s).
        sandbox: Restrict the worker process: it reads only its own files and libraries, writes only
            to its temporary folder, and has no network and no other processes.
    """

    deadlines: Deadlines = field(default_factory=Deadlines)
    sandbox: bool = False

    def worker_setup(self, fmu: Path, temporary: Path, importer: int) -> Callable[[], None]:
        """Create the function that a worker process calls before it loads foreign code.

        Args:
            fmu: Folder of the extracted FMU.
            temporary: Folder for temporary files of the FMU.
            importer: Process id of the importer; the worker process ends with it.

        Returns:
            A function that enters the sandbox. It raises InputError if this system does not support
            the required restrictions.
        """
        from ...process.sandbox import SandboxSettings, enter_sandbox, interpreter_folders

        readable = (fmu, *interpreter_folders()) if self.sandbox else ()
        settings = SandboxSettings(
            readable=readable, writable=(temporary,), confine=self.sandbox, parent=importer
        )
        return partial(enter_sandbox, settings)
