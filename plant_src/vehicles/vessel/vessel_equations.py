"""A vessel's equations with their parameters as what is exported: the model of its FMU."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate
from typing import Any

import casadi as ca

from cosim.core.component import Variable
from cosim.export.equations.model import ContinuousModel

from ..common import kinematics
from ..common.interface import VESSEL_STATES
from .hull import Hull, ValuesByName
from .wave_loads import SURFACE_SUM, WAVE_SUM, Footprint, wave_table


def values_by_name(vector: ca.SX, variables: Sequence[Variable]) -> dict[str, ca.SX]:
    """The values of each variable in a vector that holds them in order; `group.x`, `group.y` also together as `group`."""
    places: dict[str, list[int]] = {}
    first = 0
    for variable in variables:
        slots = list(range(first, first + len(variable.scalar_names)))
        first += len(slots)
        places[variable.name] = slots
        group = variable.name.rpartition(".")[0]
        if group and not variable.shape:
            places.setdefault(group, []).extend(slots)
    return {name: vector[slots] for name, slots in places.items()}


def wave_table_of(parameters: ValuesByName, footprint: Footprint) -> ca.SX:
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
    derive_constants: Callable[[ValuesByName], ValuesByName]
    hull: Callable[[ValuesByName], Hull]
    actuators: Sequence[str] = ()

    def constants(self, parameters: ca.SX) -> ca.SX:
        """The constants one after the other."""
        values = self.derive_constants(values_by_name(parameters, self._variables_of("parameter")))
        return ca.vertcat(*(ca.vec(value) for value in values.values()))

    def constants_by_name(self, constants: ca.SX) -> ValuesByName:
        """The constants by name."""
        symbols = ca.SX.sym("parameters", sum(len(variable.scalar_names) for variable in self._variables_of("parameter")))
        shapes = {
            name: value.shape
            for name, value in self.derive_constants(values_by_name(symbols, self._variables_of("parameter"))).items()
        }
        parts = ca.vertsplit(constants, [0, *accumulate(rows * columns for rows, columns in shapes.values())])
        return {name: ca.reshape(part, shape) for (name, shape), part in zip(shapes.items(), parts, strict=True)}

    def hull_with(self, constants: ca.SX) -> Hull:
        """The vessel with these constants."""
        return self.hull(self.constants_by_name(constants))

    def create_continuous_model(self, kind: type[ContinuousModel] = ContinuousModel, **more: Any) -> ContinuousModel:
        """What is exported: the vessel with its waves; contact reads 0."""
        return kind(
            self.identifier,
            self.description,
            self.variables,
            (*VESSEL_STATES, *self.actuators),
            lambda c: self.hull_with(c).initial_state(self.constants_by_name(c), len(self.actuators)),
            lambda x, u, c: ca.vertcat(
                self.hull_with(c).rate(x, values_by_name(u, self._variables_of("input"))), ca.SX.zeros(len(self.actuators))
            ),
            lambda x, u, c: ca.vertcat(self.hull_with(c).observe(x), ca.SX.zeros(3)),
            normalised_state,
            derived_parameters=self.constants,
            callees=[WAVE_SUM, SURFACE_SUM],
            **more,
        )

    def _variables_of(self, causality: str) -> list[Variable]:
        return [variable for variable in self.variables if variable.causality == causality]


def normalised_state(state: ca.SX) -> ca.SX:
    """The state with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised_quaternion(state[3:7]), state[7:])


def initial_parameters(parameters: ValuesByName) -> ValuesByName:
    """Those parameters that say how the vessel starts."""
    return {name: value for name, value in parameters.items() if name.startswith("initial.")}
