"""Environment model: computes wind, current, waves and the surfaces below and writes the environment inputs of all vehicles."""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.core.component import Variable

from ..physics.compiled_equations import bind_arrays, load_library
from ..physics.vessel_bodies import FloatingBody
from ..vehicles.common.interface import CURRENT_INPUTS, WAVE_GAIN_INPUT, WIND_INPUTS, scalar_variable
from .coloured_noise import BLOCK_LENGTH, GRID_STEP
from .current import Current
from .sea import Sea
from .settings import EnvironmentSettings
from .surfaces import SurfaceTable
from .wind import DrydenGusts, Wind

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform, VehiclePlacement

_GRID_TOLERANCE = 1e-6  # in grid steps of the noise; times are not exact multiples of the grid step
_DOUBLE_SIZE = struct.calcsize("d")
_pack_vector, _unpack_vector = struct.Struct("3d").pack_into, struct.Struct("3d").unpack_from
_pack_pair, _unpack_pair = struct.Struct("2d").pack_into, struct.Struct("2d").unpack_from

#: function of the time since the start (s)
UpdateFunction = Callable[[float], None]
#: function of x, y (m) and the time since the start (s) to the height of the water surface (m)
WaterLevel = Callable[[float, float, float], float]

#: beginnings of the names of the parameters by which wind acts on a vehicle
AIR_DRAG_PARAMETERS = ("air_drag", "body_drag", "rotor_drag", "translational_lift")

#: distance (m) above all crests within which a vehicle needs the water level; more than the way of a step
WATER_MARGIN = 1.0


class EnvironmentModel:
    """Environment of the vehicles of one world.

    Call `update` before each step of the vehicles, and `publish` after the last one.

    Args:
        environment: Waves, wind and current.
        sea: Realisation of the waves.
        vehicles: All vehicles.
        platforms: All platforms.
        bodies: Contact body of each vehicle.
        highest_water: Output: height that no crest exceeds (m), shape (1,).

    Attributes:
        values: Inputs and outputs, which are the whole state: everything else is a function of time and seed.
        inputs: View of `values`: mean wind (m/s), mean current (m/s) and wave gain (1), as far as the environment has them.
        outputs: View of `values`: wind (m/s) and wave elevation (m) at the vehicles.
        input_variables: Variables of `inputs`.
        output_variables: Variables of `outputs`.
        update_functions: Functions that write the environment inputs, empty without wind, waves, current and ground effect.
        vessels_without_wave_motion: Names of planar vessels in waves.
        wind_is_without_effect: There is wind, and all coefficients of air drag of all vehicles are 0.
    """

    def __init__(
        self,
        environment: EnvironmentSettings,
        sea: Sea,
        vehicles: Sequence[VehiclePlacement],
        platforms: Sequence[Platform],
        bodies: Sequence[ContactBody],
        highest_water: np.ndarray,
    ):
        self._wind_vehicles = _bodies_with_input(bodies, "wind.x") if environment.wind else []
        self._wave_vessels = [body for body in bodies if isinstance(body, FloatingBody)] if environment.waves else []
        self.input_variables, self.output_variables = (
            _input_variables(environment),
            _output_variables(self._wind_vehicles, self._wave_vessels),
        )
        self.values = np.zeros(len(self.input_variables) + len(self.output_variables))
        self.inputs, self.outputs = np.split(self.values, [len(self.input_variables)])
        self.inputs[:] = [variable.start for variable in self.input_variables]
        self.vessels_without_wave_motion = [
            body.name for body in bodies if environment.waves and body.model.is_vessel and body not in self._wave_vessels
        ]
        has_wind = environment.wind is not None and any(environment.wind.velocity)
        self.wind_is_without_effect = has_wind and not any(any(_air_drag(vehicle)) for vehicle in vehicles)
        self._wave_gain: Any = self._input_view("wave_gain") if environment.waves else np.ones(1).data
        self._elevation = sea.elevation_function()
        self._highest_water: Any = highest_water.data
        self._highest_elevation = sea.highest_elevation
        for body in _bodies_with_input(bodies, "water_level"):
            _input_data(body, "water_level")[0] = 0.0
        self.update_functions = list(self._create_updates(environment, bodies))
        all_multirotors = _bodies_with_input(bodies, "ground_distance")
        if multirotors := all_multirotors if environment.waves else _multirotors_in_ground_effect(vehicles, bodies):
            surfaces = SurfaceTable([body for body in bodies if body.model.is_vessel], platforms)
            update = _SurroundingsUpdate(multirotors, surfaces, sea, self._wave_gain, self._highest_water)
            self.update_functions.append(update.update)
        first = 3 * len(self._wind_vehicles)
        self._elevations = [
            (body.elevation_function(len(sea.phase), sea.component_table()), first + k)
            for k, body in enumerate(self._wave_vessels)
        ]
        self._published: Any = self.outputs.data

    def _input_view(self, name: str) -> Any:
        """Return a memoryview of the inputs from the named one on."""
        names = [variable.name for variable in self.input_variables]
        return self.inputs[names.index(f"environment.{name}") :].data

    def _create_updates(self, environment: EnvironmentSettings, bodies: Sequence[ContactBody]) -> Iterator[UpdateFunction]:
        seed, wind, current = environment.seed, environment.wind, environment.current
        if wind:
            yield _WindUpdate(wind, seed, self._input_view("wind.x"), self._wind_vehicles, self.outputs.data).update
        if current:
            yield _CurrentUpdate(current, seed, self._input_view("current.x"), _bodies_with_input(bodies, "current.x")).update
        if environment.waves:
            yield self._update_highest_water
            if submerged := [body for body in _bodies_with_input(bodies, "water_level") if body.model.craft]:
                yield _WaterLevelUpdate(submerged, self.water_level, self._highest_water).update
        if self._wave_vessels:
            gains = [_input_data(body, "wave_gain") for body in self._wave_vessels]
            yield lambda _time: _set_all(gains, self._wave_gain[0])

    def _update_highest_water(self, _time: float) -> None:
        self._highest_water[0] = abs(self._wave_gain[0]) * self._highest_elevation

    def water_level(self, x: float, y: float, time: float) -> float:
        """Return the height of the water surface (m) at a position (m) and a time since the start (s)."""
        return float(self._wave_gain[0] * self._elevation(x, y, time))

    def update(self, time: float) -> None:
        """Write the environment inputs of all vehicles for a time since the start (s)."""
        for update in self.update_functions:
            update(time)

    def publish(self, time: float) -> None:
        """Write the wave elevations at the vessels for a time since the start (s)."""
        for elevation, index in self._elevations:
            self._published[index] = self._wave_gain[0] * elevation(time)


