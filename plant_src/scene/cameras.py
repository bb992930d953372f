"""Cameras by name: where each looks from, given the mission and the moment."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..physics.client import pybullet
from .mission import Mission

NEAR, FAR = 0.4, 900.0  # m
UP = np.array([0.0, 0.0, 1.0])


class Window(NamedTuple):
    """Pixels of a picture from left (top) up to and without right (bottom)."""

    left: int
    right: int
    top: int
    bottom: int


@dataclass(frozen=True)
class View:
    """A place to look from and a place to look at (m, world), and the vertical opening angle (rad)."""

    eye: np.ndarray
    target: np.ndarray
    field_of_view: float = 0.6

    def matrix(self) -> list[float]:
        """World to camera, as Bullet and OpenGL want it."""
        return list(pybullet.computeViewMatrix(self.eye.tolist(), self.target.tolist(), UP.tolist()))

    def projection(self, width: int, height: int, window: Window) -> list[float]:
        """Camera to a window of a picture of that size."""
        pixel = 2 * NEAR * math.tan(self.field_of_view / 2) / height
        left, right = ((x - width / 2) * pixel for x in (window.left, window.right))
        bottom, top = ((height / 2 - y) * pixel for y in (window.bottom, window.top))
        return list(pybullet.computeProjectionMatrix(left, right, bottom, top, NEAR, FAR))

    def axes(self) -> np.ndarray:
        """Right, up and forward of the camera in the world, shape (3, 3), one a row."""
        forward = (self.target - self.eye) / np.linalg.norm(self.target - self.eye)
        right = np.cross(forward, UP)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def pixels(self, places: np.ndarray, width: int, height: int) -> np.ndarray:
        """Where `places` (n, 3) in front of the camera appear in a picture: pixels from the left and from the top, (n, 2)."""
        right, up, forward = ((places - self.eye) @ self.axes().T).T
        scale = height / (2 * math.tan(self.field_of_view / 2))
        return np.stack([width / 2 + scale * right / forward, height / 2 - scale * up / forward], axis=1)

    def bounding_window(self, centres: np.ndarray, radii: np.ndarray, width: int, height: int) -> Window:
        """The part of a picture that holds all balls with `centres` (n, 3) and `radii` (n,) as far as they are seen."""
        places = (centres - self.eye) @ self.axes().T
        seen = self._in_frustum(places, radii, width / height)
        if not seen.any():
            return Window(0, 0, 0, 0)
        (right, up, forward), radii = places[seen].T, radii[seen]
        if (forward - radii).min() <= NEAR:
            return Window(0, width, 0, height)
        scale = height / (2 * math.tan(self.field_of_view / 2))
        across, down = (_tangent_range(values, radii, forward) * scale for values in (right, -up))
        return Window(*_pixel_range(across, width), *_pixel_range(down, height))

    def _in_frustum(self, places: np.ndarray, radii: np.ndarray, aspect: float) -> np.ndarray:
        """Which balls at `places` (n, 3), camera axes, reach into the pyramid that the picture shows."""
        right, up, forward = places.T
        upwards, sideways = self.field_of_view / 2, math.atan(aspect * math.tan(self.field_of_view / 2))
        seen = forward + radii > NEAR
        for distance, angle in ((np.abs(right), sideways), (np.abs(up), upwards)):
            seen &= distance * math.cos(angle) - forward * math.sin(angle) < radii
        return seen

    def mirrored(self) -> View:
        """The view from below the water whose picture, upside down, is what the water reflects."""
        flip = np.array([1.0, 1.0, -1.0])
        return View(self.eye * flip, self.target * flip, self.field_of_view)


def _tangent_range(sideways: np.ndarray, radii: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Smallest and largest tangent of the angles under which balls appear."""
    ends = np.stack([sideways - radii, sideways + radii])
    tangents = np.stack([ends / (forward - radii), ends / (forward + radii)])
    return np.array([tangents.min(), tangents.max()])


def _pixel_range(spread: np.ndarray, count: int) -> list[int]:
    """The range of pixels about the middle of `count` that holds a spread of pixels."""
    low, high = np.clip([math.floor(spread[0] + count / 2) - 1, math.ceil(spread[1] + count / 2) + 1], 0, count).tolist()
    return [low, high]


def overview(mission: Mission, row: int) -> View:
    """All paths, from high in the south-east; keeps still."""
    return _framing_view(mission.positions().reshape(-1, 3), np.array([0.45, -0.8, 0.27]), 0.8)


def chase(mission: Mission, row: int) -> View:
    """Quadcopter and vessel, followed from the south at a constant distance."""
    places = mission.positions()[:, row]
    centre = places.mean(axis=0)
    spread = float(np.linalg.norm(places - centre, axis=1).max())
    return View(centre + (2.4 + 1.3 * spread) * np.array([0.55, -1.0, 0.36]), centre)


def deck(mission: Mission, row: int) -> View:
    """The landing deck, from behind and above on the vessel itself."""
    place, yaw = mission.vessel_positions()[row], mission.vessel_yaw(row)
    heading = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    return View(place - 2.6 * heading + 1.5 * UP, place + 0.2 * heading + 0.45 * UP, 0.75)


def landing(mission: Mission, row: int) -> View:
    """The last seconds before the touchdown, from the side; keeps still."""
    rows = mission.landing_rows()
    places = mission.positions()[:, rows].reshape(-1, 3)
    travel = mission.vessel_positions()[rows[-1]] - mission.vessel_positions()[rows[0]]
    side = np.array([travel[1], -travel[0], 0.0])
    length = float(np.linalg.norm(side))
    side = side / length if length > 0.5 else np.array([0.4, -0.92, 0.0])
    if side[1] > 0:  # with the trees behind
        side = -side
    return _framing_view(places, side + 0.24 * UP, 0.45)


def _framing_view(places: np.ndarray, direction: np.ndarray, margin: float, angle: float = 0.6) -> View:
    """A view from `direction` that holds all `places` (n, 3), and `margin` (m) more, in a picture twice as wide as high."""
    centre = (places.min(axis=0) + places.max(axis=0)) / 2
    away = direction / np.linalg.norm(direction)
    camera = View(centre + away, centre, angle).axes()
    right, up, forward = np.abs((places - centre) @ camera.T).max(axis=0) + margin
    distance = max(up / math.tan(angle / 2), right / (2 * math.tan(angle / 2))) + forward
    return View(centre + distance * away, centre, angle)


CAMERAS: Mapping[str, Callable[[Mission, int], View]] = {
    "overview": overview,
    "chase": chase,
    "deck": deck,
    "landing": landing,
}
