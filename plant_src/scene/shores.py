"""Banks of the lake, drawn by intersecting viewing rays with boxes of land.

This is several times faster than drawing them as triangles with TinyRenderer. World frame, z up,
the water at z = 0.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .cameras import View
from .sky_and_water import Rays
from .solid_renderer import AMBIENT, DIFFUSE, SUN, Picture

SAND, GRASS = (0.80, 0.73, 0.55), (0.42, 0.55, 0.27)
LAND_HEIGHT = 0.4  # m


class LandBox(NamedTuple):
    """Box of land between two corners (m, world) with a colour."""

    low: Sequence[float]
    high: Sequence[float]
    colour: Sequence[float]


def bank(west: float, south: float, east: float, north: float, beach: float = 1.2) -> list[LandBox]:
    """Return a rectangle of grass with its bounds (m, world) and the sand around it, `beach` (m) wide."""
    sand = LandBox((west - beach, south - beach, 0.0), (east + beach, north + beach, 0.12), SAND)
    return [sand, LandBox((west, south, 0.0), (east, north, LAND_HEIGHT), GRASS)]


#: north and west of the lake
BANKS = (bank(-700.0, 34.0, 700.0, 634.0), bank(-720.0, -700.0, -20.0, 700.0))


def add_land(picture: Picture, view: View, light: Rays) -> None:
    """Draw the banks into `picture` where they are nearer than its depth.

    `light` are the rays through its pixels.
    """
    for steps in BANKS:
        pixels = _candidate_pixels(view.eye, light.direction, steps[0])
        for step in steps:
            _draw_box(picture, step, view.eye, light, pixels)


def _candidate_pixels(eye: np.ndarray, direction: np.ndarray, step: LandBox) -> np.ndarray:
    """Return flat indices of the pixels whose rays are above `step` at the level of the water or of the land.

    Rays that cross only a corner of the box are missed.
    """
    candidates = np.zeros(direction.shape[1:], bool)
    for level in (0.0, LAND_HEIGHT):
        with np.errstate(divide="ignore", invalid="ignore"):
            reach = (level - float(eye[2])) / direction[2]
            x, y = (float(eye[i]) + reach * direction[i] for i in (0, 1))
        candidates |= (
            (reach > 0)
            & (x > step.low[0])
            & (x < step.high[0])
            & (y > step.low[1])
            & (y < step.high[1])
        )
    return np.flatnonzero(candidates)


def _draw_box(
    picture: Picture, step: LandBox, eye: np.ndarray, light: Rays, pixels: np.ndarray
) -> None:
    """Draw `step` into the `pixels` where it is nearest.

    A ray enters a box at the last of the three planes on its near side.
    """
    direction = light.direction.reshape(3, -1)[:, pixels]
    low, high = (np.asarray(corner - eye, np.float32)[:, None] for corner in (step.low, step.high))
    with np.errstate(divide="ignore"):
        planes = np.where(direction > 0, low, high) / direction
        ends = np.where(direction > 0, high, low) / direction
    entry = planes.max(axis=0)
    depth = entry * light.along_axis.ravel()[pixels]
    nearest = np.flatnonzero(
        (entry < ends.min(axis=0)) & (entry > 0) & (depth < picture.depth.ravel()[pixels])
    )
    side = planes[:, nearest].argmax(axis=0)
    facing = -np.sign(direction[side, nearest]) * np.asarray(SUN, np.float32)[side]
    shade = AMBIENT + DIFFUSE * np.maximum(0, facing)
    picture.depth.reshape(-1)[pixels[nearest]] = depth[nearest]
    picture.colour.reshape(-1, 3)[pixels[nearest]] = np.rint(
        255 * np.minimum(shade[:, None] * np.asarray(step.colour), 1)
    )
