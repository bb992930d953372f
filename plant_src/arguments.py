"""Reading the arguments of a world: JSON -> what to place where. All problems are reported together."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cosim.errors import InputError, Problem, did_you_mean

from .catalogue import MODELS, Model

Keys = tuple[str, ...]
Numbers = tuple[float, ...]


@dataclass(frozen=True)
class Spawn:
    """A vehicle to place: `initial` holds the values of its model's parameters `initial.*`."""

    name: str
    model: Model
    initial: Numbers


@dataclass(frozen=True)
class Platform:
    """A fixed box: edges and centre (m, world frame)."""

    name: str
    size: Numbers
    position: Numbers


@dataclass(frozen=True)
class Arguments:
    """What a world consists of."""

    vehicles: Sequence[Spawn]
    platforms: Sequence[Platform]


def read(vehicles: Any, platforms: Any, environment: Any) -> Arguments:
    """Read the three sections. Raises InputError with all problems; their subject is the path of the setting."""
    reader = _Reader()
    spawns = [reader.vehicle(name, spec) for name, spec in reader.named(vehicles, ("vehicles",)).items()]
    boxes = [reader.platform(name, spec) for name, spec in reader.named(platforms, ("platforms",)).items()]
    reader.environment(environment)
    if vehicles == {}:
        reader.complain(("vehicles",), "found no vehicle, expected at least one")
    if reader.problems:
        raise InputError(reader.problems)
    return Arguments([spawn for spawn in spawns if spawn], boxes)


class _Reader:
    """Collects problems while it reads; faulty values are replaced, so that reading goes on."""

    def __init__(self) -> None:
        self.problems: list[Problem] = []

    def complain(self, path: Keys, text: str) -> None:
        where = ".".join(path)
        self.problems.append(Problem(text, where, ("arguments", *path)))

    def vehicle(self, name: str, spec: Any) -> Spawn | None:
        path = ("vehicles", name)
        spec = self.keys(spec, path, ("model", "position"), ("yaw", "velocity_body", "rates"))
        model = self.model(spec.get("model"), (*path, "model"))
        if model is None:
            return None
        axes = [slot.rpartition(".")[2] for slot in model.slots("parameter") if slot.startswith("initial.position.")]
        values = {"yaw": self.number(spec.get("yaw", 0.0), (*path, "yaw"))}
        for key, letters in (("position", axes), ("velocity_body", "uvw"), ("rates", "pqr")):
            vector = self.vector(spec.get(key, [0.0] * len(letters)), (*path, key), letters)
            values |= {f"{key}.{letter}": value for letter, value in zip(letters, vector, strict=True)}
        initial = [values.pop(slot.removeprefix("initial.")) for slot in model.slots("parameter")]
        for key, value in values.items():
            if value:
                self.complain((*path, key.partition(".")[0]), f"found {key} = {value}; a {model.name} does not move that way")
        return Spawn(name, model, tuple(initial))

    def model(self, name: Any, path: Keys) -> Model | None:
        if isinstance(name, str) and name not in MODELS:
            self.complain(path, f'unknown vehicle model "{name}"{did_you_mean(name, MODELS)}')
        elif name is not None and not isinstance(name, str):
            self.complain(path, f"found {name!r}, expected the name of a vehicle model: {', '.join(MODELS)}")
        return MODELS.get(name) if isinstance(name, str) else None

    def platform(self, name: str, spec: Any) -> Platform:
        path = ("platforms", name)
        spec = self.keys(spec, path, ("size", "position"), ())
        size = self.vector(spec.get("size", [1.0] * 3), (*path, "size"), "xyz")
        if not all(edge > 0 for edge in size):
            self.complain((*path, "size"), f"found {list(size)}, expected edges greater than 0")
        return Platform(name, size, self.vector(spec.get("position", [0.0] * 3), (*path, "position"), "xyz"))

    def environment(self, spec: Any) -> None:
        seed = self.keys(spec, ("environment",), (), ("seed",)).get("seed", 0)
        if not isinstance(seed, int) or isinstance(seed, bool) or seed < 0:
            self.complain(("environment", "seed"), f"found {seed!r}, expected an integer of at least 0")

    def named(self, value: Any, path: Keys) -> Mapping[str, Any]:
        """An object whose keys name things that variables are named after."""
        for name in (found := self.mapping(value, path)):
            if not re.fullmatch(r"[A-Za-z_]\w*", name):
                self.complain((*path, name), f'found the name "{name}", expected letters, digits and underscores')
        return found

    def keys(self, value: Any, path: Keys, required: Sequence[str], optional: Sequence[str]) -> Mapping[str, Any]:
        """An object with these keys and no others."""
        found = self.mapping(value, path)
        for key in found:
            if key not in (*required, *optional):
                self.complain((*path, key), f'unknown key "{key}"{did_you_mean(key, (*required, *optional))}')
        if isinstance(value, Mapping):
            for key in required:
                if key not in found:
                    self.complain(path, f'"{key}" is missing')
        return found

    def mapping(self, value: Any, path: Keys) -> Mapping[str, Any]:
        if isinstance(value, Mapping):
            return value
        self.complain(path, f"found {value!r}, expected an object {{...}}")
        return {}

    def vector(self, value: Any, path: Keys, axes: Sequence[str]) -> Numbers:
        if not isinstance(value, list | tuple) or len(value) != len(axes):
            self.complain(path, f"found {value!r}, expected a list of {len(axes)} numbers [{', '.join(axes)}]")
            return (1.0,) * len(axes)
        return tuple(self.number(number, path) for number in value)

    def number(self, value: Any, path: Keys) -> float:
        if isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value):
            return float(value)
        self.complain(path, f"found {value!r}, expected a finite number")
        return 1.0
