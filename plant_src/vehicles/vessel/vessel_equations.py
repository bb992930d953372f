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
from ..common.interface import AFLOAT_STATES
from .hull import Hull, Named
from .wave_loads import SUM, SURFACE, Footprint, table


def named(vector: ca.SX, variables: Sequence[Variable]) -> dict[str, ca.SX]:
    """The values of each variable in a vector that holds them in order; `group.x`, `group.y` also together as `group`."""
    places: dict[str, list[int]] = {}
    first = 0
    for variable in variables:
        slots = list(range(first, first + len(variable.slots)))
        first += len(slots)
        places[variable.name] = slots
        group = variable.name.rpartition(".")[0]
        if group and not variable.shape:
            places.setdefault(group, []).extend(slots)
    return {name: vector[slots] for name, slots in places.items()}


def sea_of(parameters: Named, footprint: Footprint) -> ca.SX:
    """The table of waves."""
    return table(footprint, *(parameters[f"wave.{name}"] for name in ("amplitude", "frequency", "direction", "phase")))


@dataclass(frozen=True)
class Vessel:
    """The equations of one vessel: `prepare` makes constants of its parameters, `hull` the vessel of its constants.

    Only what depends on parameters is among the constants. `actuators` are the names of further states, which `drive` moves
    after each step: state, inputs, constants, step -> state.
    """

    identifier: str
    description: str
    variables: Sequence[Variable]
    prepare: Callable[[Named], Named]
    hull: Callable[[Named], Hull]
    actuators: Sequence[str] = ()

    def constants(self, parameters: ca.SX) -> ca.SX:
        """The constants one after the other."""
        values = self.prepare(named(parameters, self._of("parameter")))
        return ca.vertcat(*(ca.vec(value) for value in values.values()))

    def unpacked(self, constants: ca.SX) -> Named:
        """The constants by name."""
        symbols = ca.SX.sym("parameters", sum(len(variable.slots) for variable in self._of("parameter")))
        shapes = {name: value.shape for name, value in self.prepare(named(symbols, self._of("parameter"))).items()}
        parts = ca.vertsplit(constants, [0, *accumulate(rows * columns for rows, columns in shapes.values())])
        return {name: ca.reshape(part, shape) for (name, shape), part in zip(shapes.items(), parts, strict=True)}

    def at(self, constants: ca.SX) -> Hull:
        """The vessel with these constants."""
        return self.hull(self.unpacked(constants))

    def model(self, kind: type[ContinuousModel] = ContinuousModel, **more: Any) -> ContinuousModel:
        """What is exported: the vessel with its waves; contact reads 0."""
        return kind(
            self.identifier,
            self.description,
            self.variables,
            (*AFLOAT_STATES, *self.actuators),
            lambda c: self.at(c).initial_state(self.unpacked(c), len(self.actuators)),
            lambda x, u, c: ca.vertcat(self.at(c).rate(x, named(u, self._of("input"))), ca.SX.zeros(len(self.actuators))),
            lambda x, u, c: ca.vertcat(self.at(c).observe(x), ca.SX.zeros(3)),
            normalised,
            constants=self.constants,
            callees=[SUM, SURFACE],
            **more,
        )

    def _of(self, causality: str) -> list[Variable]:
        return [variable for variable in self.variables if variable.causality == causality]


def normalised(state: ca.SX) -> ca.SX:
    """The state with a unit quaternion."""
    return ca.vertcat(state[0:3], kinematics.normalised(state[3:7]), state[7:])


def initial(parameters: Named) -> Named:
    """Those parameters that say how the vessel starts."""
    return {name: value for name, value in parameters.items() if name.startswith("initial.")}
