"""Which vehicles come near something: the geometry that decides whether Bullet takes part."""

from __future__ import annotations

import numpy as np
import pytest

from plant_src.physics.clearance import NEAR_DISTANCE, BoundingBox, Clearance

CUBE = BoundingBox((-0.5, -0.5, -0.5), (0.5, 0.5, 0.5))  # 1 m wide


class Places:
    """Vehicles of 1 m and a platform, from `starts` to `ends` in one step."""

    def __init__(self, starts: list[list[float]], platforms: tuple[BoundingBox, ...] = ()):
        count = len(starts)
        self.path, self.anchor, self.leash = np.zeros((count, 2, 3)), np.zeros((count, 3)), np.zeros((count, 3))
        self.path[:] = np.array(starts)[:, None]
        arrays = (array.reshape(-1) for array in (self.path, self.anchor, self.leash))
        self.clearance = Clearance([CUBE] * count, platforms, *arrays)

    def survey(self) -> list[bool]:
        return self.clearance.find_near_vehicles()


@pytest.mark.parametrize(
    ("gap", "near"), [(-0.3, True), (0.99 * NEAR_DISTANCE, True), (1.01 * NEAR_DISTANCE, False), (5.0, False)]
)
@pytest.mark.parametrize("axis", [0, 1, 2])
def test_two_vehicles_are_near_each_other_or_not(gap: float, near: bool, axis: int) -> None:
    other = [0.2, 0.2, 0.2]
    other[axis] = -1 - gap
    assert Places([[0.0, 0.0, 0.0], other]).survey() == [near, near]


def test_a_platform_is_something_to_be_near_to() -> None:
    floor = BoundingBox((-9.0, -9.0, -2.0), (9.0, 9.0, -1.0))
    assert Places([[0.0, 0.0, -0.48], [3.0, 0.0, 0.0]], (floor,)).survey() == [True, False]


def test_what_is_passed_within_the_step_is_near() -> None:
    places = Places([[0.0, 0.0, 0.0], [5.0, 0.0, 0.0]])
    places.path[0, 1] = [10.0, 0.0, 0.0]
    assert places.survey() == [True, True]


def test_a_vehicle_alone_may_go_anywhere() -> None:
    places = Places([[0.0, 0.0, 0.0]])
    assert places.survey() == [False]
    assert np.isinf(places.leash).all()


def test_vehicles_share_the_way_and_a_platform_leaves_all_of_it() -> None:
    wall = BoundingBox((-3.5, -9.0, -9.0), (-2.5, 9.0, 9.0))  # 2 m from the first vehicle
    places = Places([[0.0, 0.0, 0.0], [7.0, 1.0, 0.0]], (wall,))  # 6 m from each other
    places.survey()
    assert places.leash[0].tolist() == [2 - NEAR_DISTANCE, np.inf, np.inf]
    assert places.leash[1].tolist() == [3 - NEAR_DISTANCE / 2, np.inf, np.inf]


def test_nothing_comes_near_while_all_keep_to_their_leashes() -> None:
    random = np.random.default_rng(1)
    far = 0
    for _ in range(200):
        places = Places(random.uniform(-3, 3, (4, 3)).tolist(), (BoundingBox((-1.0, -1.0, -4.0), (1.0, 1.0, -3.5)),))
        if any(places.survey()):
            continue
        reach = np.minimum(places.leash, 10.0)
        places.path[:] = places.anchor[:, None] + random.choice([-1, 0, 1], (4, 2, 3)) * reach[:, None] * (1 - 1e-12)
        assert not any(places.survey())
        far += 1
    assert far > 20


def test_what_holds_is_what_a_survey_would_find_again() -> None:
    """Random places about the threshold: near pairs hold exactly as long as the survey says so."""
    random, floor = np.random.default_rng(2), BoundingBox((-9.0, -9.0, -2.0), (9.0, 9.0, -1.0))
    seen = set()
    for _ in range(300):
        places = Places([[0.0, 0.0, -0.5 + NEAR_DISTANCE / 2], [0.0, 0.0, 0.5 + NEAR_DISTANCE]], (floor,))
        before = places.survey()
        places.path += random.uniform(-NEAR_DISTANCE / 2, NEAR_DISTANCE / 2, places.path.shape)
        held = places.clearance.is_valid()
        pairs = places.clearance._near_pairs
        seen.add((held, before == places.survey()))
        assert held == set(map(tuple, pairs)).issubset(map(tuple, places.clearance._near_pairs))
    assert len(seen) > 1


def test_nothing_holds_before_a_survey_or_after_vehicles_were_placed() -> None:
    places = Places([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert not places.clearance.is_valid()
    places.survey()
    assert places.clearance.is_valid()
    places.clearance.invalidate()
    assert not places.clearance.is_valid()
