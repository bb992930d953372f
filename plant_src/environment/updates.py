"""Updates of the environment inputs of vehicles, and the table of surfaces below multirotors.

The updates are functions of the time that write wind, current, water level and surfaces.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from ..vehicles.common.interface import SURFACE_COLUMNS
from .coloured_noise import BLOCK_LENGTH, GRID_STEP
from .sea import Sea
from .wind_and_current import Current, DrydenGusts, Wind

if TYPE_CHECKING:
    from ..physics.body import ContactBody
    from ..placement import Platform

_CENTRE, _ORIENTATION = slice(2, 5), slice(5, 9)  # columns


class SurfaceTable:
    """Table of all decks and platforms, see `vehicles/multirotor/surroundings.py`.

    The deck of a vessel is the top of its highest box, centred at the output `deck.position`.

    Attributes:
        rows: Rectangles, shape (n, SURFACE_COLUMNS), at least one row; those without edges are
            below nothing.
        count: Number of rows, shape (1,).
    """

    def __init__(self, vessels: Sequence[ContactBody], platforms: Sequence[Platform]):
        self.count = np.full(1, float(len(vessels) + len(platforms)))
        self.rows = np.zeros((max(len(vessels) + len(platforms), 1), SURFACE_COLUMNS))
        self._decks: list[tuple[Any, Any, Any, Any]] = []
        for row, vessel in zip(self.rows, vessels, strict=False):
            deck = max(
                vessel.model.body.boxes, key=lambda box: box.position[2] + box.half_extents[2]
            )
            row[:2] = deck.half_extents[:2]
            slots = vessel.model.slots("output")
            first, turn = slots.index("deck.position.x"), slots.index("orientation.w")
            centre, orientation = vessel.outputs[first:][:3], vessel.outputs[turn:][:4]
            self._decks.append(
                (row[_CENTRE].data, row[_ORIENTATION].data, centre.data, orientation.data)
            )
        for row, platform in zip(self.rows[len(vessels) :], platforms, strict=False):
            x, y, z = platform.position
            edge_x, edge_y, edge_z = platform.size
            row[:] = edge_x / 2, edge_y / 2, x, y, z + edge_z / 2, 1.0, 0.0, 0.0, 0.0

    def update(self) -> None:
        """Copy the poses of the decks."""
        for centre, orientation, deck_centre, deck_orientation in self._decks:
            centre[:] = deck_centre
            orientation[:] = deck_orientation


_GRID_TOLERANCE = 1e-6  # in grid steps of the noise; times are not exact multiples of the grid step
_DOUBLE_SIZE = struct.calcsize("d")
_pack_vector, _unpack_vector = struct.Struct("3d").pack_into, struct.Struct("3d").unpack_from
_pack_pair, _unpack_pair = struct.Struct("2d").pack_into, struct.Struct("2d").unpack_from

#: function of x, y (m) and the time since the start (s) to the height of the water surface (m)
WaterLevel = Callable[[float, float, float], float]

#: distance (m) above all crests within which a vehicle needs the water level; more than the way of
#: a step
WATER_MARGIN = 1.0


def input_data(body: ContactBody, name: str) -> Any:
    """Return a memoryview of a vehicle's environment inputs from the named one on.

    It is faster than NumPy for few numbers.
    """
    return body.environment_inputs[_input_index(body, name) :].data


def _input_index(body: ContactBody, name: str) -> int:
    """Return the index of a scalar environment input, or of the first element of an array."""
    return [variable.name for variable in body.model.environment_inputs].index(name)


class WindUpdate:
    """Update of the wind at all vehicles: mean wind at their height and gusts.

    It is also published.
    """

    def __init__(
        self, wind: Wind, seed: int, mean: Any, vehicles: Sequence[ContactBody], published: Any
    ):
        self._profile, self._mean, self._published = wind.profile, mean, published
        turbulence = wind.turbulence
        self._gusts = (
            DrydenGusts(wind, turbulence, seed, [body.name for body in vehicles])
            if turbulence and vehicles
            else None
        )
        self._vehicles = [
            (input_data(body, "wind.x"), 3 * _DOUBLE_SIZE * k, body.outputs[2:].data)
            for k, body in enumerate(vehicles)
        ]
        self._block_number = -1
        #: x, y and z of the gusts at all vehicles, for each grid point of the current block of
        #: noise
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
            x, y, z = (
                fraction * mean_x + next(gusts),
                fraction * mean_y + next(gusts),
                fraction * mean_z + next(gusts),
            )
            _pack_vector(wind, 0, x, y, z)
            _pack_vector(published, offset, x, y, z)


class CurrentUpdate:
    """Update of the current, which is the same for all vessels."""

    def __init__(self, current: Current, seed: int, mean: Any, vessels: Sequence[ContactBody]):
        self._mean, self._ramp = mean, current.ramp
        self._noise = current.variation.create_noise(seed) if current.variation else None
        self._current_inputs = [input_data(body, "current.x") for body in vessels]

    def update(self, time: float) -> None:
        """Write the current at a time (s)."""
        x, y = _unpack_pair(self._mean)
        if self._ramp:
            change_x, change_y = self._ramp.change_at(time)
            x, y = x + change_x, y + change_y
        if self._noise:
            change_x, change_y = self._noise[int(time / GRID_STEP + _GRID_TOLERANCE)]
            x, y = x + change_x, y + change_y
        for current in self._current_inputs:
            _pack_pair(current, 0, x, y)


class WaterLevelUpdate:
    """Update of the height of the water surface at submerged vehicles.

    Those above all crests need none.
    """

    def __init__(
        self, vehicles: Sequence[ContactBody], water_level: WaterLevel, highest_water: Any
    ):
        self._water_level, self._highest_water = water_level, highest_water
        self._vehicles = [
            (input_data(body, "water_level"), body.outputs.data, _reach(body)) for body in vehicles
        ]

    def update(self, time: float) -> None:
        """Write the water levels at a time (s)."""
        highest = self._highest_water[0]
        for level, outputs, reach in self._vehicles:
            level[0] = (
                self._water_level(outputs[0], outputs[1], time)
                if outputs[2] - reach < highest
                else -highest
            )


def _reach(body: ContactBody) -> float:
    """Return the height above all crests (m) below which a vehicle needs the water level."""
    return max(body.bounding_box(body.model.body).high) + WATER_MARGIN


class SurroundingsUpdate:
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
        self._gain, self._highest_water, self._update_surfaces = (
            wave_gain,
            highest_water,
            surfaces.update,
        )
        sea_values = np.array([0.0, 1.0, len(sea.phase), 0.0])
        self._sea: Any = sea_values.data
        shared = {
            "sea": sea_values,
            "waves": sea.component_table(),
            "surface_count": surfaces.count,
            "surface_rows": surfaces.rows,
        }
        self._calls = [
            body.equations.bind("surroundings", shared | _own_arrays(body)) for body in multirotors
        ]

    def update(self, time: float) -> None:
        """Write the surroundings at a time (s)."""
        self._update_surfaces()
        sea = self._sea
        sea[0], sea[1], sea[3] = time, self._gain[0], self._highest_water[0]
        for call in self._calls:
            call()


def _own_arrays(body: ContactBody) -> dict[str, np.ndarray]:
    """Return the arguments and results of the compiled function `surroundings` of one vehicle."""
    sizes = body.equations.functions["surroundings"].sizes
    (x, y, z), radius = body.model.rotor_disc or ((0.0, 0.0, 0.0), 0.0)
    inputs = body.environment_inputs[_input_index(body, "ground_distance") :]
    return {
        "pose": body.outputs[: sizes["pose"]],
        "disc": np.array([x, y, z, radius, _reach(body)]),
        "surroundings": inputs[: sizes["surroundings"]],
    }
