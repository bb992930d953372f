"""Vehicle model: variables, states and rigid body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING

import numpy as np

from cosim.core.component import Causality, Variable
from cosim.export.equations.exported_interface import describe_variables

from .common.interface import ENVIRONMENT_INPUTS
from .common.shapes import Body, Vector

if TYPE_CHECKING:
    from .multirotor.airframe import Airframe
    from .submerged.craft import Craft
    from .vessel.boat import Boat


@dataclass(frozen=True)
class Model:
    """A vehicle model.

    Attributes:
        name: Name of the model and of its plant FMU.
        interface: Variables of the FMU, in the order of the equations.
        states: Names of the states, in the order of the equations.
        body: Rigid body in Bullet for the start values of the parameters.
        crash_speed: Change of velocity (m/s) by a collision above which the vehicle has crashed; a
            scenario may replace it.
        is_vessel: Whether the vehicle floats and has a landing deck.
        vehicle: Name of the vehicle in scenarios if it differs from `name`.
        motion: "planar" or "6dof"; distinguishes models of the same vehicle.
        airframe: Data of a multirotor.
        craft: Data of a submerged vehicle.
        boat: Data of a vessel that is given by a file.
        visual: Triangles that pictures show in place of shapes derived from the data (m, body
            frame), shape (n, 3, 3).
        body_of: Function from the parameters to the rigid body, if it depends on them. Raises
            InputError.
        equations: Name of the FMU whose binary has the equations, if it is not `name`.
        layout: Parameters and inputs of these equations, if they have longer arrays or more
            variables than `interface`.
        hulls: Name of each further hull of a vessel -> its parameters.
    """

    name: str
    interface: Sequence[Variable]
    states: Sequence[str]
    body: Body
    crash_speed: float
    is_vessel: bool = False
    vehicle: str = ""
    motion: str = "6dof"
    airframe: Airframe | None = None
    craft: Craft | None = None
    boat: Boat | None = None
    visual: np.ndarray | None = None
    body_of: Callable[[Mapping[str, float]], Body] | None = None
    equations: str = ""
    layout: Sequence[Variable] = ()
    hulls: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def binary(self) -> str:
        """Name of the FMU whose binary has the equations."""
        return self.equations or self.name

    @cached_property
    def equation_variables_text(self) -> str:
        """Variables and states of the equations in words, which their binary must repeat."""
        return describe_variables(self.layout or self.interface, self.states)

    @property
    def rotor_disc(self) -> tuple[Vector, float] | None:
        """Centre (m, body frame) and radius (m) of the disc of all rotors of a multirotor."""
        return self.airframe.rotor_disc if self.airframe else None

    def body_with(self, parameters: Mapping[str, float]) -> Body:
        """Return the rigid body of a vehicle with these parameters.

        Raises:
            InputError: If mass and inertia are physically impossible; a problem's subject begins
                with the name of a parameter.
        """
        return self.body_of(parameters) if self.body_of else self.body

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """Variables of a vehicle in a world: all but the environment inputs."""
        return tuple(
            variable for variable in self.interface if variable.name not in ENVIRONMENT_INPUTS
        )

    @cached_property
    def _variables_by_vehicle(self) -> dict[str, Sequence[Variable]]:
        return {}

    def variables_of(self, vehicle: str) -> Sequence[Variable]:
        """Return the variables of a vehicle with its name as prefix.

        They are kept for the next world.
        """
        if vehicle not in self._variables_by_vehicle:
            self._variables_by_vehicle[vehicle] = [
                replace(each, name=f"{vehicle}.{each.name}") for each in self.variables
            ]
        return self._variables_by_vehicle[vehicle]

    @cached_property
    def environment_inputs(self) -> tuple[Variable, ...]:
        """Inputs that the environment writes: the last inputs of the equations."""
        return tuple(variable for variable in self.interface if variable.name in ENVIRONMENT_INPUTS)

    @cached_property
    def input_count(self) -> int:
        """Number of inputs of the equations, without those that the environment writes."""
        return sum(len(variable.scalar_names) for variable in self._equation_inputs)

    @property
    def _equation_inputs(self) -> list[Variable]:
        """Inputs of the equations, without those that the environment writes."""
        return [
            variable
            for variable in self.layout or self.interface
            if variable.causality == "input" and variable.name not in ENVIRONMENT_INPUTS
        ]

    @cached_property
    def input_places(self) -> list[slice]:
        """Consecutive parts of the inputs of the equations that belong to the interface, in order.

        The equations have longer arrays than the vehicle, so its inputs lie in several parts.
        """
        counts = {variable.name: len(variable.scalar_names) for variable in self.interface}
        places, end = list[slice](), 0
        for variable in self._equation_inputs:
            start, count = end, counts.get(variable.name, 0)
            end += len(variable.scalar_names)
            if count and places and places[-1].stop == start:
                places[-1] = slice(places[-1].start, start + count)
            elif count:
                places.append(slice(start, start + count))
        return places

    def equation_parameters(self, values: Mapping[str, float]) -> list[float]:
        """Return the parameters of the equations for the parameters of the interface, by name.

        Arrays are filled up with zeros.
        """
        result = list[float]()
        for variable in self.layout or self.interface:
            if variable.causality == "parameter":
                result += [values.get(name, 0.0) for name in variable.scalar_names]
        return result

    def real_variables(self, causality: Causality) -> list[Variable]:
        """Return the real variables of a causality, in order."""
        return [
            variable
            for variable in self.variables
            if variable.causality == causality and variable.type == "Float64"
        ]

    def slots(self, causality: Causality) -> list[str]:
        """Return the names of the real scalars of a causality, in order."""
        names = [variable.scalar_names for variable in self.real_variables(causality)]
        return [*chain.from_iterable(names)]

    def start_values(self, causality: Causality) -> list[float]:
        """Return the start values of the real scalars of a causality, in order."""
        starts = [np.ravel(variable.start) for variable in self.real_variables(causality)]
        values: list[float] = np.concatenate([[], *starts]).astype(float).tolist()
        return values
