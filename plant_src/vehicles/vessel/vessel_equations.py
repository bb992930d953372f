"""Equations of a vessel in six degrees of freedom as a model for export."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from cosim.core.component import Variable
from cosim.export.equations.c_code import Callee
from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.interface import VESSEL_STATES, WORLD_OUTPUTS
from ..common.named_values import ConstantsMap, NamedValues, values_by_name, variables_of
from ..common.water_surface import SURFACE_SUM
from .hull import Hull
from .strips import TwinHull
from .wave_loads import WAVE_SUM, wave_table

#: longest integration step (s); the motion of vessels is slow, and each stage evaluates the waves
MAX_STEP = 0.01


def wave_table_of(parameters: NamedValues, hull: TwinHull) -> ca.SX:
    """Return the table of wave components (`wave_loads.wave_table`) from the parameters `wave.*`."""
    return wave_table(
        hull,
        *(parameters[f"wave.{name}"] for name in ("amplitude", "frequency", "direction", "phase")),
    )


@dataclass(frozen=True)
class VesselModel:
    """Equations of one vessel.

    Attributes:
        identifier: Name of the FMU.
        description: Description of the FMU.
        variables: Parameters, inputs and outputs.
        derive_constants: Function from the parameters to the constants, which holds everything that
            depends on parameters only.
        hull: Function from the constants to the vessel.
        actuators: Names of the actuator states.
        actuator_rate: Function from actuator states, inputs and constants to the rates of these
            states. None means that the kind of the exported model moves them after each step.
        callees: Further functions that the equations call.
    """

    identifier: str
    description: str
    variables: Sequence[Variable]
    derive_constants: Callable[[NamedValues], Mapping[str, ca.SX]]
    hull: Callable[[NamedValues], Hull]
    actuators: Sequence[str] = ()
    actuator_rate: Callable[[ca.SX, NamedValues, NamedValues], ca.SX] | None = None
    callees: Sequence[Callee] = ()

    @cached_property
    def constants(self) -> ConstantsMap:
        """Map from the parameters to the constants of the equations."""
        return ConstantsMap(self.variables, self.derive_constants)

    def hull_with(self, constants: ca.SX) -> Hull:
        """Return the vessel for a vector of constants."""
        return self.hull(self.constants.by_name(constants))

    def create_continuous_model(
        self, kind: type[ContinuousModel] = ContinuousModel, **options: Any
    ) -> ContinuousModel:
        """Return the model to export; its contact outputs are 0.

        Args:
            kind: Class of the model.
            **options: Further arguments of the class.
        """
        inputs, actuators = variables_of(self.variables, "input"), len(self.actuators)
        return kind(
            self.identifier,
            self.description,
            self.variables,
            (*VESSEL_STATES, *self.actuators),
            lambda c: self.hull_with(c).initial_state(self.constants.by_name(c), actuators),
            lambda x, u, c: ca.vertcat(
                self.hull_with(c).rate(x, values_by_name(u, inputs)), self._actuator_rates(x, u, c)
            ),
            lambda x, _u, c: ca.vertcat(
                self.hull_with(c).observe(x), ca.SX.zeros(len(WORLD_OUTPUTS))
            ),
            normalised_state,
            derived_parameters=self.constants.vector,
            max_sub_step=MAX_STEP,
            callees=[WAVE_SUM, SURFACE_SUM, *self.callees],
            **options,
        )

    def _actuator_rates(self, state: ca.SX, inputs: ca.SX, constants: ca.SX) -> ca.SX:
        if self.actuator_rate is None:
            return ca.SX.zeros(len(self.actuators))
        given = values_by_name(inputs, variables_of(self.variables, "input"))
        return self.actuator_rate(
            state[len(VESSEL_STATES) :], given, self.constants.by_name(constants)
        )


def normalised_state(state: ca.SX) -> ca.SX:
    """Return the state with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised_quaternion(state[3:7]), state[7:])
