"""Pictures of a mission at one moment, or of several moments in one picture."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Self

import numpy as np

from cosim.errors import InputError, did_you_mean

from .cameras import CAMERAS, View
from .light import HAZE, HILLS_FAR, Rays, rays, sky, water, water_distance
from .mission import Mission
from .models import VEHICLES, lake
from .stage import Picture, Stage


class Layer:
    """Solids in haze in front of nothing: colour times cover (height, width, 3), cover in 0 ... 1 and depth (m)."""

    def __init__(self, solids: Picture):
        seen = np.isfinite(solids.depth)
        far = (1 - np.exp(-solids.depth[seen] / HAZE))[:, None]
        own = solids.colour[seen].astype(np.float32) / 255
        self.colour = np.zeros((*seen.shape, 3), np.float32)
        self.colour[seen] = own + (HILLS_FAR - own) * far
        self.cover = seen.astype(np.float32)
        self.depth = solids.depth

    def blend(self, ghost: Picture, share: float) -> None:
        """Paint a ghost over what is behind it and not nearer than it; `share` 1 hides that, 0 is invisible."""
        seen = ghost.depth < self.depth
        self.colour[seen] += share * (ghost.colour[seen].astype(np.float32) / 255 - self.colour[seen])
        self.cover[seen] += share * (1 - self.cover[seen])


class Scene:
    """A lake with the vehicles of a mission; to be used in a `with` block."""

    def __init__(self, mission: Mission):
        self.mission = mission
        self.still = Stage(lake(mission.platforms))
        self.moving = Stage(*(VEHICLES[model]() for model in mission.vehicles.values()))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.still.__exit__()
        self.moving.__exit__()

    def render(
        self, camera: str, rows: Sequence[int], shares: Sequence[float], width: int, height: int, fineness: int = 2
    ) -> np.ndarray:
        """The mission at `rows` in one picture, seen by `camera` at the last of them; uint8 (height, width, 3).

        `shares` says how opaque the vehicles of each row are. Every pixel is the mean of `fineness` by `fineness`; `width` and
        `height` are even.
        """
        view = find_camera(camera)(self.mission, rows[-1])
        size = (fineness * width, fineness * height)
        light = rays(view, *size)
        depth = water_distance(view, light)
        upright = self._layer(view, rows, shares, size, depth)
        below = self._layer(view.mirrored(), rows, shares, (size[0] // 2, size[1] // 2))
        return _reduced(_painted(view, light, depth, upright, below), fineness)

    def _layer(
        self, view: View, rows: Sequence[int], shares: Sequence[float], size: tuple[int, int], limit: np.ndarray | None = None
    ) -> Layer:
        """All solids nearer than `limit` (m), with the shadows that vehicles cast on each other."""
        layer = Layer(_cut(self.still.picture(view, *size), limit))
        for row, share in zip(rows, shares, strict=True):
            self._pose(row)
            layer.blend(_cut(self.moving.picture(view, *size, shadow=True), limit), share)
        return layer

    def _pose(self, row: int) -> None:
        for thing, vehicle in enumerate(self.mission.vehicles):
            self.moving.place(thing, self.mission.place(vehicle, row), self.mission.orientation(vehicle, row))


def find_camera(name: str) -> Callable[[Mission, int], View]:
    """The camera of a name; raises InputError with the nearest one."""
    if name not in CAMERAS:
        raise InputError(f'no camera "{name}"{did_you_mean(name, CAMERAS)}')
    return CAMERAS[name]


def _cut(picture: Picture, limit: np.ndarray | None) -> Picture:
    if limit is not None:
        picture.depth[picture.depth >= limit] = np.inf
    return picture


def _painted(view: View, light: Rays, depth: np.ndarray, upright: Layer, below: Layer) -> np.ndarray:
    """Solids in front of water and sky; reflections, blurred anyway, come in half the resolution."""
    above = np.isinf(depth)
    background = water(view, light, _doubled(below.colour[::-1]), _doubled(below.cover[::-1]))
    background[above] = sky(light.direction[above])
    return upright.colour + background * (1 - upright.cover)[..., None]


def _doubled(pixels: np.ndarray) -> np.ndarray:
    """Each pixel as two by two."""
    return pixels.repeat(2, axis=0).repeat(2, axis=1)


def _reduced(colour: np.ndarray, fineness: int) -> np.ndarray:
    """Each `fineness` by `fineness` pixels to one, as bytes."""
    height, width, _ = colour.shape
    mean = colour.reshape(height // fineness, fineness, width // fineness, fineness, 3).mean(axis=(1, 3))
    return np.rint(np.clip(mean, 0, 1) * 255).astype(np.uint8)
