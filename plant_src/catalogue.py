"""Vehicle models, and the catalogue of those that are shipped.

The catalogue has the vehicles of the files in `vehicles/data/`, and the vessels with equations of
their own.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from cosim.core.component import Causality, Variable
from cosim.core.errors import InputError, Problem, did_you_mean
from cosim.core.json_values import JsonObject
from cosim.export.equations.exported_interface import describe_variables

from .json_reader import argument_problem as warning
from .vehicles.common.interface import ENVIRONMENT_INPUTS
from .vehicles.common.shapes import Body, Vector, inertia_of
from .vehicles.common.vehicle_reader import VehicleData, read_visual
from .vehicles.data import FOLDER

if TYPE_CHECKING:
    from .vehicles.multirotor.airframe import Airframe, Rotor
    from .vehicles.submerged.craft import Craft, Thruster
    from .vehicles.vessel.actuators import Propeller
    from .vehicles.vessel.boat import Boat

_Value = TypeVar("_Value")

#: lists of a vehicle file whose elements may name a link of a URDF file in place of position and
#: axis
NAMED_LISTS = ("rotors", "thrusters", "propellers")

#: keys of a vehicle file of any family besides those of its family
COMMON_KEYS = ("family", "name", "description", "sources", "validity", "visual", "$schema")

#: largest extent of a vessel and of other vehicles (m); the longest ships have 460 m
MAX_EXTENT = {True: 500.0, False: 100.0}

#: vehicles that are given by a file, whose name is that of the vehicle
_FILES = {file.stem: file for file in sorted(FOLDER.glob("*.json"))}


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

    @property
    def box_corners(self) -> np.ndarray:
        """Corners of all boxes (m, body frame), shape (n, 3).

        Those of a vessel from O, else from the centre of mass.
        """
        corners: np.ndarray = np.concatenate([box.corners() for box in self.body.boxes])
        axis, w = np.array(self.body.axes[:3]), self.body.axes[3]
        corners = corners + 2 * np.cross(axis, w * corners + np.cross(axis, corners))
        if self.boat and self.motion == "planar":
            return corners + self.boat.centre_of_mass
        return corners

    def warnings(self) -> Iterator[Problem]:
        """Yield what is probably wrong in the data of the vehicle, mostly units.

        The vehicle can run nevertheless. The subject of a problem is "arguments" and the path in
        the vehicle file.
        """
        if not (self.airframe or self.craft or self.boat):
            return
        corners, centre = self.box_corners, self.boat.centre_of_mass if self.boat else 0.0
        reach = float(np.linalg.norm(corners - centre, axis=1).max())
        yield from self._size_warnings(reach)
        if self.airframe:
            yield from self.airframe.warnings(reach)
        elif vehicle := self.boat or self.craft:
            from .vehicles.vessel_plausibility import vessel_warnings  # imports all vessels

            yield from vessel_warnings(vehicle, corners, self.visual, MAX_EXTENT[True])

    def _size_warnings(self, reach: float) -> Iterator[Problem]:
        if reach > (limit := MAX_EXTENT[self.is_vessel]) / 2:
            yield warning(
                (
                    f"a corner is {reach:.4g} m from the centre of mass, expected less than "
                    f"{limit / 2:g} m"
                ),
                "boxes",
            )
        farthest = max(reach, *(float(np.linalg.norm(part.position)) for part in self._actuators))
        radius = math.sqrt(max(self.body.inertia) / self.body.mass)
        if radius > farthest:
            key = "yaw_inertia" if self.motion == "planar" else "inertia"
            text = (
                f"the radius of gyration, the square root of inertia over mass, is {radius:.3g} m, "
                "but the farthest point of "
                f"the vehicle is {farthest:.3g} m from the centre of mass"
            )
            yield warning(text, key)

    @property
    def _actuators(self) -> Sequence[Rotor | Thruster | Propeller]:
        if self.airframe:
            return self.airframe.rotors
        if self.craft:
            return self.craft.thrusters
        return self.boat.propellers if self.boat else ()

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


def _model(
    name: str,
    family: str,
    vehicle: VehicleData[Any],
    module: ModuleType,
    slots: int | tuple[int, int],
    **kind: Any,
) -> Model:
    """Return the model of a vehicle that is given by data.

    Args:
        name: Name of the vehicle.
        family: Family of equations, the name of their FMU.
        vehicle: Its data.
        module: Module with the variables and states of the family.
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
        module.variables(vehicle.vehicle),
        module.states(slots if isinstance(slots, int) else slots[0]),
        vehicle.body(),
        vehicle.crash_speed,
        body_of=body_of,
        equations=family,
        layout=module.variables(vehicle.vehicle, slots),
        **kind,
    )


# Builders import the modules of their vehicles themselves: a run needs few of them.


def _multirotor(name: str, data: JsonObject) -> Model:
    from .vehicles.multirotor import airframe

    given = airframe.MultirotorReader().read(name, data, COMMON_KEYS)
    slots = airframe.MAX_ROTORS
    return _model(name, "multirotor", given, airframe, slots, airframe=given.vehicle)


def _submerged(name: str, data: JsonObject) -> Model:
    from .vehicles.submerged import craft

    given = craft.SubmergedReader().read(name, data, COMMON_KEYS)
    return _model(name, "submerged", given, craft, craft.MAX_THRUSTERS, craft=given.vehicle)


def _surface_vessel(name: str, data: JsonObject) -> Model:
    from .vehicles.surface_vessel import surface_vessel
    from .vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS

    given = surface_vessel.SurfaceVesselReader().read(name, data, COMMON_KEYS)
    slots = (MAX_PROPELLERS, MAX_RUDDERS)
    kind = {"is_vessel": True, "boat": given.vehicle}
    return _model(name, "surface_vessel", given, surface_vessel, slots, **kind)


def _planar_vessel(name: str, data: JsonObject) -> Model:
    from .vehicles.planar_vessel import planar_vessel
    from .vehicles.vessel.actuators import MAX_PROPELLERS, MAX_RUDDERS

    given = planar_vessel.PlanarVesselReader().read(name, data, COMMON_KEYS)
    slots = (MAX_PROPELLERS, MAX_RUDDERS)
    kind = {"is_vessel": True, "motion": "planar", "boat": given.vehicle}
    return _model(name, "planar_vessel", given, planar_vessel, slots, **kind)


#: family of equations -> function from name and data to the model, which raises InputError with all
#: problems of the data
FAMILIES = {
    "multirotor": _multirotor,
    "submerged": _submerged,
    "surface_vessel": _surface_vessel,
    "planar_vessel": _planar_vessel,
}


def model_from_data(data: JsonObject, name: str = "") -> Model:
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


def _named_links(data: JsonObject) -> Iterator[Problem]:
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
