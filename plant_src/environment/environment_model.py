"""Environment model.

Computes wind, current, waves and the surfaces below and writes the environment inputs of all
vehicles.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from cosim.core.component import Variable

from ..physics.body import FloatingBody
from ..vehicles.common.interface import (
    CURRENT_INPUTS,
    WAVE_GAIN_INPUT,
    WIND_INPUTS,
    scalar_variable,
)
from .sea import Sea
from .settings import EnvironmentSettings
from .updates import (
    CurrentUpdate,
    SurfaceTable,
    SurroundingsUpdate,
    WaterLevelUpdate,
    WindUpdate,
    input_data,
)

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform, VehiclePlacement

#: function of the time since the start (s)
UpdateFunction = Callable[[float], None]
#: beginnings of the names of the parameters by which wind acts on a vehicle
AIR_DRAG_PARAMETERS = ("air_drag", "body_drag", "rotor_drag", "translational_lift")


class EnvironmentModel:
    """Environment of the vehicles of one world.

    Call `update` before each step of the vehicles, and `publish` after the last one.

    Args:
        environment: Waves, wind and current.
        sea: Realisation of the waves.
        vehicles: All vehicles.
        platforms: All platforms.
        bodies: Contact body of each vehicle.

    Attributes:
        values: Inputs and outputs, which are the whole state: everything else is a function of time
            and seed.
        inputs: View of `values`: mean wind (m/s), mean current (m/s) and wave gain (1), as far as
            the environment has them.
        outputs: View of `values`: wind (m/s) and wave elevation (m) at the vehicles.
        input_variables: Variables of `inputs`.
        output_variables: Variables of `outputs`.
        update_functions: Functions that write the environment inputs, empty without wind, waves,
            current and ground effect.
        vessels_without_wave_motion: Names of planar vessels in waves.
        wind_is_without_effect: There is wind, and all coefficients of air drag of all vehicles are
            0.
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
        self._wave_vessels = (
            [body for body in bodies if isinstance(body, FloatingBody)] if environment.waves else []
        )
        self.input_variables, self.output_variables = (
            _input_variables(environment),
            _output_variables(self._wind_vehicles, self._wave_vessels),
        )
        self.values = np.zeros(len(self.input_variables) + len(self.output_variables))
        self.inputs, self.outputs = np.split(self.values, [len(self.input_variables)])
        self.inputs[:] = [variable.start for variable in self.input_variables]
        self.vessels_without_wave_motion = [
            body.name
            for body in bodies
            if environment.waves and body.model.is_vessel and body not in self._wave_vessels
        ]
        has_wind = environment.wind is not None and any(environment.wind.velocity)
        self.wind_is_without_effect = has_wind and not any(
            any(_air_drag(vehicle)) for vehicle in vehicles
        )
        self._wave_gain: Any = (
            self._input_view("wave_gain") if environment.waves else np.ones(1).data
        )
        self._elevation = sea.elevation_function()
        self._highest_elevation = sea.highest_elevation
        #: height that no crest exceeds (m)
        self._highest_water: Any = np.full(1, sea.highest_elevation).data
        for body in _bodies_with_input(bodies, "water_level"):
            input_data(body, "water_level")[0] = 0.0
        self.update_functions = list(self._create_updates(environment, bodies))
        all_multirotors = _bodies_with_input(bodies, "ground_distance")
        if (
            multirotors := all_multirotors
            if environment.waves
            else _multirotors_in_ground_effect(vehicles, bodies)
        ):
            surfaces = SurfaceTable([body for body in bodies if body.model.is_vessel], platforms)
            update = SurroundingsUpdate(
                multirotors, surfaces, sea, self._wave_gain, self._highest_water
            )
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

    def _create_updates(
        self, environment: EnvironmentSettings, bodies: Sequence[ContactBody]
    ) -> Iterator[UpdateFunction]:
        seed, wind, current = environment.seed, environment.wind, environment.current
        if wind:
            yield WindUpdate(
                wind, seed, self._input_view("wind.x"), self._wind_vehicles, self.outputs.data
            ).update
        if current:
            yield CurrentUpdate(
                current,
                seed,
                self._input_view("current.x"),
                _bodies_with_input(bodies, "current.x"),
            ).update
        if environment.waves:
            yield self._update_highest_water
            if submerged := [
                body for body in _bodies_with_input(bodies, "water_level") if body.model.craft
            ]:
                yield WaterLevelUpdate(submerged, self.water_level, self._highest_water).update
        if self._wave_vessels:
            gains = [input_data(body, "wave_gain") for body in self._wave_vessels]
            yield lambda _time: _set_all(gains, self._wave_gain[0])

    def _update_highest_water(self, _time: float) -> None:
        self._highest_water[0] = abs(self._wave_gain[0]) * self._highest_elevation

    def water_level(self, x: float, y: float, time: float) -> float:
        """Return the height of the water (m) at a position (m) and a time since the start (s)."""
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

    def has_input(body: ContactBody) -> bool:
        return any(variable.name == name for variable in body.model.environment_inputs)

    return list(filter(has_input, bodies))


def _air_drag(vehicle: VehiclePlacement) -> list[float]:
    """Return the coefficients of air drag of a vehicle; [1] if they are no parameters."""
    parameters = vehicle.parameters.items()
    return [value for name, value in parameters if name.startswith(AIR_DRAG_PARAMETERS)] or [1.0]


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
    return [
        replace(variable, name=f"environment.{variable.name}", start=start)
        for variable, start in pairs
    ]


def _output_variables(
    wind_vehicles: Sequence[ContactBody], wave_vessels: Sequence[ContactBody]
) -> list[Variable]:
    elevation = scalar_variable(
        "wave.elevation",
        "m",
        "elevation of the water at the centre of mass above the still water",
        "output",
    )
    outputs = []
    for body in wind_vehicles:
        outputs += [
            replace(wind, name=f"{body.name}.{wind.name}", causality="output", start=None)
            for wind in WIND_INPUTS
        ]
    return [
        *outputs,
        *(
            replace(elevation, name=f"{body.name}.{elevation.name}", start=None)
            for body in wave_vessels
        ),
    ]


def _multirotors_in_ground_effect(
    vehicles: Sequence[VehiclePlacement], bodies: Sequence[ContactBody]
) -> list[ContactBody]:
    """Return the multirotors with the ground effect switched on."""
    return [
        body
        for vehicle, body in zip(vehicles, bodies, strict=True)
        if body in _bodies_with_input(bodies, "ground_distance")
        and vehicle.parameters["ground_effect"]
    ]
