"""Catalogue of the vehicle models."""

from __future__ import annotations

from .vehicles.ar_drone import geometry as ar_drone
from .vehicles.ar_drone.parameters import AIRFRAME as AR_DRONE
from .vehicles.common.interface import VESSEL_STATES
from .vehicles.crazyflie import geometry as crazyflie
from .vehicles.crazyflie.parameters import AIRFRAME as CRAZYFLIE
from .vehicles.model import Boxes, Model
from .vehicles.multirotor import interface as multirotor_interface
from .vehicles.multirotor.airframe import Airframe
from .vehicles.otter import geometry as otter
from .vehicles.otter import interface as otter_interface
from .vehicles.strider import geometry as strider
from .vehicles.strider import interface as strider_interface
from .vehicles.strider_6dof import geometry as strider_6dof
from .vehicles.strider_6dof import interface as strider_6dof_interface
from .vehicles.survey_hexacopter import geometry as survey_hexacopter
from .vehicles.survey_hexacopter.parameters import AIRFRAME as SURVEY_HEXACOPTER


def _multirotor(airframe: Airframe, boxes: Boxes) -> Model:
    variables, states = multirotor_interface.variables(airframe), multirotor_interface.states(airframe)
    constants = multirotor_interface.constant_count(airframe)
    return Model(airframe.name, variables, states, airframe.body(boxes), constant_count=constants, airframe=airframe, boxes=boxes)


#: name -> model
MODELS = {
    model.name: model
    for model in (
        _multirotor(AR_DRONE, ar_drone.boxes),
        _multirotor(CRAZYFLIE, crazyflie.boxes),
        _multirotor(SURVEY_HEXACOPTER, survey_hexacopter.boxes),
        Model("strider", strider_interface.VARIABLES, strider_interface.STATES, strider.BODY, is_vessel=True, motion="planar"),
        Model(
            "strider_6dof",
            strider_6dof_interface.VARIABLES,
            VESSEL_STATES,
            strider_6dof.BODY,
            is_vessel=True,
            vehicle="strider",
            constant_count=strider_6dof_interface.CONSTANT_COUNT,
        ),
        Model(
            "otter",
            otter_interface.VARIABLES,
            (*VESSEL_STATES, *otter_interface.PROPELLER_STATES),
            otter.BODY,
            is_vessel=True,
            constant_count=otter_interface.CONSTANT_COUNT,
        ),
    )
}

#: vehicle -> motion -> model; the first motion is the default
VEHICLE_MODELS: dict[str, dict[str, Model]] = {}
for _model in MODELS.values():
    VEHICLE_MODELS.setdefault(_model.vehicle or _model.name, {})[_model.motion] = _model
