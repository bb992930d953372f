"""Sky, far hills, water and banks of the lake, computed per pixel from the viewing rays.

Water reflects the sky and the solids, disturbed by small ripples that fade with distance. The
mirrored picture, rendered from below the surface, gives the solids; a ripple displaces the pixel
that is read from it. Banks are boxes that the rays intersect, which is several times faster than
drawing them as triangles with TinyRenderer.

Colours are red, green and blue in 0 ... 1. World frame, z up, the water at z = 0. Arrays of colours
and directions of n pixels have the shape (3, n), on which NumPy is several times faster than on
(n, 3).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .solid_renderer import AMBIENT, DIFFUSE, SUN, Picture, View


def _colour(red: float, green: float, blue: float) -> np.ndarray:
    return np.array([[red], [green], [blue]], np.float32)


ZENITH_COLOUR, HORIZON_COLOUR = _colour(0.36, 0.58, 0.84), _colour(0.86, 0.91, 0.95)
FAR_HILLS_COLOUR, NEAR_HILLS_COLOUR = _colour(0.62, 0.72, 0.80), _colour(0.45, 0.58, 0.60)
WATER_COLOUR = _colour(0.10, 0.33, 0.40)
HAZE_DISTANCE = 450.0  # m, distance at which haze leaves 1/e of a colour

#: ripples: direction (rad), wave number (1/m), slope
RIPPLES = ((0.4, 2.3, 0.016), (1.5, 3.7, 0.013), (2.6, 5.9, 0.010), (0.9, 9.7, 0.008))

SAND, GRASS = (0.80, 0.73, 0.55), (0.42, 0.55, 0.27)
LAND_HEIGHT = 0.4  # m


class Rays(NamedTuple):
    """Rays through the pixels of a picture.

    Attributes:
        direction: Unit vectors (world axes), shape (3, height, width).
        along_axis: Their components along the axis of the view, shape (height, width).
    """

    direction: np.ndarray
    along_axis: np.ndarray


def pixel_rays(view: View, width: int, height: int) -> Rays:
    """Return the rays through the centres of all pixels."""
    half = math.tan(view.field_of_view / 2)
    right = (2 * (np.arange(width, dtype=np.float32) + 0.5) / width - 1) * half * width / height
    up = (1 - 2 * (np.arange(height, dtype=np.float32) + 0.5) / height) * half
    axes = view.axes().astype(np.float32)[:, :, None, None]
    along_axis = 1 / np.sqrt(1 + right**2 + up[:, None] ** 2)
    return Rays((axes[0] * right + axes[1] * up[:, None] + axes[2]) * along_axis, along_axis)


def sky_colour(direction: np.ndarray) -> np.ndarray:
    """Return the colours (3, n) of the sky and two ranges of hills in the directions (3, n)."""
    x, y, z = direction
    elevation = np.maximum(z, 0)
    colour: np.ndarray = HORIZON_COLOUR + (ZENITH_COLOUR - HORIZON_COLOUR) * np.sqrt(
        np.minimum(elevation * 1.4, 1)
    )
    # negative indices count from the end
    index = (np.arctan2(y, x) * (AZIMUTHS.size / (2 * math.pi))).astype(np.int32)
    for ridge, tint in HILL_RANGES:
        colour += (tint - colour) * np.clip((ridge[index] - elevation) * 700 + 0.5, 0, 1)
    return colour


def _ridge(azimuth: np.ndarray, phase: float, height: float) -> np.ndarray:
    """Return the sine of the elevation of a range of hills at each azimuth (rad)."""
    waves = (
        np.sin(2 * azimuth + phase)
        + 0.5 * np.sin(5 * azimuth + 2 * phase)
        + 0.2 * np.sin(13 * azimuth + 3 * phase)
    )
    elevation: np.ndarray = height * (0.75 + 0.25 * waves)
    return elevation


#: table of azimuths (rad), finer than the pixels
AZIMUTHS = np.linspace(0, 2 * math.pi, 8192, endpoint=False, dtype=np.float32)
HILL_RANGES = (
    (_ridge(AZIMUTHS, 3.0, 0.075), FAR_HILLS_COLOUR),
    (_ridge(AZIMUTHS, 7.0, 0.045), NEAR_HILLS_COLOUR),
)


def horizon_row(light: Rays) -> int:
    """Return the first row of a picture whose rays meet the water; views have no roll angle."""
    return int((light.direction[2, :, 0] >= 0).sum())


def water_distance(view: View, light: Rays) -> np.ndarray:
    """Return the depth of the water along the axis of the view per pixel (m).

    Infinite above the horizon.
    """
    down = light.direction[2]
    with np.errstate(divide="ignore"):
        distance = np.where(down < 0, -np.float32(view.eye[2]) / down, np.float32(np.inf))
    depth: np.ndarray = distance * light.along_axis
    return depth


class WaterPixels(NamedTuple):
    """The n pixels of a picture that show water.

    The mirrored picture shows the solids from below the water surface; it gives the colours of
    their reflections.

    Attributes:
        sources: For each pixel the flat index of the pixel of the mirrored picture that it
            reflects, shape (n,).
        sky: Colour of the reflected sky, shape (3, n).
        reflectance: Fraction of light that the water reflects, shape (n,).
    """

    sources: np.ndarray
    sky: np.ndarray
    reflectance: np.ndarray

    def select(self, indices: np.ndarray) -> WaterPixels:
        """Return the pixels at `indices`."""
        return WaterPixels(*(values[..., indices] for values in self))

    def colour(self, mirrored: np.ndarray, alpha: np.ndarray) -> np.ndarray:
        """Return the colours (3, n) with the reflections of a mirrored picture.

        Args:
            mirrored: Colour of the mirrored solids, premultiplied by alpha, shape (height, width,
                3).
            alpha: Opacity of the mirrored solids, shape (height, width).

        Returns:
            Colours, shape (3, n).
        """
        solids, hidden = mirrored.reshape(-1, 3)[self.sources].T, alpha.ravel()[self.sources]
        colour: np.ndarray = (
            WATER_COLOUR + (solids + self.sky * (1 - hidden) - WATER_COLOUR) * self.reflectance
        )
        return colour


def water_pixels(view: View, light: Rays, horizon: int) -> WaterPixels:
    """Return the water in all pixels of the rows from `horizon` on.

    The reflectance follows Schlick, "An Inexpensive BRDF Model for Physically-based Rendering",
    Computer Graphics Forum 13 (1994): R + (1 - R) (1 - cos)^5 with the angle of incidence.
    """
    height, width = light.along_axis.shape
    x, y, z = light.direction[:, horizon:].reshape(3, -1)
    reach = -float(view.eye[2]) / np.minimum(z, -1e-4)
    slope_x, slope_y = _ripples(
        float(view.eye[0]) + reach * x, float(view.eye[1]) + reach * y, reach
    )
    tilt = x * slope_x + y * slope_y
    reflected = np.stack([x - 2 * slope_x * z, y - 2 * slope_y * z, -z - 2 * tilt])
    share = 0.06 + 0.94 * (1 - np.clip(tilt - z, 0, 1)) ** 5
    return WaterPixels(
        _reflected_pixels(tilt.reshape(-1, width), height), sky_colour(reflected), share
    )


def _reflected_pixels(tilt: np.ndarray, height: int) -> np.ndarray:
    """Return flat indices of the mirrored, upside-down picture that the water reflects.

    They are displaced by the tilt of the surface. `tilt` belongs to the lowest rows of the picture,
    shape (rows, width).
    """
    count, width = tilt.shape
    rows = np.arange(height - count, height, dtype=np.int32)[:, None] + np.rint(
        tilt * (1.2 * height)
    ).astype(np.int32)
    indices: np.ndarray = (height - 1 - np.clip(rows, 0, height - 1)) * width + np.arange(
        width, dtype=np.int32
    )
    return indices.ravel()


def _ripples(x: np.ndarray, y: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the slopes of the surface along x and y at positions (m).

    Ripples too short for the pixels fade out.
    """
    slope_x, slope_y = np.zeros_like(x), np.zeros_like(x)
    for angle, number, slope in RIPPLES:
        wave = (
            slope
            * np.exp(-((distance * number / 120) ** 2))
            * np.cos(number * (x * math.cos(angle) + y * math.sin(angle)))
        )
        slope_x += wave * math.cos(angle)
        slope_y += wave * math.sin(angle)
    return slope_x, slope_y


class LandBox(NamedTuple):
    """Box of land between two corners (m, world) with a colour."""

    low: Sequence[float]
    high: Sequence[float]
    colour: Sequence[float]


def bank(west: float, south: float, east: float, north: float, beach: float = 1.2) -> list[LandBox]:
    """Return a rectangle of grass between bounds (m, world) and its beach, `beach` (m) wide."""
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
    """Return flat indices of the pixels whose rays meet `step`.

    They are above it at the level of the water or of the land.
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

    A ray enters a box at the last of the three planes on its near side and leaves it at the first
    of those on its far side (Kay and Kajiya, "Ray Tracing Complex Scenes", SIGGRAPH 1986).
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
