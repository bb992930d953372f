"""Reader of a world's arguments: JSON to vehicles, platforms and environment.

All problems are reported together.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import InputError, Problem, did_you_mean

from .catalogue import Model, models_of
from .environment import settings
from .environment.sea import Sea
from .environment.settings import EnvironmentSettings
from .json_reader import JsonPath, JsonReader, Numbers
from .placement import (
    ContactSurface,
    Obstacle,
    Platform,
    VehiclePlacement,
    read_obstacles,
    read_surface,
)
from .vehicles.common.shapes import Body

#: prefixes of the parameters of waves and of the initial state
WAVE_PREFIX, INITIAL_PREFIX = "wave.", "initial."

#: keys of a vehicle besides "model" and "position"
OPTIONAL_KEYS = (
    "motion",
    "hull",
    "yaw",
    "velocity_body",
    "rates",
    "parameters",
    "crash_speed",
    *ContactSurface._fields,
)


@dataclass(frozen=True)
class WorldSettings:
    """Vehicles, platforms and environment of a world, and the realisation of its waves."""

    vehicles: Sequence[VehiclePlacement]
    platforms: Sequence[Platform]
    obstacles: Sequence[Obstacle]
    environment: EnvironmentSettings
    sea: Sea

    @property
    def body_count(self) -> int:
        """Number of bodies in Bullet."""
        fixed = len(self.platforms) + sum(
            len(mesh.parts) if mesh.is_convex else 1 for mesh in self.obstacles
        )
        return len(self.vehicles) + fixed


def read_world_settings(
    vehicles: Any, platforms: Any, environment: Any, obstacles: Any
) -> WorldSettings:
    """Read the arguments of a world.

    Args:
        vehicles: JSON object, name to vehicle.
        platforms: JSON object, name to platform.
        environment: JSON object, see `environment/settings.py`.
        obstacles: JSON object, name to obstacle, see `placement.py`.

    Raises:
        InputError: With all problems; the subject of each is the path of the setting in the
            component.
    """
    reader = _WorldSettingsReader()
    placements = [
        reader.read_vehicle(name, spec)
        for name, spec in reader.read_named_objects(vehicles, ("vehicles",)).items()
    ]
    boxes = [
        reader.read_platform(name, spec)
        for name, spec in reader.read_named_objects(platforms, ("platforms",)).items()
    ]
    meshes = read_obstacles(obstacles, reader)
    environment_settings = settings.read_environment(reader, environment)
    if vehicles == {}:
        reader.add_problem(("vehicles",), "found no vehicle, expected at least one")
    if reader.problems:
        raise InputError(reader.problems)
    sea = environment_settings.sea()
    afloat = [_with_waves(sea, vehicle) for vehicle in placements if vehicle]
    return WorldSettings(afloat, boxes, meshes, environment_settings, sea)


class _WorldSettingsReader(JsonReader):
    def read_vehicle(self, name: str, spec: Any) -> VehiclePlacement | None:
        """Read one vehicle; return None if its model is unknown."""
        path = ("vehicles", name)
        spec = self.read_object(spec, path, ("model", "position"), OPTIONAL_KEYS)
        model = self.find_model(spec, path)
        if model is None:
            return None
        initial = self.read_initial_state(model, spec, path)
        problem_count = len(self.problems)
        given = self.read_hull(model, spec, path)
        given |= self.read_parameters(
            model, initial, spec.get("parameters", {}), (*path, "parameters")
        )
        starts = zip(model.slots("parameter"), model.start_values("parameter"), strict=True)
        parameters = {slot: (initial | given).get(slot, start) for slot, start in starts}
        valid = len(self.problems) == problem_count
        body = (
            self.collision_body(model, parameters, (*path, "parameters")) if valid else model.body
        )
        crash_speed = self.number(
            spec.get("crash_speed", model.crash_speed), (*path, "crash_speed"), 0.0
        )
        return VehiclePlacement(
            name, model, parameters, body, crash_speed, read_surface(self, spec, path)
        )

    def read_hull(self, model: Model, spec: Mapping[str, Any], path: JsonPath) -> dict[str, float]:
        """Return the parameters of the hull named by "hull"; none for the default hull."""
        if "hull" not in spec:
            return {}
        if not model.hulls:
            self.add_problem(
                (*path, "hull"),
                f"found {spec['hull']!r}; {model.name} has one hull only, remove the key",
            )
            return {}
        return dict(model.hulls[self.choice(spec["hull"], (*path, "hull"), tuple(model.hulls))])

    def read_initial_state(
        self, model: Model, spec: Mapping[str, Any], path: JsonPath
    ) -> dict[str, float]:
        """Read position, yaw, velocity and rates; return the parameters `initial.*`."""
        slots = model.slots("parameter")
        axes = [
            slot.rpartition(".")[2]
            for slot in slots
            if slot.startswith(f"{INITIAL_PREFIX}position.")
        ]
        values = {"yaw": self.number(spec.get("yaw", 0.0), (*path, "yaw"))}
        for key, letters in (("position", axes), ("velocity_body", "uvw"), ("rates", "pqr")):
            vector = self.vector(spec.get(key, [0.0] * len(letters)), (*path, key), letters)
            values |= {
                f"{key}.{letter}": value for letter, value in zip(letters, vector, strict=True)
            }
        for key, value in values.items():
            if value and f"{INITIAL_PREFIX}{key}" not in slots:
                self.add_problem(
                    (*path, key.partition(".")[0]),
                    f"found {key} = {value}; a {model.name} does not move that way",
                )
        return {f"{INITIAL_PREFIX}{key}": value for key, value in values.items()}

    def collision_body(self, model: Model, parameters: Mapping[str, float], path: JsonPath) -> Body:
        """Return the body with these parameters.

        A problem is reported at the first parameter of its subject.
        """
        try:
            return model.body_with(parameters)
        except InputError as error:
            for problem in error.problems:
                first = next(
                    slot for slot in parameters if slot.partition(".")[0] == problem.subject[0]
                )
                self.add_problem((*path, first), problem.message)
        return model.body

    def find_model(self, spec: Mapping[str, Any], path: JsonPath) -> Model | None:
        """Return the model with the name or data and the motion of `spec`, or None."""
        if "model" not in spec:
            return None
        try:
            motions = models_of(spec["model"])
        except InputError as error:
            for problem in error.problems:
                self.add_problem((*path, "model", *problem.subject[1:]), problem.message)
            return None
        return motions[
            self.choice(spec.get("motion", next(iter(motions))), (*path, "motion"), tuple(motions))
        ]

    def read_parameters(
        self, model: Model, initial: Mapping[str, float], spec: Any, path: JsonPath
    ) -> dict[str, float]:
        """Read the object "parameters"; return values of scalar parameters by name.

        Parameters of the initial state and of the waves are refused: other keys set them.
        """
        free = {
            v.name: v
            for v in model.real_variables("parameter")
            if v.name not in initial and not v.name.startswith(WAVE_PREFIX)
        }
        values: dict[str, float] = {}
        for name, value in self.mapping(spec, path).items():
            if name in free:
                values |= zip(
                    free[name].scalar_names,
                    self.read_values(free[name], value, (*path, name)),
                    strict=True,
                )
            else:
                hint = did_you_mean(name, free) if free else "; it has none"
                self.add_problem(
                    (*path, name), f'{model.name} has no parameter "{name}" to set{hint}'
                )
        return values

    def read_values(self, variable: Variable, value: Any, path: JsonPath) -> Numbers:
        """Read a number, or a list of numbers for an array, within the range of `variable`."""
        count = len(variable.scalar_names)
        if not variable.shape:
            value = [value]
        elif not isinstance(value, list | tuple) or len(value) != count:
            self.add_problem(path, f"found {value!r}, expected a list of {count} numbers")
            value = [1.0] * count
        low = -np.inf if variable.minimum is None else variable.minimum
        high = np.inf if variable.maximum is None else variable.maximum
        return tuple(self.number(number, path, low, high) for number in value)

    def read_platform(self, name: str, spec: Any) -> Platform:
        """Read one platform."""
        path = ("platforms", name)
        spec = self.read_object(spec, path, ("size", "position"), ContactSurface._fields)
        size = self.vector(spec.get("size", [1.0] * 3), (*path, "size"), "xyz")
        if not all(edge > 0 for edge in size):
            self.add_problem((*path, "size"), f"found {list(size)}, expected edges greater than 0")
        position = self.vector(spec.get("position", [0.0] * 3), (*path, "position"), "xyz")
        return Platform(name, size, position, read_surface(self, spec, path))


def _with_waves(sea: Sea, vehicle: VehiclePlacement) -> VehiclePlacement:
    """Return the vehicle with its wave parameters set, if its model has any."""
    if f"{WAVE_PREFIX}count" not in vehicle.parameters:
        return vehicle
    waves = {f"{WAVE_PREFIX}count": float(len(sea.amplitude))}
    for name in ("amplitude", "frequency", "direction", "phase"):
        for k, value in enumerate(getattr(sea, name).tolist(), start=1):
            waves[f"{WAVE_PREFIX}{name}[{k}]"] = value
    return replace(vehicle, parameters={**vehicle.parameters, **waves})


def placement_warnings(vehicle: VehiclePlacement) -> Iterator[Problem]:
    """Yield a warning for each value of a vehicle in a world that is probably wrong.

    The subject is its path in the component.
    """
    path = ("arguments", "vehicles", vehicle.name)
    for each in vehicle.model.warnings():
        yield replace(each, subject=(*path, "model", *each.subject[1:]))
    if abs(yaw := vehicle.parameters["initial.yaw"]) > 2 * math.pi:
        yield Problem(
            f"found {yaw:g}, radians expected; in degrees? A right angle is 1.5708",
            subject=(*path, "yaw"),
        )