def _bodies_with_input(bodies: Sequence[ContactBody], name: str) -> list[ContactBody]:
    """Return the vehicles that have an environment input."""
    return [body for body in bodies if any(variable.name == name for variable in body.model.environment_inputs)]


def _air_drag(vehicle: VehiclePlacement) -> list[float]:
    """Return the coefficients of air drag of a vehicle; [1] if they are no parameters."""
    values = zip(vehicle.model.slots("parameter"), vehicle.parameters, strict=True)
    return [value for name, value in values if name.startswith(AIR_DRAG_PARAMETERS)] or [1.0]


def _input_data(body: ContactBody, name: str) -> Any:
    """Return a memoryview of a vehicle's environment inputs from the named one on; it is faster than NumPy for few numbers."""
    return body.environment_inputs[_input_index(body, name) :].data


def _input_index(body: ContactBody, name: str) -> int:
    """Return the index of a scalar environment input, or of the first element of an array."""
    return [variable.name for variable in body.model.environment_inputs].index(name)


def _set_all(inputs: Sequence[Any], value: float) -> None:
    for first in inputs:
        first[0] = value


def _input_variables(environment: EnvironmentSettings) -> list[Variable]:
    pairs: list[tuple[Variable, float]] = []
    if environment.wind:
        pairs += zip(WIND_INPUTS, environment.wind.velocity, strict=True)
    if environment.current:
        pairs += zip(CURRENT_INPUTS, environment.current.velocity, strict=True)
    if environment.waves:
        pairs += zip(WAVE_GAIN_INPUT, (1.0,), strict=True)
    return [replace(variable, name=f"environment.{variable.name}", start=start) for variable, start in pairs]


def _output_variables(wind_vehicles: Sequence[ContactBody], wave_vessels: Sequence[ContactBody]) -> list[Variable]:
    elevation = scalar_variable(
        "wave.elevation", "m", "elevation of the water at the centre of mass above the still water", "output"
    )
    winds = [
        replace(wind, name=f"{body.name}.{wind.name}", causality="output", start=None)
        for body in wind_vehicles
        for wind in WIND_INPUTS
    ]
    return [*winds, *(replace(elevation, name=f"{body.name}.{elevation.name}", start=None) for body in wave_vessels)]


