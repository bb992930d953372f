"""Catalogue of the vehicle models.

Those of the files in `vehicles/data/`, and the vessels with equations of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

from cosim.core.errors import InputError, Problem, did_you_mean

from .vehicles.common.interface import PLANAR_STATES, VESSEL_STATES
from .vehicles.common.shapes import inertia_of
from .vehicles.common.vehicle_reader import read_visual
from .vehicles.data import read_vehicle_files
from .vehicles.model import Model
from .vehicles.multirotor import interface as multirotor_interface
from .vehicles.multirotor.airframe import MAX_ROTORS, MultirotorReader
from .vehicles.otter import interface as otter_interface
from .vehicles.otter import parameters as otter
from .vehicles.otter import parameters as otter_parameters
from .vehicles.planar_vessel import interface as planar_vessel_interface
from .vehicles.planar_vessel.planar_vessel import PlanarVesselReader
from .vehicles.strider import interface as strider_interface
from .vehicles.strider import parameters as strider
from .vehicles.strider import parameters as strider_parameters
from .vehicles.strider_6dof import interface as strider_6dof_interface
from .vehicles.strider_6dof import parameters as strider_6dof
from .vehicles.submerged import interface as submerged_interface
from .vehicles.submerged.craft import MAX_THRUSTERS, SubmergedReader
from .vehicles.surface_vessel import interface as surface_vessel_interface
from .vehicles.surface_vessel.surface_vessel import SurfaceVesselReader
from .vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS

#: lists of a vehicle file whose elements may name a link of a URDF file in place of position and
#: axis
NAMED_LISTS = ("rotors", "thrusters", "propellers")

#: keys of a vehicle file of any family besides those of its family
COMMON_KEYS = ("family", "name", "description", "sources", "validity", "visual", "$schema")

#: numbers of elements of the arrays of propellers and rudders in the compiled equations of vessels
SLOTS = (MAX_PROPELLERS, MAX_RUDDERS)


def multirotor_model(name: str, data: Mapping[str, Any]) -> Model:
    """Return the model of a multirotor. Raises InputError with all problems of its data."""
    vehicle = MultirotorReader().read(name, data, COMMON_KEYS)
    airframe = vehicle.vehicle
    return Model(
        name,
        multirotor_interface.variables(airframe),
        multirotor_interface.states(MAX_ROTORS),
        vehicle.body(),
        vehicle.crash_speed,
        airframe=airframe,
        body_of=lambda given: vehicle.body(mass=given["mass"], inertia=inertia_of(given)),
        equations="multirotor",
        layout=multirotor_interface.variables(airframe, MAX_ROTORS),
    )


def submerged_model(name: str, data: Mapping[str, Any]) -> Model:
    """Return the model of a submerged vehicle. Raises InputError with all problems of its data."""
    vehicle = SubmergedReader().read(name, data, COMMON_KEYS)
    craft = vehicle.vehicle
    return Model(
        name,
        submerged_interface.variables(craft),
        submerged_interface.states(MAX_THRUSTERS),
        vehicle.body(),
        vehicle.crash_speed,
        craft=craft,
        body_of=lambda given: vehicle.body(mass=given["mass"], inertia=inertia_of(given)),
        equations="submerged",
        layout=submerged_interface.variables(craft, MAX_THRUSTERS),
    )


def surface_vessel_model(name: str, data: Mapping[str, Any]) -> Model:
    """Return the model of a floating vessel. Raises InputError with all problems of its data."""
    vehicle = SurfaceVesselReader().read(name, data, COMMON_KEYS)
    vessel = vehicle.vehicle
    return Model(
        name,
        surface_vessel_interface.variables(vessel),
        surface_vessel_interface.states(MAX_PROPELLERS),
        vehicle.body(),
        vehicle.crash_speed,
        is_vessel=True,
        boat=vessel,
        body_of=lambda given: vehicle.body(mass=given["mass"], inertia=inertia_of(given)),
        equations="surface_vessel",
        layout=surface_vessel_interface.variables(vessel, SLOTS),
    )


def planar_vessel_model(name: str, data: Mapping[str, Any]) -> Model:
    """Return the model of a planar vessel. Raises InputError with all problems of its data."""
    vehicle = PlanarVesselReader().read(name, data, COMMON_KEYS)
    vessel = vehicle.vehicle
    return Model(
        name,
        planar_vessel_interface.variables(vessel),
        planar_vessel_interface.states(MAX_PROPELLERS),
        vehicle.body(),
        vehicle.crash_speed,
        is_vessel=True,
        motion="planar",
        boat=vessel,
        body_of=lambda given: vehicle.body(mass=given["mass"], yaw_inertia=given["yaw_inertia"]),
        equations="planar_vessel",
        layout=planar_vessel_interface.variables(vessel, SLOTS),
    )


#: family of equations -> function from name and data to the model
FAMILIES = {
    "multirotor": multirotor_model,
    "submerged": submerged_model,
    "surface_vessel": surface_vessel_model,
    "planar_vessel": planar_vessel_model,
}


def model_from_data(data: Mapping[str, Any], name: str = "") -> Model:
    """Return the model of a vehicle that is given by its data.

    Args:
        data: JSON object (`vehicles/README.md`).
        name: Name of the vehicle, if the data have none.

    Raises:
        InputError: With all problems; the subject of each begins with "arguments" and continues
            with the path in the data.
    """
    if link := next(_named_links(data), None):
        raise InputError(link)
    family = data.get("family")
    if family not in FAMILIES:
        hint = (
            did_you_mean(family, FAMILIES)
            if isinstance(family, str)
            else f", expected one of: {', '.join(FAMILIES)}"
        )
        found = f"found {family!r}" if "family" in data else '"family" is missing'
        raise InputError([Problem(f"{found}{hint}", "family", ("arguments", "family"))])
    return replace(FAMILIES[family](str(data.get("name", name)), data), visual=read_visual(data))


def _named_links(data: Mapping[str, Any]) -> Iterator[Problem]:
    """Yield a problem for each rotor, thruster or propeller whose place is a link of a URDF file."""
    for key in NAMED_LISTS:
        for i, element in enumerate(found if isinstance(found := data.get(key), list) else []):
            if isinstance(element, Mapping) and "link" in element:
                text = (
                    f"found the link {element['link']!r}: `cosim new vehicle --urdf FILE` replaces "
                    "it by position and axis"
                )
                yield Problem(text, f"{key}.{i}.link", ("arguments", key, str(i), "link"))


#: name -> model
MODELS = {
    model.name: model
    for model in (
        *(model_from_data(data, name) for name, data in read_vehicle_files()),
        Model(
            "strider",
            strider_interface.VARIABLES,
            PLANAR_STATES,
            strider.BODY,
            strider_parameters.CRASH_SPEED,
            is_vessel=True,
            motion="planar",
            hulls=strider_interface.HULLS,
        ),
        Model(
            "strider_6dof",
            strider_6dof_interface.VARIABLES,
            VESSEL_STATES,
            strider_6dof.BODY,
            strider_parameters.CRASH_SPEED,
            is_vessel=True,
            vehicle="strider",
            hulls=strider_interface.HULLS,
        ),
        Model(
            "otter",
            otter_interface.VARIABLES,
            (*VESSEL_STATES, *otter_interface.PROPELLER_STATES),
            otter.BODY,
            otter_parameters.CRASH_SPEED,
            is_vessel=True,
        ),
        Model(
            "otter_mss",
            otter_interface.VARIABLES,
            (*VESSEL_STATES, *otter_interface.PROPELLER_STATES),
            otter.BODY,
            otter_parameters.CRASH_SPEED,
            is_vessel=True,
        ),
    )
}

#: vehicle -> motion -> model; the first motion is the default
VEHICLE_MODELS: dict[str, dict[str, Model]] = {}
for _model in MODELS.values():
    VEHICLE_MODELS.setdefault(_model.vehicle or _model.name, {})[_model.motion] = _model


def models_of(vehicle: Any) -> Mapping[str, Model]:
    """Return the models of a vehicle by their motion, as motion to model.

    The first motion is the default.

    Args:
        vehicle: Name of a vehicle of the catalogue, or its data.

    Raises:
        InputError: If there is no such vehicle, or its data are wrong.
    """
    if isinstance(vehicle, Mapping):
        model = model_from_data(vehicle, "vehicle")
        return {model.motion: model}
    if not isinstance(vehicle, str):
        text = (
            f"found {vehicle!r}, expected the name of a vehicle model, or its data: "
            f"{', '.join(VEHICLE_MODELS)}"
        )
        raise InputError([Problem(text, "", ("arguments",))])
    if vehicle not in VEHICLE_MODELS:
        raise InputError(
            [
                Problem(
                    f'unknown vehicle model "{vehicle}"{did_you_mean(vehicle, VEHICLE_MODELS)}',
                    "",
                    ("arguments",),
                )
            ]
        )
    return VEHICLE_MODELS[vehicle]


def default_model(vehicle: Any) -> Model:
    """Return the model of a vehicle with its first motion, see `models_of`."""
    return next(iter(models_of(vehicle).values()))
