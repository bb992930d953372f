"""Pictures of a mission at one moment, or of several moments in one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from cosim.core.errors import InputError, did_you_mean

from .cameras import CAMERAS, View
from .mission import Mission
from .parts import static_parts
from .shores import add_land
from .sky_and_water import (
    FAR_HILLS_COLOUR,
    HAZE_DISTANCE,
    Rays,
    horizon_row,
    pixel_rays,
    sky_colour,
    water_distance,
    water_pixels,
)
from .solid_renderer import Picture, SolidRenderer
from .vehicle_parts import vehicle_parts


class Layer:
    """A picture that ghosts are painted on: colour times cover (height, width, 3), cover in 0 ... 1 and depth (m)."""

    def __init__(self, colour: np.ndarray, cover: np.ndarray, depth: np.ndarray):
        self.colour, self.alpha, self.depth = colour, cover, depth

    @classmethod
    def from_solids(cls, solids: Picture) -> Layer:
        """Solids in haze in front of nothing."""
        seen = np.isfinite(solids.depth)
        pixels = np.flatnonzero(seen)
        haze = np.exp(-solids.depth.ravel()[pixels] / HAZE_DISTANCE)
        own = solids.colour.reshape(-1, 3)[pixels].T * np.float32(1 / 255)
        colour = np.zeros((*seen.shape, 3), np.float32)
        colour.reshape(-1, 3)[pixels] = (FAR_HILLS_COLOUR + (own - FAR_HILLS_COLOUR) * haze).T
        return cls(colour, seen.astype(np.float32), solids.depth)

    def copy(self) -> Layer:
        """The same to paint on; ghosts leave the depth alone."""
        return Layer(self.colour.copy(), self.alpha.copy(), self.depth)

    def blend(self, ghost: Picture, share: float) -> np.ndarray:
        """Paint a ghost over what is behind it and not nearer than it; `share` 1 hides that, 0 is invisible.

        Returns the pixels (flat indices) where it is seen.
        """
        pixels = np.flatnonzero(ghost.depth < self.depth)
        colour, cover = self.colour.reshape(-1, 3), self.alpha.reshape(-1)
        colour[pixels] += share * (ghost.colour.reshape(-1, 3)[pixels].astype(np.float32) / 255 - colour[pixels])
        cover[pixels] += share * (1 - cover[pixels])
        return pixels


class Background:
    """All that keeps still, as a view shows it; `size`: width and height, even.

    Water has half the resolution: ripples blur what it reflects anyway.
    """

    def __init__(self, still: SolidRenderer, view: View, size: tuple[int, int]):
        self.view, self.size = view, size
        half, mirrored = (size[0] // 2, size[1] // 2), view.mirrored()
        light = pixel_rays(view, *size)
        solids, depth = _static_solids(still, view, light), water_distance(view, light)
        self.water_mask, self.horizon = depth < solids.depth, horizon_row(light)
        self.mirrored = Layer.from_solids(_static_solids(still, mirrored, pixel_rays(mirrored, *half)))
        self.surface = water_pixels(view, pixel_rays(view, *half), self.horizon // 2)
        solids.depth[self.water_mask] = np.inf
        self.picture = self._composite(Layer.from_solids(solids), light, np.minimum(solids.depth, depth))

    def _composite(self, solids: Layer, light: Rays, depth: np.ndarray) -> Layer:
        """Solids in front of water and sky."""
        width, height = self.size
        colour = np.empty((height, width, 3), np.float32)
        water = self.surface.colour(self.mirrored.colour, self.mirrored.alpha).reshape(3, -1, 1, width // 2, 1)
        colour.reshape(height // 2, 2, width // 2, 2, 3)[self.horizon // 2 :] = water.transpose(1, 2, 3, 4, 0)
        colour[: self.horizon] = sky_colour(light.direction[:, : self.horizon].reshape(3, -1)).T.reshape(-1, width, 3)
        hidden = np.flatnonzero(solids.alpha)
        colour.reshape(-1, 3)[hidden] = solids.colour.reshape(-1, 3)[hidden]
        return Layer(colour, np.ones_like(depth), depth)

    def fits(self, view: View, size: tuple[int, int]) -> bool:
        """Whether it is what that view shows."""
        same = np.array_equal(view.eye, self.view.eye) and np.array_equal(view.target, self.view.target)
        return same and view.field_of_view == self.view.field_of_view and size == self.size

    def with_reflections(self, below: Layer, changed: np.ndarray) -> Layer:
        """The picture with what the water reflects from `below`, which has `changed` (height, width)."""
        layer, width = self.picture.copy(), self.size[0]
        touched = np.flatnonzero(changed.ravel()[self.surface.sources])
        colour = self.surface.select(touched).colour(below.colour, below.alpha).T
        rows, columns = np.divmod(touched, width // 2)
        for i, j in np.ndindex(2, 2):
            pixels = (2 * (rows + self.horizon // 2) + i) * width + 2 * columns + j
            wet = self.water_mask.ravel()[pixels]
            layer.colour.reshape(-1, 3)[pixels[wet]] = colour[wet]
        return layer


class Scene:
    """A lake with the vehicles of a mission; to be used in a `with` block."""

    def __init__(self, mission: Mission):
        self.mission = mission
        self.static = SolidRenderer(static_parts(mission.platforms))
        self.vehicles = SolidRenderer(*(vehicle_parts(model) for model in mission.vehicles.values()))
        self._last_background: Background | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.static.__exit__()
        self.vehicles.__exit__()

    def render(
        self, camera: str, rows: Sequence[int], opacities: Sequence[float], width: int, height: int, supersampling: int = 2
    ) -> np.ndarray:
        """The mission at `rows` in one picture, seen by `camera` at the last of them; uint8 (height, width, 3).

        `shares` says how opaque the vehicles of each row are. Every pixel is the mean of `fineness` by `fineness`; `width` and
        `height` are even.
        """
        view, size = find_camera(camera)(self.mission, rows[-1]), (supersampling * width, supersampling * height)
        backdrop = self._background(view, size)
        below = backdrop.mirrored.copy()
        reflected = self._paint(below, view.mirrored(), rows, opacities)
        picture = backdrop.with_reflections(below, reflected)
        self._paint(picture, view, rows, opacities)
        return _downsample(picture.colour, supersampling)

    def _background(self, view: View, size: tuple[int, int]) -> Background:
        """What keeps still; the last one is kept for cameras that keep still as well."""
        if self._last_background is None or not self._last_background.fits(view, size):
            self._last_background = Background(self.static, view, size)
        return self._last_background

    def _paint(self, layer: Layer, view: View, rows: Sequence[int], shares: Sequence[float]) -> np.ndarray:
        """Paint the vehicles of each row, with the shadows that they cast on each other; returns where they are seen."""
        height, width = layer.depth.shape
        seen = np.zeros((height, width), bool)
        for row, share in zip(rows, shares, strict=True):
            self._pose(row)
            seen.reshape(-1)[layer.blend(self.vehicles.render(view, width, height, shadow=True), share)] = True
        return seen

    def _pose(self, row: int) -> None:
        for thing, vehicle in enumerate(self.mission.vehicles):
            self.vehicles.set_pose(thing, self.mission.position(vehicle, row), self.mission.orientation(vehicle, row))


def find_camera(name: str) -> Callable[[Mission, int], View]:
    """The camera of a name; raises InputError with the nearest one."""
    if name not in CAMERAS:
        raise InputError(f'no camera "{name}"{did_you_mean(name, CAMERAS)}')
    return CAMERAS[name]


def _static_solids(still: SolidRenderer, view: View, light: Rays) -> Picture:
    """What keeps still and is no water or sky."""
    height, width = light.along_axis.shape
    picture = still.render(view, width, height)
    add_land(picture, view, light)
    return picture


def _downsample(colour: np.ndarray, fineness: int) -> np.ndarray:
    """Each `fineness` by `fineness` pixels to one, as bytes."""
    height, width, _ = colour.shape
    mean = colour.reshape(height // fineness, fineness, width // fineness, fineness, 3).mean(axis=(1, 3))
    return np.rint(np.clip(mean, 0, 1) * 255).astype(np.uint8)
