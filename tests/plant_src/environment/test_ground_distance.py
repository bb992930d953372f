"""Ground distance of multirotors against rays and planes in NumPy."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from plant_validation import MeasurementCheck
from scipy.spatial.transform import Rotation

from plant_src.catalogue import MODELS
from plant_src.environment import sea
from plant_src.environment.ground_distance import MAX_WAVE_EFFECT_HEIGHT, GroundDistance
from plant_src.environment.sea import CALM
from plant_src.placement import Platform

STRIDER = MODELS["strider"]
PLATE = np.array([0.701, 0.602]) / 2  # m, half edges of the deck
PLATFORM = Platform("start", (2.0, 1.0, 0.5), (5.0, 0.0, 1.0))


def vessel(centre: Any, attitude: Rotation) -> Any:
    """A vessel that publishes this deck centre and attitude, as the contact bodies of a world do."""
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


def test_a_tilting_deck_is_where_a_ray_meets_it(measured: MeasurementCheck) -> None:
    random, met = np.random.default_rng(1), 0
    for _ in range(300):
        centre = random.uniform([-3, -3, 0.1], [3, 3, 0.5])
        attitude = Rotation.from_euler("ZYX", random.uniform([-3, -0.4, -0.4], [3, 0.4, 0.4]))
        point = centre + random.uniform([-0.5, -0.5, 0.4], [0.5, 0.5, 2.0])
        below = GroundDistance([vessel(centre, attitude)], [], CALM)
        height = ray(point, centre, attitude)
        met += height is not None
        error = below.distance(*point, 0.0, 1.0) - (point[2] - (height or 0.0))
        measured(
            "Wind and current", "height above a tilting deck, for ground effect", error, 0.0, "m", "ray and plane", within=1e-12
        )
    assert 50 < met < 250


def test_a_platform_is_below_when_it_is_under_and_lower() -> None:
    below = GroundDistance([], [PLATFORM], CALM)
    assert below.distance(5.9, -0.4, 2.0, 0.0, 1.0) == pytest.approx(0.75)
    assert below.distance(6.1, 0.0, 2.0, 0.0, 1.0) == 2.0
    assert below.distance(5.0, 0.0, 0.5, 0.0, 1.0) == 0.5


def test_the_next_surface_counts() -> None:
    level = Rotation.identity()
    decks = [vessel((5.0, 0.0, height), level) for height in (0.3, 1.4, 3.0)]
    assert GroundDistance(decks, [PLATFORM], CALM).distance(5.0, 0.0, 2.0, 0.0, 1.0) == pytest.approx(0.6)


def test_an_upside_down_vessel_has_no_deck() -> None:
    below = GroundDistance([vessel((0.0, 0.0, 0.3), Rotation.from_euler("x", np.pi))], [], CALM)
    assert below.distance(0.0, 0.0, 1.0, 0.0, 1.0) == 1.0


def test_the_water_has_waves_where_they_matter() -> None:
    waves = sea({"sea_state": 3})
    below = GroundDistance([], [], waves)
    assert below.distance(3.0, 4.0, 2.0, 5.0, 0.5) == pytest.approx(2.0 - 0.5 * waves.elevation(3.0, 4.0, 5.0))
    assert below.distance(3.0, 4.0, MAX_WAVE_EFFECT_HEIGHT + 1.0, 5.0, 0.5) == MAX_WAVE_EFFECT_HEIGHT + 1.0
    assert below.distance(3.0, 4.0, -5.0, 5.0, 1.0) == 0.0
