"""Catalogue of the vehicle models.

Those of the files in `vehicles/data/`, and the vessels with equations of their own.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from types import ModuleType
from typing import Any, TypeVar

from cosim.core.errors import InputError, Problem, did_you_mean

from .vehicles.common.shapes import Body, inertia_of
from .vehicles.common.vehicle_reader import VehicleData, read_visual
from .vehicles.data import FOLDER
from .vehicles.model import Model

_Value = TypeVar("_Value")

#: lists of a vehicle file whose elements may name a link of a URDF file in place of position and
#: axis
NAMED_LISTS = ("rotors", "thrusters", "propellers")

#: keys of a vehicle file of any family besides those of its family
COMMON_KEYS = ("family", "name", "description", "sources", "validity", "visual", "$schema")

#: vehicles that are given by a file, whose name is that of the vehicle
_FILES = {file.stem: file for file in sorted(FOLDER.glob("*.json"))}


def _model(
    name: str,
    family: str,
    vehicle: VehicleData[Any],
    interface: ModuleType,
    slots: int | tuple[int, int],
    **kind: Any,
) -> Model:
    """Return the model of a vehicle that is given by data.

    Args:
        name: Name of the vehicle.
        family: Family of equations, the name of their FMU.
        vehicle: Its data.
        interface: Module with the variables and states of the family.
        slots: Number of elements of the arrays of actuators in the compiled equations, or the
            numbers of propellers and rudders.
        **kind: Further arguments of the model.
    """

    def body_of(given: Mapping[str, float]) -> Body:
        if "yaw_inertia" in given:
            return vehicle.body(mass=given["mass"], yaw_inertia=given["yaw_inertia"])
        return vehicle.body(mass=given["mass"], inertia=inertia_of(given))

    return Model(
        name,
        interface.variables(vehicle.vehicle),
        interface.states(slots if isinstance(slots, int) else slots[0]),
        vehicle.body(),
        vehicle.crash_speed,
        body_of=body_of,
        equations=family,
        layout=interface.variables(vehicle.vehicle, slots),
        **kind,
    )


# Builders import the modules of their vehicles themselves: a run needs few of them.


def _multirotor(name: str, data: Mapping[str, Any]) -> Model:
    from .vehicles.multirotor import interface
    from .vehicles.multirotor.airframe import MAX_ROTORS, MultirotorReader

    given = MultirotorReader().read(name, data, COMMON_KEYS)
    return _model(name, "multirotor", given, interface, MAX_ROTORS, airframe=given.vehicle)


def _submerged(name: str, data: Mapping[str, Any]) -> Model:
    from .vehicles.submerged import interface
    from .vehicles.submerged.craft import MAX_THRUSTERS, SubmergedReader

    given = SubmergedReader().read(name, data, COMMON_KEYS)
    return _model(name, "submerged", given, interface, MAX_THRUSTERS, craft=given.vehicle)


def _surface_vessel(name: str, data: Mapping[str, Any]) -> Model:
    from .vehicles.surface_vessel import interface
    from .vehicles.surface_vessel.surface_vessel import SurfaceVesselReader
    from .vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS

    given, slots = (
        SurfaceVesselReader().read(name, data, COMMON_KEYS),
        (MAX_PROPELLERS, MAX_RUDDERS),
    )
    kind = {"is_vessel": True, "boat": given.vehicle}
    return _model(name, "surface_vessel", given, interface, slots, **kind)


def _planar_vessel(name: str, data: Mapping[str, Any]) -> Model:
    from .vehicles.planar_vessel import interface
    from .vehicles.planar_vessel.planar_vessel import PlanarVesselReader
    from .vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS

    given, slots = PlanarVesselReader().read(name, data, COMMON_KEYS), (MAX_PROPELLERS, MAX_RUDDERS)
    kind = {"is_vessel": True, "motion": "planar", "boat": given.vehicle}
    return _model(name, "planar_vessel", given, interface, slots, **kind)


#: family of equations -> function from name and data to the model, which raises InputError with all
#: problems of the data
FAMILIES = {
    "multirotor": _multirotor,
    "submerged": _submerged,
    "surface_vessel": _surface_vessel,
    "planar_vessel": _planar_vessel,
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
    """Yield a problem for each actuator whose place is a link of a URDF file."""
    for key in NAMED_LISTS:
        found = data.get(key)
        for i, element in enumerate(found if isinstance(found, list) else []):
            if isinstance(element, Mapping) and "link" in element:
                text = (
                    f"found the link {element['link']!r}: `cosim new vehicle --urdf FILE` replaces "
                    "it by position and axis"
                )
                yield Problem(text, f"{key}.{i}.link", ("arguments", key, str(i), "link"))


def _strider() -> Model:
    from .vehicles.common.interface import PLANAR_STATES
    from .vehicles.strider import interface, parameters

    return Model(
        "strider",
        interface.VARIABLES,
        PLANAR_STATES,
        parameters.BODY,
        parameters.CRASH_SPEED,
        is_vessel=True,
        motion="planar",
        hulls=interface.HULLS,
    )


def _strider_6dof() -> Model:
    from .vehicles.common.interface import VESSEL_STATES
    from .vehicles.strider.interface import HULLS
    from .vehicles.strider.parameters import CRASH_SPEED
    from .vehicles.strider_6dof import interface, parameters

    return Model(
        "strider_6dof",
        interface.VARIABLES,
        VESSEL_STATES,
        parameters.BODY,
        CRASH_SPEED,
        is_vessel=True,
        vehicle="strider",
        hulls=HULLS,
    )


def _otter(name: str) -> Model:
    from .vehicles.common.interface import VESSEL_STATES
    from .vehicles.otter import interface, parameters

    return Model(
        name,
        interface.VARIABLES,
        (*VESSEL_STATES, *interface.PROPELLER_STATES),
        parameters.BODY,
        parameters.CRASH_SPEED,
        is_vessel=True,
    )


def _model_of_file(name: str) -> Model:
    return model_from_data(json.loads(_FILES[name].read_text(encoding="utf-8")), name)


class _LazyMapping(Mapping[str, _Value]):
    """Values by name, each of which is made when it is first used, and kept.

    Args:
        makers: Function that makes each value.
    """

    def __init__(self, makers: Mapping[str, Callable[[], _Value]]):
        self._makers, self._made = makers, dict[str, _Value]()

    def __getitem__(self, name: str) -> _Value:
        if name not in self._made:
            self._made[name] = self._makers[name]()
        return self._made[name]

    def __contains__(self, name: object) -> bool:
        return name in self._makers

    def __iter__(self) -> Iterator[str]:
        return iter(self._makers)

    def __len__(self) -> int:
        return len(self._makers)


#: vessels with equations of their own
_OWN_EQUATIONS: Mapping[str, Callable[[], Model]] = {
    "strider": _strider,
    "strider_6dof": _strider_6dof,
    "otter": partial(_otter, "otter"),
    "otter_mss": partial(_otter, "otter_mss"),
}

#: names of the FMUs with the equations of all models
BINARIES = (*FAMILIES, *_OWN_EQUATIONS)

#: name -> model
MODELS: Mapping[str, Model] = _LazyMapping(
    {**{name: partial(_model_of_file, name) for name in _FILES}, **_OWN_EQUATIONS}
)


def _models_by_motion(*names: str) -> dict[str, Model]:
    return {MODELS[name].motion: MODELS[name] for name in names}


#: vehicle -> motion -> model; the first motion is the default
VEHICLE_MODELS: Mapping[str, dict[str, Model]] = _LazyMapping(
    {
        **{name: partial(_models_by_motion, name) for name in MODELS if name != "strider_6dof"},
        "strider": partial(_models_by_motion, "strider", "strider_6dof"),
    }
)


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
