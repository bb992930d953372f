"""Sky, far hills and water as functions of where a ray goes; they are painted per pixel, so that nothing in them flickers.

Water reflects the sky and the solids (whose mirror image is drawn from below the surface), disturbed by small ripples that
fade with distance. Colours are linear mixes of red, green and blue in 0 ... 1; frame: world, z up, the water at z = 0.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from .cameras import View

ZENITH, HORIZON = np.array([0.36, 0.58, 0.84], np.float32), np.array([0.86, 0.91, 0.95], np.float32)
HILLS_FAR, HILLS_NEAR = np.array([0.62, 0.72, 0.80], np.float32), np.array([0.45, 0.58, 0.60], np.float32)
DEEP = np.array([0.10, 0.33, 0.40], np.float32)
HAZE = 450.0  # m, distance at which a solid keeps 1/e of its colour

#: ripples: direction (rad), wave number (1/m), slope
RIPPLES = ((0.4, 2.3, 0.016), (1.5, 3.7, 0.013), (2.6, 5.9, 0.010), (0.9, 9.7, 0.008))


class Rays(NamedTuple):
    """Unit vectors through the pixels (height, width, 3), and how much of each is along the view's axis (height, width)."""

    direction: np.ndarray
    along_axis: np.ndarray


def rays(view: View, width: int, height: int) -> Rays:
    """Rays through the centres of all pixels."""
    half = math.tan(view.angle / 2)
    right = (2 * (np.arange(width, dtype=np.float32) + 0.5) / width - 1) * half * width / height
    up = (1 - 2 * (np.arange(height, dtype=np.float32) + 0.5) / height) * half
    axes = view.axes().astype(np.float32)
    through = right[None, :, None] * axes[0] + up[:, None, None] * axes[1] + axes[2]
    length = np.sqrt((through**2).sum(axis=2))
    return Rays(through / length[..., None], 1 / length)


def sky(direction: np.ndarray) -> np.ndarray:
    """Colour of the sky and of two ranges of far hills in a direction (..., 3)."""
    elevation = np.maximum(direction[..., 2], 0)
    colour = HORIZON + (ZENITH - HORIZON) * np.sqrt(np.minimum(elevation * 1.4, 1))[..., None]
    azimuth = np.arctan2(direction[..., 1], direction[..., 0])
    for ridge, tint in ((_ridge(azimuth, 3.0, 0.075), HILLS_FAR), (_ridge(azimuth, 7.0, 0.045), HILLS_NEAR)):
        cover = np.clip((ridge - elevation) * 700 + 0.5, 0, 1)[..., None]
        colour = colour + (tint - colour) * cover
    return colour


def _ridge(azimuth: np.ndarray, phase: float, height: float) -> np.ndarray:
    """Elevation of a range of hills (sine of the angle)."""
    waves = np.sin(2 * azimuth + phase) + 0.5 * np.sin(5 * azimuth + 2 * phase) + 0.2 * np.sin(13 * azimuth + 3 * phase)
    return height * (0.75 + 0.25 * waves)


def water_distance(view: View, light: Rays) -> np.ndarray:
    """Depth of the water along the view's axis per pixel (m), infinite above the horizon."""
    down = light.direction[..., 2]
    with np.errstate(divide="ignore"):
        distance = np.where(down < 0, -np.float32(view.eye[2]) / down, np.float32(np.inf))
    return distance * light.along_axis


def water(view: View, light: Rays, mirrored: np.ndarray, cover: np.ndarray) -> np.ndarray:
    """Colour of the water in every pixel, (height, width, 3); meaningless where no water is.

    `mirrored` (height, width, 3), premultiplied by its `cover` (height, width), are the reflected solids in the same pixels.
    """
    direction = light.direction
    reach = -np.float32(view.eye[2]) / np.minimum(direction[..., 2], -1e-4)
    east, north = float(view.eye[0]), float(view.eye[1])
    slope_x, slope_y = _ripples(east + reach * direction[..., 0], north + reach * direction[..., 1], reach)
    tilt = direction[..., 0] * slope_x + direction[..., 1] * slope_y
    reflected = direction - 2 * direction[..., 2:] * np.array([0, 0, 1], np.float32)
    reflected = reflected + np.stack([-2 * slope_x * direction[..., 2], -2 * slope_y * direction[..., 2], -2 * tilt], axis=2)
    colour = _disturbed(mirrored, cover, tilt, sky(np.clip(reflected, -1, 1)))
    grazing = (1 - np.clip(-direction[..., 2] + tilt, 0, 1)) ** 5
    share = (0.06 + 0.94 * grazing)[..., None]
    return DEEP + (colour - DEEP) * share


def _disturbed(mirrored: np.ndarray, cover: np.ndarray, tilt: np.ndarray, behind: np.ndarray) -> np.ndarray:
    """The reflected solids, each row's pixels taken from a little above or below, in front of the reflected sky."""
    height, width = cover.shape
    rows = np.clip(np.arange(height)[:, None] + np.rint(tilt * 1.2 * height).astype(np.int32), 0, height - 1)
    columns = np.arange(width)[None, :]
    return mirrored[rows, columns] + behind * (1 - cover[rows, columns])[..., None]


def _ripples(x: np.ndarray, y: np.ndarray, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Slopes of the surface at places (m); waves too short for the pixels of that distance are left out."""
    slope_x, slope_y = np.zeros_like(x), np.zeros_like(x)
    for angle, number, slope in RIPPLES:
        wave = slope * np.exp(-((distance * number / 120) ** 2)) * np.cos(number * (x * math.cos(angle) + y * math.sin(angle)))
        slope_x, slope_y = slope_x + wave * math.cos(angle), slope_y + wave * math.sin(angle)
    return slope_x, slope_y