class _WindUpdate:
    """Update of the wind at all vehicles: mean wind at their height and gusts; it is also published."""

    def __init__(self, wind: Wind, seed: int, mean: Any, vehicles: Sequence[ContactBody], published: Any):
        self._profile, self._mean, self._published = wind.profile, mean, published
        turbulence = wind.turbulence
        self._gusts = DrydenGusts(wind, turbulence, seed, [body.name for body in vehicles]) if turbulence and vehicles else None
        self._vehicles = [
            (_input_data(body, "wind.x"), 3 * _DOUBLE_SIZE * k, body.outputs[2:].data) for k, body in enumerate(vehicles)
        ]
        self._block_number = -1
        #: x, y and z of the gusts at all vehicles, for each grid point of the current block of noise
        self._gust_block: Sequence[tuple[float, ...]] = [(0.0,) * 3 * len(vehicles)] * BLOCK_LENGTH

    def update(self, time: float) -> None:
        """Write the wind at a time (s)."""
        mean_x, mean_y, mean_z = _unpack_vector(self._mean)
        number, row = divmod(int(time / GRID_STEP + _GRID_TOLERANCE), BLOCK_LENGTH)
        if number != self._block_number and self._gusts:
            self._block_number, self._gust_block = number, self._gusts.values_in_block(number)
        profile, published, gusts = self._profile, self._published, iter(self._gust_block[row])
        for wind, offset, height in self._vehicles:
            fraction = profile(height[0]) if profile else 1.0
            x, y, z = fraction * mean_x + next(gusts), fraction * mean_y + next(gusts), fraction * mean_z + next(gusts)
            _pack_vector(wind, 0, x, y, z)
            _pack_vector(published, offset, x, y, z)


class _CurrentUpdate:
    """Update of the current, which is the same for all vessels."""

    def __init__(self, current: Current, seed: int, mean: Any, vessels: Sequence[ContactBody]):
        self._mean, self._ramp = mean, current.ramp
        self._noise = current.variation.create_noise(seed) if current.variation else None
        self._current_inputs = [_input_data(body, "current.x") for body in vessels]

    def update(self, time: float) -> None:
        """Write the current at a time (s)."""
        x, y = _unpack_pair(self._mean)
        for change_x, change_y in self._velocity_changes(time):
            x, y = x + change_x, y + change_y
        for current in self._current_inputs:
            _pack_pair(current, 0, x, y)

    def _velocity_changes(self, time: float) -> list[Sequence[float]]:
        changes: list[Sequence[float]] = []
        if self._ramp:
            changes.append(self._ramp.change_at(time))
        if self._noise:
            changes.append(self._noise[int(time / GRID_STEP + _GRID_TOLERANCE)])
        return changes


class _WaterLevelUpdate:
    """Update of the height of the water surface at submerged vehicles; those above all crests need none."""

    def __init__(self, vehicles: Sequence[ContactBody], water_level: WaterLevel, highest_water: Any):
        self._water_level, self._highest_water = water_level, highest_water
        self._vehicles = [(_input_data(body, "water_level"), body.outputs.data, _reach(body)) for body in vehicles]

    def update(self, time: float) -> None:
        """Write the water levels at a time (s)."""
        highest = self._highest_water[0]
        for level, outputs, reach in self._vehicles:
            level[0] = self._water_level(outputs[0], outputs[1], time) if outputs[2] - reach < highest else -highest


def _reach(body: ContactBody) -> float:
    """Return the distance (m) of the centre of mass above all crests within which a vehicle needs the water level."""
    return max(body.bounding_box(body.model.body).high) + WATER_MARGIN


def _multirotors_in_ground_effect(vehicles: Sequence[VehiclePlacement], bodies: Sequence[ContactBody]) -> list[ContactBody]:
    """Return the multirotors with the ground effect switched on."""
    return [
        body
        for vehicle, body in zip(vehicles, bodies, strict=True)
        if body in _bodies_with_input(bodies, "ground_distance") and vehicle.parameter("ground_effect")
    ]


class _SurroundingsUpdate:
    """Update of the surface below multirotors and of the height of the water at them.

    Args:
        multirotors: Multirotors to update.
        surfaces: Decks and platforms.
        sea: Realisation of the waves.
        wave_gain: Memoryview of the factor on all amplitudes (1).
        highest_water: Memoryview of the height that no crest exceeds (m).
    """

    def __init__(
        self,
        multirotors: Sequence[ContactBody],
        surfaces: SurfaceTable,
        sea: Sea,
        wave_gain: Any,
        highest_water: Any,
    ):
        self._gain, self._highest_water, self._update_surfaces = wave_gain, highest_water, surfaces.update
        sea_values, waves = np.array([0.0, 1.0, len(sea.phase), 0.0]), sea.component_table()
        self._sea: Any = sea_values.data
        self._calls = [
            bind_arrays(
                load_library(body.model.binary).surroundings,
                [body.outputs, _disc(body), sea_values, waves, surfaces.count, surfaces.rows],
                [body.environment_inputs[_input_index(body, "ground_distance") :]],
            )
            for body in multirotors
        ]

    def update(self, time: float) -> None:
        """Write the surroundings at a time (s)."""
        self._update_surfaces()
        sea = self._sea
        sea[0], sea[1], sea[3] = time, self._gain[0], self._highest_water[0]
        for call in self._calls:
            call()


def _disc(body: ContactBody) -> np.ndarray:
    """Return the argument `disc` of the compiled function `surroundings`."""
    (x, y, z), radius = body.model.rotor_disc or ((0.0, 0.0, 0.0), 0.0)
    return np.array([x, y, z, radius, _reach(body)])
