"""Surface below multirotors and water level at them against rays, planes and the sea in NumPy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation

from plant_src.catalogue import MODELS
from plant_src.environment import sea
from plant_src.environment.sea import CALM, Sea
from plant_src.environment.updates import SurfaceTable
from plant_src.physics.compiled_equations import CompiledEquations
from plant_src.placement import Platform
from plant_src.vehicles.multirotor.surroundings import (
    MAX_WAVE_EFFECT_HEIGHT,
    create_surroundings_function,
)

STRIDER = MODELS["strider"]
PLATE = np.array([0.701, 0.602]) / 2  # m, half edges of the deck
PLATFORM = Platform("start", (2.0, 1.0, 0.5), (5.0, 0.0, 1.0))


def vessel(centre: Any, attitude: Rotation) -> Any:
    """A vessel that publishes this deck centre and attitude, as contact bodies do."""
    slots = STRIDER.slots("output")
    outputs = np.zeros(len(slots))
    x, y, z, w = attitude.as_quat()
    outputs[slots.index("orientation.w") :][:4] = w, x, y, z
    outputs[slots.index("deck.position.x") :][:3] = centre
    return SimpleNamespace(model=STRIDER, outputs=outputs)


def ray(point: np.ndarray, centre: np.ndarray, attitude: Rotation) -> float | None:
    """Return the height (m) at which a ray straight down from a point meets the deck."""
    forward, left, _ = attitude.as_matrix().T
    _, s, t = np.linalg.solve(np.column_stack([[0.0, 0.0, 1.0], forward, left]), point - centre)
    inside = abs(s) <= PLATE[0] and abs(t) <= PLATE[1]
    return float(centre[2] + s * forward[2] + t * left[2]) if inside else None


class Surroundings:
    """Compiled function `surroundings` of a level multirotor whose rotors are at its centre of
    mass.
    """

    def __init__(
        self,
        vessels: list[Any],
        platforms: list[Platform],
        sea: Sea,
        radius: float = 0.0,
        reach: float = 0.0,
    ):
        self.pose, self.result = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]), np.full(3, np.nan)
        self.disc = np.array([0.0, 0.0, 0.0, radius, reach])
        self.sea = np.array([0.0, 1.0, len(sea.phase), sea.highest_elevation])
        table = SurfaceTable(vessels, platforms)
        table.update()
        self.arrays = {
            "pose": self.pose,
            "disc": self.disc,
            "sea": self.sea,
            "waves": sea.component_table(),
            "surface_count": table.count,
            "surface_rows": table.rows,
            "surroundings": self.result,
        }
        self.call = CompiledEquations(MODELS["ar_drone"]).bind("surroundings", self.arrays)

    def at(
        self, x: float, y: float, z: float, time: float = 0.0, gain: float = 1.0
    ) -> tuple[float, float, float]:
        """Return distance (m), share (1) and water level (m) at a place (m)."""
        self.pose[:3], self.sea[:2] = (x, y, z), (time, gain)
        self.call()
        return tuple(self.result.tolist())

    def distance(self, *place: float) -> float:
        """Return the distance of a point, which is a disc without radius."""
        height, share, _ = self.at(*place)
        assert share == 1.0
        return height


def test_a_tilting_deck_is_where_a_ray_meets_it(measured: MeasurementCheck) -> None:
    random, met = np.random.default_rng(1), 0
    for _ in range(300):
        centre = random.uniform([-3, -3, 0.1], [3, 3, 0.5])
        attitude = Rotation.from_euler("ZYX", random.uniform([-3, -0.4, -0.4], [3, 0.4, 0.4]))
        point = centre + random.uniform([-0.5, -0.5, 0.4], [0.5, 0.5, 2.0])
        below = Surroundings([vessel(centre, attitude)], [], CALM)
        height = ray(point, centre, attitude)
        met += height is not None
        error = below.distance(*point) - (point[2] - (height or 0.0))
        measured(
            "Wind and current",
            "height above a tilting deck, for ground effect",
            error,
            0.0,
            "m",
            "ray and plane",
            within=1e-12,
        )
    assert 50 < met < 250


def test_a_platform_is_below_when_it_is_under_and_lower() -> None:
    below = Surroundings([], [PLATFORM], CALM)
    assert below.distance(5.9, -0.4, 2.0) == pytest.approx(0.75)
    assert below.distance(6.1, 0.0, 2.0) == 2.0
    assert below.distance(5.0, 0.0, 0.5) == 0.5


def test_the_next_surface_counts() -> None:
    level = Rotation.identity()
    decks = [vessel((5.0, 0.0, height), level) for height in (0.3, 1.4, 3.0)]
    assert Surroundings(decks, [PLATFORM], CALM).distance(5.0, 0.0, 2.0) == pytest.approx(0.6)


def test_an_upside_down_vessel_has_no_deck() -> None:
    below = Surroundings([vessel((0.0, 0.0, 0.3), Rotation.from_euler("x", np.pi))], [], CALM)
    assert below.distance(0.0, 0.0, 1.0) == 1.0


def test_the_water_has_waves_where_they_matter() -> None:
    waves = sea({"sea_state": 3})
    below = Surroundings([], [], waves)
    assert below.distance(3.0, 4.0, 2.0, 5.0, 0.5) == pytest.approx(
        2.0 - 0.5 * waves.elevation(3.0, 4.0, 5.0)
    )
    assert (
        below.distance(3.0, 4.0, MAX_WAVE_EFFECT_HEIGHT + 1.0, 5.0, 0.5)
        == MAX_WAVE_EFFECT_HEIGHT + 1.0
    )
    assert below.distance(3.0, 4.0, -5.0, 5.0, 1.0) == 0.0


def test_a_deck_is_below_the_share_of_a_disc_that_its_edges_leave(
    measured: MeasurementCheck,
) -> None:
    """The level deck turned by 0.7 rad under discs beside one edge or far from all; points at
    random in each disc.
    """
    turned, random = Rotation.from_euler("z", 0.7), np.random.default_rng(3)
    radius = 0.25
    below = Surroundings([vessel((0.0, 0.0, 0.3), turned)], [], CALM, radius)
    angles, lengths = (
        random.uniform(0, 2 * np.pi, 200_000),
        radius * np.sqrt(random.uniform(0, 1, 200_000)),
    )
    disc = np.stack([lengths * np.cos(angles), lengths * np.sin(angles)])
    for forward in (0.0, 0.12, 0.25, 0.35, 0.5, 0.59):
        inside = (np.abs(forward + disc[0]) <= PLATE[0]) & (np.abs(disc[1]) <= PLATE[1])
        x, y, _ = turned.apply([forward, 0.0, 0.0])
        height, share, _ = below.at(x, y, 1.0)
        assert height == pytest.approx(0.7)
        measured(
            "Wind and current",
            "share of a rotor disc above a deck",
            share,
            inside.mean(),
            "1",
            "points at random",
            within=3e-3,
        )
    assert below.at(0.7, 0.7, 1.0)[:2] == (1.0, 1.0)


def test_the_surface_counts_from_the_centre_of_the_rotors() -> None:
    """A vehicle that is upside down: the rotors, 0.1 m above the centre of mass and 0.3 m ahead of
    it, are below.
    """
    below = Surroundings([], [PLATFORM], CALM)
    below.disc[:3] = 0.3, 0.0, 0.1
    below.pose[3:] = Rotation.from_euler("ZYX", [np.pi / 2, 0.0, np.pi]).as_quat(scalar_first=True)
    assert below.distance(5.9, -0.7, 2.0) == pytest.approx(2.0 - 0.1 - 1.25)


def test_the_water_level_is_that_at_the_centre_of_mass_near_the_crests() -> None:
    waves = sea({"sea_state": 3})
    highest, below = waves.highest_elevation, Surroundings([], [], waves, reach=0.5)
    assert below.at(3.0, 4.0, highest + 0.4, 5.0, 0.5)[2] == pytest.approx(
        0.5 * waves.elevation(3.0, 4.0, 5.0), rel=1e-9
    )
    assert below.at(3.0, 4.0, highest + 0.6, 5.0, 0.5)[2] == -highest


@pytest.mark.parametrize("platforms", [[], [PLATFORM]], ids=["water", "platform"])
def test_the_c_code_and_its_casadi_function_agree(platforms: list[Platform]) -> None:
    """Both forms at random attitudes above, beside and below a platform and waves."""
    function, _ = create_surroundings_function()
    random, below = (
        np.random.default_rng(5),
        Surroundings([], platforms, sea({"sea_state": 3}), radius=0.2, reach=0.5),
    )
    below.disc[:3] = 0.05, -0.02, 0.1
    below.sea[:2] = 7.0, 0.8
    for _ in range(300):
        below.pose[:3] = random.uniform([3.5, -1.0, -0.5], [6.5, 1.0, 7.0])
        below.pose[3:] = Rotation.random(rng=random).as_quat(scalar_first=True)
        below.call()
        arguments = [below.arrays[name].ravel() for name in function.name_in()]
        expected = function(*arguments).full().ravel()
        np.testing.assert_allclose(below.result, expected, rtol=1e-12, atol=1e-12)
