"""A vessel's equations with their parameters as what is exported: the model of its FMU."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import casadi as ca

from cosim.core.component import Variable
from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.interface import VESSEL_STATES
from ..common.named_values import ConstantsMap, NamedValues, values_by_name, variables_of
from .hull import Hull
from .wave_loads import SURFACE_SUM, WAVE_SUM, Footprint, wave_table


def wave_table_of(parameters: NamedValues, footprint: Footprint) -> ca.SX:
    """The table of waves."""
    return wave_table(footprint, *(parameters[f"wave.{name}"] for name in ("amplitude", "frequency", "direction", "phase")))


@dataclass(frozen=True)
class VesselModel:
    """The equations of one vessel: `prepare` makes constants of its parameters, `hull` the vessel of its constants.

    Only what depends on parameters is among the constants. `actuators` are the names of further states, which `drive` moves
    after each step: state, inputs, constants, step -> state.
    """

    identifier: str
    description: str
    variables: Sequence[Variable]
    derive_constants: Callable[[NamedValues], Mapping[str, ca.SX]]
    hull: Callable[[NamedValues], Hull]
    actuators: Sequence[str] = ()

    @cached_property
    def constants(self) -> ConstantsMap:
        """Map from the parameters to the constants of the equations."""
        return ConstantsMap(self.variables, self.derive_constants)

    def hull_with(self, constants: ca.SX) -> Hull:
        """The vessel with these constants."""
        return self.hull(self.constants.by_name(constants))

    def create_continuous_model(self, kind: type[ContinuousModel] = ContinuousModel, **more: Any) -> ContinuousModel:
        """What is exported: the vessel with its waves; contact reads 0."""
        return kind(
            self.identifier,
            self.description,
            self.variables,
            (*VESSEL_STATES, *self.actuators),
            lambda c: self.hull_with(c).initial_state(self.constants.by_name(c), len(self.actuators)),
            lambda x, u, c: ca.vertcat(
                self.hull_with(c).rate(x, values_by_name(u, variables_of(self.variables, "input"))),
                ca.SX.zeros(len(self.actuators)),
            ),
            lambda x, u, c: ca.vertcat(self.hull_with(c).observe(x), ca.SX.zeros(3)),
            normalised_state,
            derived_parameters=self.constants.vector,
            callees=[WAVE_SUM, SURFACE_SUM],
            **more,
        )


def normalised_state(state: ca.SX) -> ca.SX:
    """The state with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised_quaternion(state[3:7]), state[7:])


def initial_parameters(parameters: NamedValues) -> dict[str, ca.SX]:
    """Those parameters that say how the vessel starts."""
    return {name: value for name, value in parameters.items() if name.startswith("initial.")}
