"""Description of a kind of vehicle: variables, states and body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cosim.core.component import Causality, Variable

from .common.interface import ENVIRONMENT_INPUTS
from .common.shapes import Body, Box, Vector
from .multirotor.airframe import Airframe
from .multirotor.interface import INERTIA_INDICES

Boxes = Callable[[np.ndarray], tuple[Box, ...]]


@dataclass(frozen=True)
class Model:
    """A kind of vehicle: its plant FMU, its variables and states in the order of its equations, and its body in Bullet.

    `interface` has the variables of the FMU; in a world the environment sets those inputs that are surroundings. `motion`
    tells models of the same `vehicle` apart; `constants` is how many numbers the equations make of the parameters, once
    (None: they use the parameters themselves).
    """

    name: str
    interface: Sequence[Variable]
    states: Sequence[str]
    body: Body
    is_vessel: bool = False
    vehicle: str = ""
    motion: str = "6dof"
    constant_count: int | None = None
    #: of a multirotor, which may have another mass and inertia, and its shapes for a rotation to the body frame
    airframe: Airframe | None = None
    boxes: Boxes | None = None

    @property
    def rotor_centre(self) -> Vector | None:
        """Centre of the rotors in the body frame (m), of a multirotor."""
        return self.airframe.rotor_centre if self.airframe else None

    def body_with(self, parameters: Mapping[str, float]) -> Body:
        """The body in Bullet of a vehicle with these parameters. Raises InputError when there is no such body."""
        if self.airframe is None or self.boxes is None:
            return self.body
        inertia = np.zeros((3, 3))
        for name, (i, j) in INERTIA_INDICES.items():
            inertia[i, j] = inertia[j, i] = parameters[name]
        return replace(self.airframe, mass=parameters["mass"], inertia=inertia).body(self.boxes)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What a vehicle of this model has in a world."""
        return tuple(variable for variable in self.interface if variable.name not in ENVIRONMENT_INPUTS)

    @cached_property
    def environment_inputs(self) -> tuple[Variable, ...]:
        """What the environment does to it: the last inputs of the equations."""
        return tuple(variable for variable in self.interface if variable.name in ENVIRONMENT_INPUTS)

    def real_variables(self, causality: Causality) -> list[Variable]:
        """The real variables of a causality, in order."""
        return [variable for variable in self.variables if variable.causality == causality and variable.type == "Float64"]

    def slots(self, causality: Causality) -> list[str]:
        """Names of the real scalars of a causality, in order."""
        return [slot for variable in self.real_variables(causality) for slot in variable.scalar_names]

    def start_values(self, causality: Causality) -> list[float]:
        """Start values of the real scalars of a causality, in order."""
        return np.concatenate([np.zeros(0), *(np.ravel(variable.start) for variable in self.real_variables(causality))]).tolist()
