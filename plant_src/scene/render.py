"""Renderer for pictures and videos of a mission, at one or several times in one picture."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np

from cosim.core.errors import InputError, did_you_mean
from cosim.results import Result

from .landscape import (
    FAR_HILLS_COLOUR,
    HAZE_DISTANCE,
    Rays,
    add_land,
    horizon_row,
    pixel_rays,
    sky_colour,
    water_distance,
    water_pixels,
)
from .mission import CAMERAS, Mission, mission_of_result
from .parts import static_parts, tree_parts, vehicle_parts
from .solid_renderer import Picture, SolidRenderer, View


@dataclass(frozen=True, eq=False)
class Layer:
    """Picture with transparency, onto which vehicles are blended.

    Attributes:
        colour: Colour premultiplied by alpha, shape (height, width, 3).
        alpha: Opacity in 0 ... 1, shape (height, width).
        depth: Depth (m), shape (height, width); not changed by blending.
    """

    colour: np.ndarray
    alpha: np.ndarray
    depth: np.ndarray

    @classmethod
    def from_solids(cls, solids: Picture) -> Layer:
        """Return solids in haze before a transparent background."""
        is_solid = np.isfinite(solids.depth)
        pixels = np.flatnonzero(is_solid)
        haze = np.exp(-solids.depth.ravel()[pixels] / HAZE_DISTANCE)
        clear = solids.colour.reshape(-1, 3)[pixels].T * np.float32(1 / 255)
        colour = np.zeros((*is_solid.shape, 3), np.float32)
        colour.reshape(-1, 3)[pixels] = (FAR_HILLS_COLOUR + (clear - FAR_HILLS_COLOUR) * haze).T
        return cls(colour, is_solid.astype(np.float32), solids.depth)

    def copy(self) -> Layer:
        """Return a copy whose colour and alpha can be changed; the depth is shared."""
        return Layer(self.colour.copy(), self.alpha.copy(), self.depth)

    def blend(self, picture: Picture, opacity: float) -> np.ndarray:
        """Blend the pixels of `picture` that are nearer than the depth of the layer onto it.

        Args:
            picture: Solids of the same size.
            opacity: 0 (invisible) to 1 (opaque).

        Returns:
            Flat indices of the changed pixels.
        """
        pixels = np.flatnonzero(picture.depth < self.depth)
        colour, alpha = self.colour.reshape(-1, 3), self.alpha.reshape(-1)
        colour[pixels] += opacity * (
            picture.colour.reshape(-1, 3)[pixels].astype(np.float32) / 255 - colour[pixels]
        )
        alpha[pixels] += opacity * (1 - alpha[pixels])
        return pixels


class Background:
    """Picture of the static objects, land, water and sky in a view.

    Water is computed at half the resolution, because ripples blur its reflections.

    Args:
        static: Renderer of the static objects.
        view: The view.
        size: Width and height (pixels), both even.
    """

    def __init__(self, static: SolidRenderer, view: View, size: tuple[int, int]):
        self.view, self.size = view, size
        half, mirrored = (size[0] // 2, size[1] // 2), view.mirrored()
        light = pixel_rays(view, *size)
        solids, depth = _static_solids(static, view, light), water_distance(view, light)
        self.water_mask, self.horizon = depth < solids.depth, horizon_row(light)
        self.mirrored = Layer.from_solids(
            _static_solids(static, mirrored, pixel_rays(mirrored, *half))
        )
        self.surface = water_pixels(view, pixel_rays(view, *half), self.horizon // 2)
        solids.depth[self.water_mask] = np.inf
        self.picture = self._composite(
            Layer.from_solids(solids), light, np.minimum(solids.depth, depth)
        )

    def _composite(self, solids: Layer, light: Rays, depth: np.ndarray) -> Layer:
        """Return solids in front of water and sky."""
        width, height = self.size
        colour = np.empty((height, width, 3), np.float32)
        water = self.surface.colour(self.mirrored.colour, self.mirrored.alpha).reshape(
            3, -1, 1, width // 2, 1
        )
        colour.reshape(height // 2, 2, width // 2, 2, 3)[self.horizon // 2 :] = water.transpose(
            1, 2, 3, 4, 0
        )
        colour[: self.horizon] = sky_colour(
            light.direction[:, : self.horizon].reshape(3, -1)
        ).T.reshape(-1, width, 3)
        hidden = np.flatnonzero(solids.alpha)
        colour.reshape(-1, 3)[hidden] = solids.colour.reshape(-1, 3)[hidden]
        return Layer(colour, np.ones_like(depth), depth)

    def fits(self, view: View, size: tuple[int, int]) -> bool:
        """Return True if the background belongs to this view and size."""
        same = np.array_equal(view.eye, self.view.eye) and np.array_equal(
            view.target, self.view.target
        )
        return same and view.field_of_view == self.view.field_of_view and size == self.size

    def with_reflections(self, below: Layer, changed: np.ndarray) -> Layer:
        """Return a copy of the picture with new reflections.

        Args:
            below: Mirrored picture that the water reflects, at half the resolution.
            changed: Mask of its pixels that differ from the background, shape (height / 2, width /
                2).

        Returns:
            The picture with the reflections of the changed pixels.
        """
        layer, width = self.picture.copy(), self.size[0]
        affected = np.flatnonzero(changed.ravel()[self.surface.sources])
        colour = self.surface.select(affected).colour(below.colour, below.alpha).T
        rows, columns = np.divmod(affected, width // 2)
        for i, j in np.ndindex(2, 2):
            pixels = (2 * (rows + self.horizon // 2) + i) * width + 2 * columns + j
            wet = self.water_mask.ravel()[pixels]
            layer.colour.reshape(-1, 3)[pixels[wet]] = colour[wet]
        return layer


class Scene:
    """Lake with the vehicles of a mission.

    A context manager that disconnects its Bullet clients at the end.
    """

    def __init__(self, mission: Mission):
        self.mission = mission
        self.static = SolidRenderer(
            [*tree_parts(), *static_parts(mission.platforms, mission.obstacles)]
        )
        self.vehicles = SolidRenderer(
            *(vehicle_parts(model) for model in mission.vehicles.values())
        )
        self._last_background: Background | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.static.close()
        self.vehicles.close()

    def render(
        self,
        camera: str,
        rows: Sequence[int],
        opacities: Sequence[float],
        width: int,
        height: int,
        supersampling: int = 2,
    ) -> np.ndarray:
        """Render the mission at one or more rows in one picture.

        Args:
            camera: Name of the camera; its view is that of the last row.
            rows: Rows whose vehicles are drawn, in this order.
            opacities: Opacity of the vehicles of each row.
            width: Width of the picture (pixels), even.
            height: Height of the picture (pixels), even.
            supersampling: Samples per pixel along each axis; a pixel is their mean.

        Returns:
            Picture, uint8 (height, width, 3).

        Raises:
            InputError: `camera` is unknown.
        """
        view = find_camera(camera)(self.mission, rows[-1])
        size = (supersampling * width, supersampling * height)
        # the last background is reused for cameras that do not move
        if self._last_background is None or not self._last_background.fits(view, size):
            self._last_background = Background(self.static, view, size)
        background = self._last_background
        below = background.mirrored.copy()
        reflected = self._blend_vehicles(below, view.mirrored(), rows, opacities)
        picture = background.with_reflections(below, reflected)
        self._blend_vehicles(picture, view, rows, opacities)
        blocks = picture.colour.reshape(height, supersampling, width, supersampling, 3)
        mean: np.ndarray = np.rint(np.clip(blocks.mean(axis=(1, 3)), 0, 1) * 255)
        return mean.astype(np.uint8)

    def _blend_vehicles(
        self, layer: Layer, view: View, rows: Sequence[int], opacities: Sequence[float]
    ) -> np.ndarray:
        """Blend the vehicles of each row, with their shadows on each other.

        Return the mask of changed pixels.
        """
        height, width = layer.depth.shape
        changed = np.zeros((height, width), bool)
        for row, opacity in zip(rows, opacities, strict=True):
            for index, vehicle in enumerate(self.mission.vehicles):
                position = self.mission.position(vehicle, row)
                orientation = self.mission.orientation(vehicle, row)
                self.vehicles.set_pose(index, position, orientation)
            picture = self.vehicles.render(view, width, height, shadow=True)
            changed.reshape(-1)[layer.blend(picture, opacity)] = True
        return changed


def frames(
    result: Result, camera: str, moments: np.ndarray, size: tuple[int, int]
) -> Iterator[np.ndarray]:
    """Yield the frames of a video.

    Args:
        result: Recorded mission.
        camera: Name of the camera (`mission.py`).
        moments: Times of the frames (s).
        size: Width and height (pixels), both even.

    Yields:
        Frames, uint8 (height, width, 3).

    Raises:
        InputError: `camera` is unknown or the result has no plant with vehicles.
    """
    with Scene(mission_of_result(result)) as scene:
        for row in np.searchsorted(result.time, moments - 1e-9).tolist():
            yield scene.render(camera, [row], [1.0], *size, supersampling=1)


def find_camera(name: str) -> Callable[[Mission, int], View]:
    """Return the camera `name`. Raises InputError if it is unknown."""
    if name not in CAMERAS:
        raise InputError(f'no camera "{name}"{did_you_mean(name, CAMERAS)}')
    return CAMERAS[name]


def _static_solids(static: SolidRenderer, view: View, light: Rays) -> Picture:
    """Return static objects and land."""
    height, width = light.along_axis.shape
    picture = static.render(view, width, height)
    add_land(picture, view, light)
    return picture
