"""A camera on a vehicle that writes what it sees as PNG files; drawn off screen, without graphics card or display."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..catalogue import VEHICLES
from ..json_reader import Reader
from ..physics.client import pybullet
from ..scene.cameras import UP, View
from ..scene.light import DEEP, HAZE, HORIZON, rays, sky
from ..scene.looks import looks
from ..scene.models import Part, platform
from ..scene.stage import Stage
from .frames import product, to_world
from .optics import camera_attitude
from .sampled import Measurement, SampledSensor, timing
from .signals import accept, parameter, pose_inputs, real

_POSE = 7  # numbers of a position and an orientation


@dataclass(frozen=True)
class TiltedView(View):
    """A view whose upward direction (world) is any."""

    up: np.ndarray = field(default_factory=lambda: UP)

    def matrix(self) -> list[float]:
        return list(pybullet.computeViewMatrix(self.eye.tolist(), self.target.tolist(), self.up.tolist()))

    def axes(self) -> np.ndarray:
        ahead = (self.target - self.eye) / np.linalg.norm(self.target - self.eye)
        right = np.cross(ahead, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, ahead), ahead])


class Camera(SampledSensor):
    """Writes `folder`/NAME_0000.png, NAME_0001.png, ... at its rate; `frames` is how many there are, `time` (s) that of the last.

    `vehicles`: name -> vehicle of the catalogue ("uav": "ar_drone"), for each of which there are inputs `NAME.position` and
    `NAME.orientation`; `carrier` is the one that carries the camera, which it does not see; `platforms` as in the world.
    `size`: width and height (pixels). Vehicles and platforms are solids (`plant_src/scene`), water and sky plain colours. The
    camera sits at `mounting` (m, body axes), tilted forward from straight down by `tilt` (rad), and opens by `angle` (rad) from
    top to bottom. What is nearer than 0.4 m is not drawn. A picture of 320 by 240 pixels takes some ten milliseconds, so the
    rate is low. A folder that is not absolute lies in the current one. Raises InputError with all problems.
    """

    def __init__(
        self,
        instance_name: str,
        vehicles: Mapping[str, str],
        carrier: str,
        folder: str,
        platforms: Mapping[str, Any] | None = None,
        size: Sequence[int] = (320, 240),
    ):
        reader = Reader()
        kinds = {
            name: reader.choice(kind, ("vehicles", name), list(VEHICLES))
            for name, kind in reader.named(vehicles, ("vehicles",)).items()
        }
        reader.choice(carrier, ("carrier",), list(kinds) or ["uav"])
        for i in (0, 1):
            reader.integer(size[i] if isinstance(size, list | tuple) and len(size) == 2 else size, ("size",), 8, 4096)
        decks = [_platform(reader, name, spec) for name, spec in reader.named(platforms or {}, ("platforms",)).items()]
        accept(reader)
        super().__init__(
            instance_name,
            [
                *(variable for name in kinds for variable in pose_inputs(name)),
                parameter("tilt", "rad", 0.0, "of the camera, from straight down to ahead", -math.pi, math.pi),
                parameter("angle", "rad", 0.8, "opening from top to bottom", 0.05, 2.5),
                real("mounting", "m", "parameter", (0.0, 0.0, 0.0), "place of the camera, body axes", shape=(3,)),
                real("frames", "1", "output", description="pictures written so far"),
                *timing(1.0),
            ],
        )
        self._folder, self._size, self._carrier = Path(folder), (int(size[0]), int(size[1])), list(kinds).index(carrier)
        seen = [looks(kind) if name != carrier else [] for name, kind in kinds.items()]
        self._stage = Stage(*seen, [part for deck in decks for part in deck])

    def measure(self, number: int, elapsed: float) -> Measurement:
        from matplotlib.image import imsave

        self._folder.mkdir(parents=True, exist_ok=True)
        imsave(self._folder / f"{self.name}_{number:04d}.png", self.picture())
        return (number + 1.0,), ()

    def picture(self) -> np.ndarray:
        """What the camera sees now: uint8 (height, width, 3)."""
        for thing in range(len(self.inputs) // _POSE):
            x, y, z, qw, qx, qy, qz = self.inputs[_POSE * thing : _POSE * (thing + 1)]
            self._stage.place(thing, (x, y, z), (qx, qy, qz, qw))
        view = self._view()
        solids, background = self._stage.picture(view, *self._size, shadow=True), _background(view, *self._size)
        return np.where(np.isfinite(solids.depth)[..., None], solids.colour, background)

    def _view(self) -> View:
        pose = self.inputs[_POSE * self._carrier : _POSE * (self._carrier + 1)]
        camera = product(pose[3:], camera_attitude(self.parameters["tilt"]))
        eye = np.array(pose[:3]) + to_world(pose[3:], self.parameters["mounting"])
        ahead, up = (np.array(to_world(camera, axis)) for axis in ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
        return TiltedView(eye, eye + ahead, self.parameters["angle"], up)

    def free(self) -> None:
        if self._stage.client >= 0:
            self._stage.__exit__()
            self._stage.client = -1


def _background(view: View, width: int, height: int) -> np.ndarray:
    """Water and sky, uint8 (height, width, 3): water that turns pale with distance, and the colours of the sky above it."""
    direction = rays(view, width, height).direction.reshape(3, -1)
    below = direction[2] < 0
    reach = np.where(below, float(view.eye[2]) / np.maximum(-direction[2], 1e-6), np.inf)
    clear = np.exp(-reach / HAZE)
    colour = np.where(below, HORIZON + (DEEP - HORIZON) * clear, sky(direction))
    return np.rint(255 * np.clip(colour, 0, 1)).astype(np.uint8).T.reshape(height, width, 3)


def _platform(reader: Reader, name: str, spec: Any) -> list[Part]:
    path = ("platforms", name)
    spec = reader.keys(spec, path, ("size", "position"), ())
    size, position = (reader.vector(spec.get(key, [1.0] * 3), (*path, key), "xyz") for key in ("size", "position"))
    return list(platform(size, position))
