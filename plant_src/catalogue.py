"""The vehicle models that a world can hold."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cosim.component import Causality, Variable

from .shadow import FreeBody, PlanarChain, Shadow
from .vehicles.ar_drone import geometry as ar_drone
from .vehicles.ar_drone import interface as ar_drone_interface
from .vehicles.shapes import Body
from .vehicles.strider import geometry as strider
from .vehicles.strider import interface as strider_interface


@dataclass(frozen=True)
class Model:
    """A kind of vehicle: its plant FMU, its variables and states in the order of its equations, and its body in Bullet."""

    name: str
    variables: Sequence[Variable]
    states: Sequence[str]
    body: Body
    shadow: type[Shadow]
    is_vessel: bool = False

    def slots(self, causality: Causality) -> list[str]:
        """Names of the real scalars of a causality, in order."""
        return [
            slot
            for variable in self.variables
            if variable.causality == causality and variable.type == "Float64"
            for slot in variable.slots
        ]


MODELS = {
    model.name: model
    for model in (
        Model("ar_drone", ar_drone_interface.VARIABLES, ar_drone_interface.STATES, ar_drone.BODY, FreeBody),
        Model("strider", strider_interface.VARIABLES, strider_interface.STATES, strider.BODY, PlanarChain, is_vessel=True),
    )
}
