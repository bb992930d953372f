"""Clearance: detection of near vehicles, which decides whether Bullet takes part."""

from __future__ import annotations

import numpy as np
import pytest

from plant_src.physics.clearance import NEAR_DISTANCE, BoundingBox, Clearance

CUBE = BoundingBox((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))  # 1 m wide


class Places:
    """Vehicles of 1 m, at rest unless `endpoints` is changed, and platforms."""

    def __init__(self, starts: list[list[float]], platforms: tuple[BoundingBox, ...] = ()):
        count = len(starts)
        self.endpoints, self.reference_position = np.zeros((count, 2, 3)), np.zeros((count, 3))
        self.safe_distance = np.zeros((count, 3))
        self.endpoints[:] = np.array(starts)[:, None]
        arrays = (
            array.reshape(-1)
            for array in (self.endpoints, self.reference_position, self.safe_distance)
        )
        self.clearance = Clearance([CUBE] * count, platforms, *arrays)

    def near_vehicles(self) -> list[bool]:
        return self.clearance.find_near_vehicles()


@pytest.mark.parametrize(
    ("gap", "near"),
    [(-0.3, True), (0.99 * NEAR_DISTANCE, True), (1.01 * NEAR_DISTANCE, False), (5.0, False)],
)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_two_vehicles_are_near_each_other_or_not(gap: float, near: bool, axis: int) -> None:
    other = [0.2, 0.2, 0.2]
    other[axis] = -1 - gap
    assert Places([[0.0, 0.0, 0.0], other]).near_vehicles() == [near, near]


def test_a_vehicle_can_be_near_a_platform() -> None:
    floor = BoundingBox((-9.0, -9.0, -2.0), (9.0, 9.0, -1.0))
    assert Places([[0.0, 0.0, -0.48], [3.0, 0.0, 0.0]], (floor,)).near_vehicles() == [True, False]


def test_an_obstacle_passed_within_the_step_is_near() -> None:
    places = Places([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    places.endpoints[0, 1] = [10.0, 0.0, 0.0]
    assert places.near_vehicles() == [True, True]


def test_a_single_vehicle_has_infinite_safe_distances() -> None:
    places = Places([[0.0, 0.0, 0.0]])
    assert places.near_vehicles() == [False]
    assert np.isinf(places.safe_distance).all()


def test_two_vehicles_share_the_gap_and_a_platform_leaves_all_of_it() -> None:
    wall = BoundingBox((-3.5, -9.0, -9.0), (-2.5, 9.0, 9.0))  # 2 m from the first vehicle
    places = Places([[0.0, 0.0, 0.0], [7.0, 1.0, 0.0]], (wall,))  # 6 m from each other
    places.near_vehicles()
    assert places.safe_distance[0].tolist() == [2 - NEAR_DISTANCE, np.inf, np.inf]
    assert places.safe_distance[1].tolist() == [3 - NEAR_DISTANCE / 2, np.inf, np.inf]


def test_nothing_comes_near_within_the_safe_distances() -> None:
    random = np.random.default_rng(1)
    far = 0
    for _ in range(200):
        places = Places(
            random.uniform(-3, 3, (4, 3)).tolist(),
            (BoundingBox((-1.0, -1.0, -4.0), (1.0, 1.0, -3.5)),),
        )
        if any(places.near_vehicles()):
            continue
        reach = np.minimum(places.safe_distance, 10.0)
        places.endpoints[:] = places.reference_position[:, None] + random.choice(
            [-1, 0, 1], (4, 2, 3)
        ) * reach[:, None] * (1 - 1e-12)
        assert not any(places.near_vehicles())
        far += 1
    assert far > 20


def test_a_search_is_valid_exactly_as_long_as_its_near_pairs_are_near() -> None:
    """Random places about the threshold."""
    random, floor = np.random.default_rng(2), BoundingBox((-9.0, -9.0, -2.0), (9.0, 9.0, -1.0))
    seen = set()
    for _ in range(300):
        places = Places(
            [[0.0, 0.0, -0.5 + NEAR_DISTANCE / 2], [0.0, 0.0, 0.5 + NEAR_DISTANCE]], (floor,)
        )
        before = places.near_vehicles()
        places.endpoints += random.uniform(
            -NEAR_DISTANCE / 2, NEAR_DISTANCE / 2, places.endpoints.shape
        )
        valid = places.clearance.is_valid()
        pairs = places.clearance.near_pairs
        seen.add((valid, before == places.near_vehicles()))
        assert valid == set(map(tuple, pairs)).issubset(map(tuple, places.clearance.near_pairs))
    assert len(seen) > 1


def test_a_search_is_invalid_before_the_first_one_and_after_vehicles_were_moved() -> None:
    places = Places([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert not places.clearance.is_valid()
    places.near_vehicles()
    assert places.clearance.is_valid()
    places.clearance.invalidate()
    assert not places.clearance.is_valid()
