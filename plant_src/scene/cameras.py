"""Views of a scene, and named cameras that follow a mission."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..physics.client import pybullet
from .mission import Mission

NEAR, FAR = 0.4, 900.0  # m, clipping planes
UP = np.array([0.0, 0.0, 1.0])


class Window(NamedTuple):
    """Rectangle of pixels; `right` and `bottom` are exclusive."""

    left: int
    right: int
    top: int
    bottom: int


@dataclass(frozen=True)
class View:
    """Perspective view from `eye` to `target` (m, world) with a vertical `field_of_view` (rad)."""

    eye: np.ndarray
    target: np.ndarray
    field_of_view: float = 0.6

    def matrix(self) -> list[float]:
        """Return the view matrix (world to camera) as OpenGL and Bullet define it, 16 numbers column by column."""
        return list(
            pybullet.computeViewMatrix(self.eye.tolist(), self.target.tolist(), UP.tolist())
        )

    def projection(self, width: int, height: int, window: Window) -> list[float]:
        """Return the projection matrix of a window of a picture of `width` by `height` pixels, 16 numbers column by column."""
        pixel = 2 * NEAR * math.tan(self.field_of_view / 2) / height
        left, right = ((x - width / 2) * pixel for x in (window.left, window.right))
        bottom, top = ((height / 2 - y) * pixel for y in (window.bottom, window.top))
        return list(pybullet.computeProjectionMatrix(left, right, bottom, top, NEAR, FAR))

    def axes(self) -> np.ndarray:
        """Return the right, up and forward axes of the camera in the world, shape (3, 3), one axis per row."""
        forward = (self.target - self.eye) / np.linalg.norm(self.target - self.eye)
        right = np.cross(forward, UP)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, forward), forward])

    def pixels(self, points: np.ndarray, width: int, height: int) -> np.ndarray:
        """Project points (m, world), shape (n, 3), in front of the camera to pixels from the left and the top, shape (n, 2)."""
        right, up, forward = ((points - self.eye) @ self.axes().T).T
        scale = height / (2 * math.tan(self.field_of_view / 2))
        return np.stack(
            [width / 2 + scale * right / forward, height / 2 - scale * up / forward], axis=1
        )

    def bounding_window(
        self, centres: np.ndarray, radii: np.ndarray, width: int, height: int
    ) -> Window:
        """Return the smallest window that contains the visible parts of spheres.

        Args:
            centres: Centres of the spheres (m, world), shape (n, 3).
            radii: Radii of the spheres (m), shape (n,).
            width: Width of the picture (pixels).
            height: Height of the picture (pixels).

        Returns:
            The window; empty if no sphere is visible.
        """
        positions = (centres - self.eye) @ self.axes().T
        visible = self._in_frustum(positions, radii, width / height)
        if not visible.any():
            return Window(0, 0, 0, 0)
        (right, up, forward), radii = positions[visible].T, radii[visible]
        if (forward - radii).min() <= NEAR:
            return Window(0, width, 0, height)
        scale = height / (2 * math.tan(self.field_of_view / 2))
        across, down = (_tangent_range(values, radii, forward) * scale for values in (right, -up))
        return Window(*_pixel_range(across, width), *_pixel_range(down, height))

    def _in_frustum(self, positions: np.ndarray, radii: np.ndarray, aspect: float) -> np.ndarray:
        """Return a mask (n,) of the spheres at `positions` (n, 3), camera axes, that intersect the viewing frustum."""
        right, up, forward = positions.T
        upwards, sideways = (
            self.field_of_view / 2,
            math.atan(aspect * math.tan(self.field_of_view / 2)),
        )
        visible: np.ndarray = forward + radii > NEAR
        for distance, angle in ((np.abs(right), sideways), (np.abs(up), upwards)):
            visible &= distance * math.cos(angle) - forward * math.sin(angle) < radii
        return visible

    def mirrored(self) -> View:
        """Return the view mirrored at the water.

        Its picture, upside down, is the reflection in the water.
        """
        flip = np.array([1.0, 1.0, -1.0])
        return View(self.eye * flip, self.target * flip, self.field_of_view)


def _tangent_range(sideways: np.ndarray, radii: np.ndarray, forward: np.ndarray) -> np.ndarray:
    """Return the smallest and largest tangent of the viewing angles of spheres."""
    ends = np.stack([sideways - radii, sideways + radii])
    tangents = np.stack([ends / (forward - radii), ends / (forward + radii)])
    return np.array([tangents.min(), tangents.max()])


def _pixel_range(spread: np.ndarray, count: int) -> list[int]:
    """Return the pixels (first, end) out of `count` that contain a `spread` of pixels relative to the middle."""
    low, high = np.clip(
        [math.floor(spread[0] + count / 2) - 1, math.ceil(spread[1] + count / 2) + 1], 0, count
    ).tolist()
    return [low, high]


def overview(mission: Mission, _row: int) -> View:
    """Return a fixed view of all paths from above in the south-east."""
    return _framing_view(mission.positions().reshape(-1, 3), np.array([0.45, -0.8, 0.27]), 0.8)


def chase(mission: Mission, row: int) -> View:
    """Return a view from the south that follows the vehicles; its distance grows with theirs."""
    positions = mission.positions()[:, row]
    centre = positions.mean(axis=0)
    spread = float(np.linalg.norm(positions - centre, axis=1).max())
    return View(centre + (2.4 + 1.3 * spread) * np.array([0.55, -1.0, 0.36]), centre)


def deck(mission: Mission, row: int) -> View:
    """Return a view of the landing deck from behind and above, fixed to the vessel."""
    position, yaw = mission.vessel_positions()[row], mission.vessel_yaw(row)
    heading = np.array([math.cos(yaw), math.sin(yaw), 0.0])
    return View(position - 2.6 * heading + 1.5 * UP, position + 0.2 * heading + 0.45 * UP, 0.75)


def landing(mission: Mission, _row: int) -> View:
    """Return a fixed view from the side of the last seconds before touchdown."""
    rows = mission.landing_rows()
    positions = mission.positions()[:, rows].reshape(-1, 3)
    travel = mission.vessel_positions()[rows[-1]] - mission.vessel_positions()[rows[0]]
    side = np.array([travel[1], -travel[0], 0.0])
    length = float(np.linalg.norm(side))
    side = side / length if length > 0.5 else np.array([0.4, -0.92, 0.0])
    if side[1] > 0:  # look north, where the trees are
        side = -side
    return _framing_view(positions, side + 0.24 * UP, 0.45)


def _framing_view(
    positions: np.ndarray, direction: np.ndarray, margin: float, angle: float = 0.6
) -> View:
    """Return a view from `direction` that shows all positions (n, 3) plus `margin` (m) in a picture with aspect ratio 2."""
    centre = (positions.min(axis=0) + positions.max(axis=0)) / 2
    away = direction / np.linalg.norm(direction)
    camera = View(centre + away, centre, angle).axes()
    right, up, forward = np.abs((positions - centre) @ camera.T).max(axis=0) + margin
    distance = max(up / math.tan(angle / 2), right / (2 * math.tan(angle / 2))) + forward
    return View(centre + distance * away, centre, angle)


CAMERAS: Mapping[str, Callable[[Mission, int], View]] = {
    "overview": overview,
    "chase": chase,
    "deck": deck,
    "landing": landing,
}
