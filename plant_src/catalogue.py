"""The vehicle models that a world can hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cosim.component import Causality, Variable

from .shadow import FloatingBody, FreeBody, PlanarBody, Shadow
from .vehicles import multirotor_interface
from .vehicles.airframe import Airframe
from .vehicles.ar_drone import geometry as ar_drone
from .vehicles.ar_drone.parameters import AIRFRAME as AR_DRONE
from .vehicles.crazyflie import geometry as crazyflie
from .vehicles.crazyflie.parameters import AIRFRAME as CRAZYFLIE
from .vehicles.interface import AFLOAT_STATES, SURROUNDINGS
from .vehicles.otter import geometry as otter
from .vehicles.otter import interface as otter_interface
from .vehicles.shapes import Body, Box, Vector
from .vehicles.strider import geometry as strider
from .vehicles.strider import interface as strider_interface
from .vehicles.strider_6dof import geometry as strider_6dof
from .vehicles.strider_6dof import interface as strider_6dof_interface
from .vehicles.survey_hexacopter import geometry as survey_hexacopter
from .vehicles.survey_hexacopter.parameters import AIRFRAME as SURVEY_HEXACOPTER

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
    shadow: type[Shadow]
    is_vessel: bool = False
    vehicle: str = ""
    motion: str = "6dof"
    constants: int | None = None
    #: of a multirotor, which may have another mass and inertia, and its shapes for a rotation to the body frame
    airframe: Airframe | None = None
    boxes: Boxes | None = None

    @property
    def rotor_plane(self) -> Vector | None:
        """Centre of the rotors in the body frame (m), of a multirotor."""
        return self.airframe.rotor_plane if self.airframe else None

    def body_with(self, parameters: Mapping[str, float]) -> Body:
        """The body in Bullet of a vehicle with these parameters. Raises InputError when there is no such body."""
        if self.airframe is None or self.boxes is None:
            return self.body
        inertia = np.zeros((3, 3))
        for name, (i, j) in multirotor_interface.INERTIA.items():
            inertia[i, j] = inertia[j, i] = parameters[name]
        return replace(self.airframe, mass=parameters["mass"], inertia=inertia).body(self.boxes)

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What a vehicle of this model has in a world."""
        return tuple(variable for variable in self.interface if variable.name not in SURROUNDINGS)

    @cached_property
    def surroundings(self) -> tuple[Variable, ...]:
        """What the environment does to it: the last inputs of the equations."""
        return tuple(variable for variable in self.interface if variable.name in SURROUNDINGS)

    def reals(self, causality: Causality) -> list[Variable]:
        """The real variables of a causality, in order."""
        return [variable for variable in self.variables if variable.causality == causality and variable.type == "Float64"]

    def slots(self, causality: Causality) -> list[str]:
        """Names of the real scalars of a causality, in order."""
        return [slot for variable in self.reals(causality) for slot in variable.slots]

    def starts(self, causality: Causality) -> list[float]:
        """Start values of the real scalars of a causality, in order."""
        return np.concatenate([np.zeros(0), *(np.ravel(variable.start) for variable in self.reals(causality))]).tolist()


def _multirotor(airframe: Airframe, boxes: Boxes) -> Model:
    variables, states = multirotor_interface.variables(airframe), multirotor_interface.states(airframe)
    constants = multirotor_interface.constants(airframe)
    return Model(
        airframe.name, variables, states, airframe.body(boxes), FreeBody, constants=constants, airframe=airframe, boxes=boxes
    )


_STRIDER = Model(
    "strider", strider_interface.VARIABLES, strider_interface.STATES, strider.BODY, PlanarBody, is_vessel=True, motion="planar"
)

MODELS = {
    model.name: model
    for model in (
        _multirotor(AR_DRONE, ar_drone.boxes),
        _multirotor(CRAZYFLIE, crazyflie.boxes),
        _multirotor(SURVEY_HEXACOPTER, survey_hexacopter.boxes),
        _STRIDER,
        Model(
            "strider_6dof",
            strider_6dof_interface.VARIABLES,
            AFLOAT_STATES,
            strider_6dof.BODY,
            FloatingBody,
            is_vessel=True,
            vehicle="strider",
            constants=strider_6dof_interface.CONSTANTS,
        ),
        Model(
            "otter",
            otter_interface.VARIABLES,
            (*AFLOAT_STATES, *otter_interface.SHAFTS),
            otter.BODY,
            FloatingBody,
            is_vessel=True,
            constants=otter_interface.CONSTANTS,
        ),
    )
}

#: vehicle -> motion -> its model; the first motion is the usual one
VEHICLES: dict[str, dict[str, Model]] = {}
for _model in MODELS.values():
    VEHICLES.setdefault(_model.vehicle or _model.name, {})[_model.motion] = _model
