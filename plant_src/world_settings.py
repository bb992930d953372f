"""Reading the arguments of a world: JSON -> what to place where. All problems are reported together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import InputError, did_you_mean

from .catalogue import VEHICLE_MODELS
from .environment import CALM, Sea, realise_sea, settings
from .environment.settings import EnvironmentSettings
from .json_reader import JsonPath, JsonReader, Numbers
from .placement import Platform, VehiclePlacement
from .vehicles.common.shapes import Body
from .vehicles.model import Model

#: prefix of the parameters that hold the waves, and of those that say where a vehicle starts
WAVE_PREFIX, INITIAL_PREFIX = "wave.", "initial."


@dataclass(frozen=True)
class WorldSettings:
    """What a world consists of."""

    vehicles: Sequence[VehiclePlacement]
    platforms: Sequence[Platform]
    environment: EnvironmentSettings
    sea: Sea


def read_world_settings(vehicles: Any, platforms: Any, environment: Any) -> WorldSettings:
    """Read the three sections. Raises InputError with all problems; their subject is the path of the setting."""
    reader = _WorldSettingsReader()
    spawns = [reader.read_vehicle(name, spec) for name, spec in reader.read_named_objects(vehicles, ("vehicles",)).items()]
    boxes = [reader.read_platform(name, spec) for name, spec in reader.read_named_objects(platforms, ("platforms",)).items()]
    surrounding = settings.read_environment(reader, environment)
    if vehicles == {}:
        reader.add_problem(("vehicles",), "found no vehicle, expected at least one")
    if reader.problems:
        raise InputError(reader.problems)
    sea = realise_sea(surrounding.waves, surrounding.seed) if surrounding.waves else CALM
    return WorldSettings([_with_waves(sea, spawn) for spawn in spawns if spawn], boxes, surrounding, sea)


class _WorldSettingsReader(JsonReader):
    def read_vehicle(self, name: str, spec: Any) -> VehiclePlacement | None:
        path = ("vehicles", name)
        spec = self.read_object(spec, path, ("model", "position"), ("motion", "yaw", "velocity_body", "rates", "parameters"))
        model = self.find_model(spec, path)
        if model is None:
            return None
        axes = [slot.rpartition(".")[2] for slot in model.slots("parameter") if slot.startswith(f"{INITIAL_PREFIX}position.")]
        values = {"yaw": self.number(spec.get("yaw", 0.0), (*path, "yaw"))}
        for key, letters in (("position", axes), ("velocity_body", "uvw"), ("rates", "pqr")):
            vector = self.vector(spec.get(key, [0.0] * len(letters)), (*path, key), letters)
            values |= {f"{key}.{letter}": value for letter, value in zip(letters, vector, strict=True)}
        initial = {f"{INITIAL_PREFIX}{key}": value for key, value in values.items()}
        for slot, value in initial.items():
            if value and slot not in model.slots("parameter"):
                key = slot.removeprefix(INITIAL_PREFIX)
                self.add_problem((*path, key.partition(".")[0]), f"found {key} = {value}; a {model.name} does not move that way")
        found = len(self.problems)
        given = self.read_parameters(model, initial, spec.get("parameters", {}), (*path, "parameters"))
        starts = zip(model.slots("parameter"), model.start_values("parameter"), strict=True)
        parameters = {slot: (initial | given).get(slot, start) for slot, start in starts}
        sound = len(self.problems) == found
        body = self.collision_body(model, parameters, (*path, "parameters")) if sound else model.body
        return VehiclePlacement(name, model, tuple(parameters.values()), body)

    def collision_body(self, model: Model, parameters: Mapping[str, float], path: JsonPath) -> Body:
        try:
            return model.body_with(parameters)
        except InputError as error:
            for problem in error.problems:
                group, _, text = problem.message.partition(": ")
                first = next(slot for slot in parameters if slot.partition(".")[0] == group)
                self.add_problem((*path, first), text)
        return model.body

    def find_model(self, spec: Mapping[str, Any], path: JsonPath) -> Model | None:
        name, path = spec.get("model"), (*path, "model")
        if isinstance(name, str) and name not in VEHICLE_MODELS:
            self.add_problem(path, f'unknown vehicle model "{name}"{did_you_mean(name, VEHICLE_MODELS)}')
        elif name is not None and not isinstance(name, str):
            self.add_problem(path, f"found {name!r}, expected the name of a vehicle model: {', '.join(VEHICLE_MODELS)}")
        motions = VEHICLE_MODELS.get(name) if isinstance(name, str) else None
        if not motions:
            return None
        return motions[self.choice(spec.get("motion", next(iter(motions))), (*path[:-1], "motion"), tuple(motions))]

    def read_parameters(self, model: Model, placed: Mapping[str, float], spec: Any, path: JsonPath) -> dict[str, float]:
        """Values of the given parameters by slots; not those that the other keys or the environment set."""
        free = {
            v.name: v for v in model.real_variables("parameter") if v.name not in placed and not v.name.startswith(WAVE_PREFIX)
        }
        values: dict[str, float] = {}
        for name, value in self.mapping(spec, path).items():
            if name in free:
                values |= zip(free[name].scalar_names, self.read_values(free[name], value, (*path, name)), strict=True)
            else:
                hint = did_you_mean(name, free) if free else "; it has none"
                self.add_problem((*path, name), f'{model.name} has no parameter "{name}" to set{hint}')
        return values

    def read_values(self, variable: Variable, value: Any, path: JsonPath) -> Numbers:
        """A number, or a list of numbers for an array, in the range of the variable."""
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
        path = ("platforms", name)
        spec = self.read_object(spec, path, ("size", "position"), ())
        size = self.vector(spec.get("size", [1.0] * 3), (*path, "size"), "xyz")
        if not all(edge > 0 for edge in size):
            self.add_problem((*path, "size"), f"found {list(size)}, expected edges greater than 0")
        return Platform(name, size, self.vector(spec.get("position", [0.0] * 3), (*path, "position"), "xyz"))


def _with_waves(sea: Sea, spawn: VehiclePlacement) -> VehiclePlacement:
    """The vehicle with the waves in its parameters, if it has such."""
    parameters = dict(zip(spawn.model.slots("parameter"), spawn.parameters, strict=True))
    if f"{WAVE_PREFIX}count" not in parameters:
        return spawn
    parameters[f"{WAVE_PREFIX}count"] = float(len(sea.amplitude))
    for name in ("amplitude", "frequency", "direction", "phase"):
        parameters |= {f"{WAVE_PREFIX}{name}[{k}]": value for k, value in enumerate(getattr(sea, name).tolist(), start=1)}
    return replace(spawn, parameters=tuple(parameters.values()))
