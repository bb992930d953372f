"""The environment at work: before each step it writes into every vehicle's surroundings what air and water do to it there."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.core.component import Variable

from ..physics.vessel_bodies import FloatingBody
from ..vehicles.common.interface import CURRENT_INPUTS, WAVE_GAIN_INPUT, WIND_INPUTS, scalar_variable
from .coloured_noise import BLOCK_LENGTH, GRID_STEP
from .current import Current
from .ground_distance import GroundDistance
from .sea import Sea
from .settings import EnvironmentSettings
from .wind import DrydenGusts, Wind

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform, VehiclePlacement

_GRID_TOLERANCE = 1e-6  # of the grid of noise: times are not exact multiples of it
_DOUBLE_SIZE = struct.calcsize("d")
_pack_vector, _unpack_vector = struct.Struct("3d").pack_into, struct.Struct("3d").unpack_from
_pack_pair, _unpack_pair = struct.Struct("2d").pack_into, struct.Struct("2d").unpack_from
_unpack_pose = struct.Struct("7d").unpack_from

UpdateFunction = Callable[[float], None]  # of the time since the start (s)


class EnvironmentModel:
    """Air, water and what is below, for the vehicles of one world.

    `inputs` are the mean wind, the mean current and the factor on the waves, as far as the environment has them, `outputs` what
    vehicles publish about them. Both lie in `block`, which is all that changes: the rest is a function of time and seed.
    `update` is to be called before each step of the vehicles and `publish` after the last one, with the time since the start.
    """

    def __init__(
        self,
        environment: EnvironmentSettings,
        sea: Sea,
        vehicles: Sequence[VehiclePlacement],
        platforms: Sequence[Platform],
        bodies: Sequence[ContactBody],
    ):
        self._wind_vehicles = _bodies_with_input(bodies, "wind.x") if environment.wind else []
        self._wave_vessels = [shadow for shadow in bodies if isinstance(shadow, FloatingBody)] if environment.waves else []
        self.input_variables, self.output_variables = (
            _input_variables(environment),
            _output_variables(self._wind_vehicles, self._wave_vessels),
        )
        self.values = np.zeros(len(self.input_variables) + len(self.output_variables))
        self.inputs, self.outputs = np.split(self.values, [len(self.input_variables)])
        self.inputs[:] = [variable.start for variable in self.input_variables]
        #: vessels that the waves pass by
        self.vessels_without_wave_motion = [
            s.name for s in bodies if environment.waves and s.model.is_vessel and s not in self._wave_vessels
        ]
        self._wave_gain: Any = self._input_view("wave_gain") if environment.waves else np.ones(1).data
        self.update_functions = list(self._create_updates(environment, bodies))
        if lifted := _multirotors_in_ground_effect(vehicles, bodies):
            vessels = [shadow for shadow in bodies if shadow.model.is_vessel]
            self.update_functions.append(
                _GroundDistanceUpdate(lifted, GroundDistance(vessels, platforms, sea), self._wave_gain).update
            )
        first = 3 * len(self._wind_vehicles)
        self._elevations = [
            (shadow.elevation_function(len(sea.phase), sea.component_table()), first + k)
            for k, shadow in enumerate(self._wave_vessels)
        ]
        self._published: Any = self.outputs.data

    def _input_view(self, name: str) -> Any:
        """The inputs from one of them on."""
        names = [variable.name for variable in self.input_variables]
        return self.inputs[names.index(f"environment.{name}") :].data

    def _create_updates(self, environment: EnvironmentSettings, shadows: Sequence[ContactBody]) -> Iterator[UpdateFunction]:
        seed, wind, current = environment.seed, environment.wind, environment.current
        if wind:
            yield _WindUpdate(wind, seed, self._input_view("wind.x"), self._wind_vehicles, self.outputs.data).update
        if current:
            yield _CurrentUpdate(current, seed, self._input_view("current.x"), _bodies_with_input(shadows, "current.x")).update
        if self._wave_vessels:
            gains = [_input_data(shadow, "wave_gain") for shadow in self._wave_vessels]
            yield lambda time: _set_all(gains, self._wave_gain[0])

    def update(self, time: float) -> None:
        """Write the surroundings of all vehicles."""
        for update in self.update_functions:
            update(time)

    def publish(self, time: float) -> None:
        """Write the outputs that follow from where the vehicles are now."""
        for elevation, place in self._elevations:
            self._published[place] = self._wave_gain[0] * elevation(time)


def _bodies_with_input(shadows: Sequence[ContactBody], name: str) -> list[ContactBody]:
    """Those that have something in their surroundings."""
    return [shadow for shadow in shadows if any(variable.name == name for variable in shadow.model.environment_inputs)]


def _input_data(shadow: ContactBody, name: str) -> Any:
    """The surroundings of a vehicle from a number on, as memoryview: numpy takes longer for so few numbers."""
    names = [variable.name for variable in shadow.model.environment_inputs]
    return shadow.environment_inputs[names.index(name) :].data


def _set_all(slots: Sequence[Any], value: float) -> None:
    for slot in slots:
        slot[0] = value


def _input_variables(environment: EnvironmentSettings) -> list[Variable]:
    pairs: list[tuple[Variable, float]] = []
    if environment.wind:
        pairs += zip(WIND_INPUTS, environment.wind.velocity, strict=True)
    if environment.current:
        pairs += zip(CURRENT_INPUTS, environment.current.velocity, strict=True)
    if environment.waves:
        pairs += zip(WAVE_GAIN_INPUT, (1.0,), strict=True)
    return [replace(variable, name=f"environment.{variable.name}", start=start) for variable, start in pairs]


def _output_variables(blown: Sequence[ContactBody], waved: Sequence[ContactBody]) -> list[Variable]:
    elevation = scalar_variable(
        "wave.elevation", "m", "height of the water at the centre of mass above the still water", "output"
    )
    winds = [replace(v, name=f"{shadow.name}.{v.name}", causality="output", start=None) for shadow in blown for v in WIND_INPUTS]
    return [*winds, *(replace(elevation, name=f"{shadow.name}.{elevation.name}", start=None) for shadow in waved)]


class _WindUpdate:
    """Wind on vehicles: the mean one at their height and gusts, published as well."""

    def __init__(self, wind: Wind, seed: int, mean: Any, vehicles: Sequence[ContactBody], published: Any):
        self._profile, self._mean, self._published = wind.profile, mean, published
        turbulence = wind.turbulence
        self._gusts = [DrydenGusts(wind, turbulence, seed, shadow.name) for shadow in vehicles] if turbulence else []
        self._vehicles = [
            (_input_data(shadow, "wind.x"), 3 * _DOUBLE_SIZE * k, shadow.outputs[2:].data) for k, shadow in enumerate(vehicles)
        ]
        #: the gusts of all vehicles in the present block of noise
        self._block_number = -1
        self._gust_block: Sequence[Sequence[tuple[float, ...]]] = [[(0.0, 0.0, 0.0)] * len(vehicles)] * BLOCK_LENGTH

    def update(self, time: float) -> None:
        mean_x, mean_y, mean_z = _unpack_vector(self._mean)
        number, place = divmod(int(time / GRID_STEP + _GRID_TOLERANCE), BLOCK_LENGTH)
        if number != self._block_number and self._gusts:
            self._block_number, self._gust_block = (
                number,
                list(zip(*(gusts.values_in_block(number) for gusts in self._gusts), strict=True)),
            )
        profile, published = self._profile, self._published
        for (slot, offset, height), (gust_x, gust_y, gust_z) in zip(self._vehicles, self._gust_block[place], strict=True):
            share = profile(height[0]) if profile else 1.0
            x, y, z = share * mean_x + gust_x, share * mean_y + gust_y, share * mean_z + gust_z
            _pack_vector(slot, 0, x, y, z)
            _pack_vector(published, offset, x, y, z)


class _CurrentUpdate:
    """One current for all vessels."""

    def __init__(self, current: Current, seed: int, mean: Any, vessels: Sequence[ContactBody]):
        self._mean, self._ramp = mean, current.ramp
        self._noise = current.variation.create_noise(seed) if current.variation else None
        self._slots = [_input_data(shadow, "current.x") for shadow in vessels]

    def update(self, time: float) -> None:
        x, y = _unpack_pair(self._mean)
        for more_x, more_y in self._velocity_changes(time):
            x, y = x + more_x, y + more_y
        for slot in self._slots:
            _pack_pair(slot, 0, x, y)

    def _velocity_changes(self, time: float) -> list[Sequence[float]]:
        changes: list[Sequence[float]] = []
        if self._ramp:
            changes.append(self._ramp.change_at(time))
        if self._noise:
            changes.append(self._noise[int(time / GRID_STEP + _GRID_TOLERANCE)])
        return changes


def _multirotors_in_ground_effect(spawns: Sequence[VehiclePlacement], shadows: Sequence[ContactBody]) -> list[ContactBody]:
    """Multirotors whose ground effect is on."""
    return [
        shadow
        for spawn, shadow in zip(spawns, shadows, strict=True)
        if shadow in _bodies_with_input(shadows, "ground_distance") and spawn.parameter("ground_effect")
    ]


class _GroundDistanceUpdate:
    """How high multirotors are above what is below them."""

    def __init__(self, multirotors: Sequence[ContactBody], below: GroundDistance, wave_gain: Any):
        self._ground_distance, self._gain = below, wave_gain
        self._vehicles = [
            (_input_data(shadow, "ground_distance"), shadow.outputs.data, shadow.model.rotor_centre or (0.0, 0.0, 0.0))
            for shadow in multirotors
        ]

    def update(self, time: float) -> None:
        for slot, outputs, centre in self._vehicles:
            x, y, z, *q = _unpack_pose(outputs)
            dx, dy, dz = _rotate(q, centre)
            slot[0] = self._ground_distance.distance(x + dx, y + dy, z + dz, time, self._gain[0])


def _rotate(q: Sequence[float], vector: Sequence[float]) -> tuple[float, float, float]:
    """A body vector in the world frame, by the unit quaternion (w, x, y, z)."""
    w, qx, qy, qz = q
    x, y, z = vector
    tx, ty, tz = 2 * (qy * z - qz * y), 2 * (qz * x - qx * z), 2 * (qx * y - qy * x)
    return (
        x + w * tx + qy * tz - qz * ty,
        y + w * ty + qz * tx - qx * tz,
        z + w * tz + qx * ty - qy * tx,
    )
