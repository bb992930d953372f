"""The environment at work: before each step it writes into every vehicle's surroundings what air and water do to it there."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.core.component import Variable

from ..physics.body import FloatingBody
from ..vehicles.common.interface import CURRENT, WAVE_GAIN, WIND, scalar
from .current import Current
from .noise import BLOCK, GRID
from .sea import Sea
from .settings import Environment
from .surfaces import Below
from .wind import Gusts, Wind

if TYPE_CHECKING:
    from ..physics.body import Shadow
    from ..placement import Platform, Spawn

_ROUNDING = 1e-6  # of the grid of noise: times are not exact multiples of it
_NUMBER = struct.calcsize("d")
_write_vector, _read_vector = struct.Struct("3d").pack_into, struct.Struct("3d").unpack_from
_write_pair, _read_pair = struct.Struct("2d").pack_into, struct.Struct("2d").unpack_from
_pose = struct.Struct("7d").unpack_from

Update = Callable[[float], None]  # of the time since the start (s)


class Surroundings:
    """Air, water and what is below, for the vehicles of one world.

    `inputs` are the mean wind, the mean current and the factor on the waves, as far as the environment has them, `outputs` what
    vehicles publish about them. Both lie in `block`, which is all that changes: the rest is a function of time and seed.
    `update` is to be called before each step of the vehicles and `publish` after the last one, with the time since the start.
    """

    def __init__(
        self,
        environment: Environment,
        sea: Sea,
        vehicles: Sequence[Spawn],
        platforms: Sequence[Platform],
        shadows: Sequence[Shadow],
    ):
        self._blown = _with(shadows, "wind.x") if environment.wind else []
        self._waved = [shadow for shadow in shadows if isinstance(shadow, FloatingBody)] if environment.waves else []
        self.input_variables, self.output_variables = _inputs(environment), _outputs(self._blown, self._waved)
        self.block = np.zeros(len(self.input_variables) + len(self.output_variables))
        self.inputs, self.outputs = np.split(self.block, [len(self.input_variables)])
        self.inputs[:] = [variable.start for variable in self.input_variables]
        #: vessels that the waves pass by
        self.unmoved = [s.name for s in shadows if environment.waves and s.model.is_vessel and s not in self._waved]
        self._gain: Any = self._input("wave_gain") if environment.waves else np.ones(1).data
        self.updates = list(self._updates(environment, shadows))
        if lifted := _in_ground_effect(vehicles, shadows):
            vessels = [shadow for shadow in shadows if shadow.model.is_vessel]
            self.updates.append(_Ground(lifted, Below(vessels, platforms, sea), self._gain).update)
        first = 3 * len(self._blown)
        self._floating = [(shadow.surface(len(sea.phase), sea.table()), first + k) for k, shadow in enumerate(self._waved)]
        self._published: Any = self.outputs.data

    def _input(self, name: str) -> Any:
        """The inputs from one of them on."""
        names = [variable.name for variable in self.input_variables]
        return self.inputs[names.index(f"environment.{name}") :].data

    def _updates(self, environment: Environment, shadows: Sequence[Shadow]) -> Iterator[Update]:
        seed, wind, current = environment.seed, environment.wind, environment.current
        if wind:
            yield _Air(wind, seed, self._input("wind.x"), self._blown, self.outputs.data).update
        if current:
            yield _Water(current, seed, self._input("current.x"), _with(shadows, "current.x")).update
        if self._waved:
            gains = [_slot(shadow, "wave_gain") for shadow in self._waved]
            yield lambda time: _fill(gains, self._gain[0])

    def update(self, time: float) -> None:
        """Write the surroundings of all vehicles."""
        for update in self.updates:
            update(time)

    def publish(self, time: float) -> None:
        """Write the outputs that follow from where the vehicles are now."""
        for elevation, place in self._floating:
            self._published[place] = self._gain[0] * elevation(time)


def _with(shadows: Sequence[Shadow], name: str) -> list[Shadow]:
    """Those that have something in their surroundings."""
    return [shadow for shadow in shadows if any(variable.name == name for variable in shadow.model.surroundings)]


def _slot(shadow: Shadow, name: str) -> Any:
    """The surroundings of a vehicle from a number on, as memoryview: numpy takes longer for so few numbers."""
    names = [variable.name for variable in shadow.model.surroundings]
    return shadow.surroundings[names.index(name) :].data


def _fill(slots: Sequence[Any], value: float) -> None:
    for slot in slots:
        slot[0] = value


def _inputs(environment: Environment) -> list[Variable]:
    pairs: list[tuple[Variable, float]] = []
    if environment.wind:
        pairs += zip(WIND, environment.wind.velocity, strict=True)
    if environment.current:
        pairs += zip(CURRENT, environment.current.velocity, strict=True)
    if environment.waves:
        pairs += zip(WAVE_GAIN, (1.0,), strict=True)
    return [replace(variable, name=f"environment.{variable.name}", start=start) for variable, start in pairs]


def _outputs(blown: Sequence[Shadow], waved: Sequence[Shadow]) -> list[Variable]:
    elevation = scalar("wave.elevation", "m", "height of the water at the centre of mass above the still water", "output")
    winds = [replace(v, name=f"{shadow.name}.{v.name}", causality="output", start=None) for shadow in blown for v in WIND]
    return [*winds, *(replace(elevation, name=f"{shadow.name}.{elevation.name}", start=None) for shadow in waved)]


class _Air:
    """Wind on vehicles: the mean one at their height and gusts, published as well."""

    def __init__(self, wind: Wind, seed: int, mean: Any, vehicles: Sequence[Shadow], published: Any):
        self._profile, self._mean, self._published = wind.profile, mean, published
        turbulence = wind.turbulence
        self._gusts = [Gusts(wind, turbulence, seed, shadow.name) for shadow in vehicles] if turbulence else []
        self._vehicles = [
            (_slot(shadow, "wind.x"), 3 * _NUMBER * k, shadow.outputs[2:].data) for k, shadow in enumerate(vehicles)
        ]
        #: the gusts of all vehicles in the present block of noise
        self._number = -1
        self._block: Sequence[Sequence[tuple[float, ...]]] = [[(0.0, 0.0, 0.0)] * len(vehicles)] * BLOCK

    def update(self, time: float) -> None:
        mean_x, mean_y, mean_z = _read_vector(self._mean)
        number, place = divmod(int(time / GRID + _ROUNDING), BLOCK)
        if number != self._number and self._gusts:
            self._number, self._block = number, list(zip(*(gusts.block(number) for gusts in self._gusts), strict=True))
        profile, published = self._profile, self._published
        for (slot, offset, height), (gust_x, gust_y, gust_z) in zip(self._vehicles, self._block[place], strict=True):
            share = profile(height[0]) if profile else 1.0
            x, y, z = share * mean_x + gust_x, share * mean_y + gust_y, share * mean_z + gust_z
            _write_vector(slot, 0, x, y, z)
            _write_vector(published, offset, x, y, z)


class _Water:
    """One current for all vessels."""

    def __init__(self, current: Current, seed: int, mean: Any, vessels: Sequence[Shadow]):
        self._mean, self._ramp = mean, current.ramp
        self._noise = current.variation.noise(seed) if current.variation else None
        self._slots = [_slot(shadow, "current.x") for shadow in vessels]

    def update(self, time: float) -> None:
        x, y = _read_pair(self._mean)
        for more_x, more_y in self._changes(time):
            x, y = x + more_x, y + more_y
        for slot in self._slots:
            _write_pair(slot, 0, x, y)

    def _changes(self, time: float) -> list[Sequence[float]]:
        changes: list[Sequence[float]] = []
        if self._ramp:
            changes.append(self._ramp.at(time))
        if self._noise:
            changes.append(self._noise[int(time / GRID + _ROUNDING)])
        return changes


def _in_ground_effect(spawns: Sequence[Spawn], shadows: Sequence[Shadow]) -> list[Shadow]:
    """Multirotors whose ground effect is on."""
    return [
        shadow
        for spawn, shadow in zip(spawns, shadows, strict=True)
        if shadow in _with(shadows, "ground_distance") and spawn.parameter("ground_effect")
    ]


class _Ground:
    """How high multirotors are above what is below them."""

    def __init__(self, multirotors: Sequence[Shadow], below: Below, wave_gain: Any):
        self._below, self._gain = below, wave_gain
        self._vehicles = [
            (_slot(shadow, "ground_distance"), shadow.outputs.data, shadow.model.rotor_plane or (0.0, 0.0, 0.0))
            for shadow in multirotors
        ]

    def update(self, time: float) -> None:
        for slot, outputs, centre in self._vehicles:
            x, y, z, *q = _pose(outputs)
            dx, dy, dz = _turned(q, centre)
            slot[0] = self._below.distance(x + dx, y + dy, z + dz, time, self._gain[0])


def _turned(q: Sequence[float], vector: Sequence[float]) -> tuple[float, float, float]:
    """A body vector in the world frame, by the unit quaternion (w, x, y, z)."""
    w, qx, qy, qz = q
    x, y, z = vector
    tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + w * tx + qy * tz - qz * ty,
        y + w * ty + qz * tx - qx * tz,
        z + w * tz + qx * ty - qy * tx,
    )
