"""Reading the arguments of a world: JSON -> what to place where. All problems are reported together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cosim.core.component import Variable
from cosim.core.errors import InputError, did_you_mean

from .catalogue import VEHICLES
from .environment import CALM, Sea, realise, settings
from .environment.settings import Environment
from .json_reader import Keys, Numbers, Reader
from .placement import Platform, Spawn
from .vehicles.common.shapes import Body
from .vehicles.model import Model

#: prefix of the parameters that hold the waves, and of those that say where a vehicle starts
WAVE, INITIAL = "wave.", "initial."


@dataclass(frozen=True)
class Arguments:
    """What a world consists of."""

    vehicles: Sequence[Spawn]
    platforms: Sequence[Platform]
    environment: Environment
    sea: Sea


def read(vehicles: Any, platforms: Any, environment: Any) -> Arguments:
    """Read the three sections. Raises InputError with all problems; their subject is the path of the setting."""
    reader = _Reader()
    spawns = [reader.vehicle(name, spec) for name, spec in reader.named(vehicles, ("vehicles",)).items()]
    boxes = [reader.platform(name, spec) for name, spec in reader.named(platforms, ("platforms",)).items()]
    surrounding = settings.read(reader, environment)
    if vehicles == {}:
        reader.complain(("vehicles",), "found no vehicle, expected at least one")
    if reader.problems:
        raise InputError(reader.problems)
    sea = realise(surrounding.waves, surrounding.seed) if surrounding.waves else CALM
    return Arguments([_in(sea, spawn) for spawn in spawns if spawn], boxes, surrounding, sea)


class _Reader(Reader):
    def vehicle(self, name: str, spec: Any) -> Spawn | None:
        path = ("vehicles", name)
        spec = self.keys(spec, path, ("model", "position"), ("motion", "yaw", "velocity_body", "rates", "parameters"))
        model = self.model(spec, path)
        if model is None:
            return None
        axes = [slot.rpartition(".")[2] for slot in model.slots("parameter") if slot.startswith(f"{INITIAL}position.")]
        values = {"yaw": self.number(spec.get("yaw", 0.0), (*path, "yaw"))}
        for key, letters in (("position", axes), ("velocity_body", "uvw"), ("rates", "pqr")):
            vector = self.vector(spec.get(key, [0.0] * len(letters)), (*path, key), letters)
            values |= {f"{key}.{letter}": value for letter, value in zip(letters, vector, strict=True)}
        initial = {f"{INITIAL}{key}": value for key, value in values.items()}
        for slot, value in initial.items():
            if value and slot not in model.slots("parameter"):
                key = slot.removeprefix(INITIAL)
                self.complain((*path, key.partition(".")[0]), f"found {key} = {value}; a {model.name} does not move that way")
        found = len(self.problems)
        given = self.parameters(model, initial, spec.get("parameters", {}), (*path, "parameters"))
        starts = zip(model.slots("parameter"), model.starts("parameter"), strict=True)
        parameters = {slot: (initial | given).get(slot, start) for slot, start in starts}
        sound = len(self.problems) == found
        body = self.body(model, parameters, (*path, "parameters")) if sound else model.body
        return Spawn(name, model, tuple(parameters.values()), body)

    def body(self, model: Model, parameters: Mapping[str, float], path: Keys) -> Body:
        try:
            return model.body_with(parameters)
        except InputError as error:
            for problem in error.problems:
                group, _, text = problem.message.partition(": ")
                first = next(slot for slot in parameters if slot.partition(".")[0] == group)
                self.complain((*path, first), text)
        return model.body

    def model(self, spec: Mapping[str, Any], path: Keys) -> Model | None:
        name, path = spec.get("model"), (*path, "model")
        if isinstance(name, str) and name not in VEHICLES:
            self.complain(path, f'unknown vehicle model "{name}"{did_you_mean(name, VEHICLES)}')
        elif name is not None and not isinstance(name, str):
            self.complain(path, f"found {name!r}, expected the name of a vehicle model: {', '.join(VEHICLES)}")
        motions = VEHICLES.get(name) if isinstance(name, str) else None
        if not motions:
            return None
        return motions[self.choice(spec.get("motion", next(iter(motions))), (*path[:-1], "motion"), tuple(motions))]

    def parameters(self, model: Model, placed: Mapping[str, float], spec: Any, path: Keys) -> dict[str, float]:
        """Values of the given parameters by slots; not those that the other keys or the environment set."""
        free = {v.name: v for v in model.reals("parameter") if v.name not in placed and not v.name.startswith(WAVE)}
        values: dict[str, float] = {}
        for name, value in self.mapping(spec, path).items():
            if name in free:
                values |= zip(free[name].slots, self.values(free[name], value, (*path, name)), strict=True)
            else:
                hint = did_you_mean(name, free) if free else "; it has none"
                self.complain((*path, name), f'{model.name} has no parameter "{name}" to set{hint}')
        return values

    def values(self, variable: Variable, value: Any, path: Keys) -> Numbers:
        """A number, or a list of numbers for an array, in the range of the variable."""
        count = len(variable.slots)
        if not variable.shape:
            value = [value]
        elif not isinstance(value, list | tuple) or len(value) != count:
            self.complain(path, f"found {value!r}, expected a list of {count} numbers")
            value = [1.0] * count
        low = -np.inf if variable.minimum is None else variable.minimum
        high = np.inf if variable.maximum is None else variable.maximum
        return tuple(self.number(number, path, low, high) for number in value)

    def platform(self, name: str, spec: Any) -> Platform:
        path = ("platforms", name)
        spec = self.keys(spec, path, ("size", "position"), ())
        size = self.vector(spec.get("size", [1.0] * 3), (*path, "size"), "xyz")
        if not all(edge > 0 for edge in size):
            self.complain((*path, "size"), f"found {list(size)}, expected edges greater than 0")
        return Platform(name, size, self.vector(spec.get("position", [0.0] * 3), (*path, "position"), "xyz"))


def _in(sea: Sea, spawn: Spawn) -> Spawn:
    """The vehicle with the waves in its parameters, if it has such."""
    parameters = dict(zip(spawn.model.slots("parameter"), spawn.parameters, strict=True))
    if f"{WAVE}count" not in parameters:
        return spawn
    parameters[f"{WAVE}count"] = float(len(sea.amplitude))
    for name in ("amplitude", "frequency", "direction", "phase"):
        parameters |= {f"{WAVE}{name}[{k}]": value for k, value in enumerate(getattr(sea, name).tolist(), start=1)}
    return replace(spawn, parameters=tuple(parameters.values()))
