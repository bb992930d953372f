"""Catalogue of the vehicle models."""

from __future__ import annotations

from .vehicles.ar_drone import geometry as ar_drone
from .vehicles.ar_drone import parameters as ar_drone_parameters
from .vehicles.common.interface import VESSEL_STATES
from .vehicles.crazyflie import geometry as crazyflie
from .vehicles.crazyflie import parameters as crazyflie_parameters
from .vehicles.model import Boxes, Model
from .vehicles.multirotor import interface as multirotor_interface
from .vehicles.multirotor.airframe import Airframe
from .vehicles.otter import geometry as otter
from .vehicles.otter import interface as otter_interface
from .vehicles.otter import parameters as otter_parameters
from .vehicles.strider import geometry as strider
from .vehicles.strider import interface as strider_interface
from .vehicles.strider import parameters as strider_parameters
from .vehicles.strider_6dof import geometry as strider_6dof
from .vehicles.strider_6dof import interface as strider_6dof_interface
from .vehicles.survey_hexacopter import geometry as survey_hexacopter
from .vehicles.survey_hexacopter import parameters as survey_hexacopter_parameters


def _multirotor(airframe: Airframe, boxes: Boxes, crash_speed: float) -> Model:
    variables, states = multirotor_interface.variables(airframe), multirotor_interface.states(airframe)
    constants = multirotor_interface.constant_count(airframe)
    body = airframe.body(boxes)
    return Model(airframe.name, variables, states, body, crash_speed, constant_count=constants, airframe=airframe, boxes=boxes)


#: name -> model
MODELS = {
    model.name: model
    for model in (
        _multirotor(ar_drone_parameters.AIRFRAME, ar_drone.boxes, ar_drone_parameters.CRASH_SPEED),
        _multirotor(crazyflie_parameters.AIRFRAME, crazyflie.boxes, crazyflie_parameters.CRASH_SPEED),
        _multirotor(survey_hexacopter_parameters.AIRFRAME, survey_hexacopter.boxes, survey_hexacopter_parameters.CRASH_SPEED),
        Model(
            "strider",
            strider_interface.VARIABLES,
            strider_interface.STATES,
            strider.BODY,
            strider_parameters.CRASH_SPEED,
            is_vessel=True,
            motion="planar",
        ),
        Model(
            "strider_6dof",
            strider_6dof_interface.VARIABLES,
            VESSEL_STATES,
            strider_6dof.BODY,
            strider_parameters.CRASH_SPEED,
            is_vessel=True,
            vehicle="strider",
            constant_count=strider_6dof_interface.CONSTANT_COUNT,
        ),
        Model(
            "otter",
            otter_interface.VARIABLES,
            (*VESSEL_STATES, *otter_interface.PROPELLER_STATES),
            otter.BODY,
            otter_parameters.CRASH_SPEED,
            is_vessel=True,
            constant_count=otter_interface.CONSTANT_COUNT,
        ),
    )
}

#: vehicle -> motion -> model; the first motion is the default
VEHICLE_MODELS: dict[str, dict[str, Model]] = {}
for _model in MODELS.values():
    VEHICLE_MODELS.setdefault(_model.vehicle or _model.name, {})[_model.motion] = _model
