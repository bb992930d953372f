"""A camera on a vehicle that writes what it sees as PNG files; drawn off screen, without graphics card or display."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ..catalogue import VEHICLE_MODELS
from ..json_reader import JsonReader
from ..physics.client import pybullet
from ..scene.cameras import UP, View
from ..scene.parts import Part, platform_parts
from ..scene.sky_and_water import HAZE_DISTANCE, HORIZON_COLOUR, WATER_COLOUR, pixel_rays, sky_colour
from ..scene.solid_renderer import SolidRenderer
from ..scene.vehicle_parts import vehicle_parts
from .pinhole_camera import camera_attitude
from .rotations import quaternion_product, to_world
from .sampled_sensor import Measurement, SampledSensor, timing_variables
from .signal_component import pose_inputs, raise_problems, real_parameter, real_variable

_POSE_SIZE = 7  # numbers of a position and an orientation


@dataclass(frozen=True)
class OrientedView(View):
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
        reader = JsonReader()
        kinds = {
            name: reader.choice(kind, ("vehicles", name), list(VEHICLE_MODELS))
            for name, kind in reader.read_named_objects(vehicles, ("vehicles",)).items()
        }
        reader.choice(carrier, ("carrier",), list(kinds) or ["uav"])
        for i in (0, 1):
            reader.integer(size[i] if isinstance(size, list | tuple) and len(size) == 2 else size, ("size",), 8, 4096)
        decks = [
            _platform_parts(reader, name, spec)
            for name, spec in reader.read_named_objects(platforms or {}, ("platforms",)).items()
        ]
        raise_problems(reader)
        super().__init__(
            instance_name,
            [
                *(variable for name in kinds for variable in pose_inputs(name)),
                real_parameter("tilt", "rad", 0.0, "of the camera, from straight down to ahead", -math.pi, math.pi),
                real_parameter("angle", "rad", 0.8, "opening from top to bottom", 0.05, 2.5),
                real_variable("mounting", "m", "parameter", (0.0, 0.0, 0.0), "place of the camera, body axes", shape=(3,)),
                real_variable("frames", "1", "output", description="pictures written so far"),
                *timing_variables(1.0),
            ],
        )
        self._folder, self._size, self._carrier = Path(folder), (int(size[0]), int(size[1])), list(kinds).index(carrier)
        seen = [vehicle_parts(kind) if name != carrier else [] for name, kind in kinds.items()]
        self._stage = SolidRenderer(*seen, [part for deck in decks for part in deck])

    def measure(self, number: int, elapsed: float) -> Measurement:
        from matplotlib.image import imsave

        self._folder.mkdir(parents=True, exist_ok=True)
        imsave(self._folder / f"{self.name}_{number:04d}.png", self.render())
        return (number + 1.0,), ()

    def render(self) -> np.ndarray:
        """What the camera sees now: uint8 (height, width, 3)."""
        for thing in range(len(self.inputs) // _POSE_SIZE):
            x, y, z, qw, qx, qy, qz = self.inputs[_POSE_SIZE * thing : _POSE_SIZE * (thing + 1)]
            self._stage.set_pose(thing, (x, y, z), (qx, qy, qz, qw))
        view = self._view()
        solids, background = self._stage.render(view, *self._size, shadow=True), _render_background(view, *self._size)
        return np.where(np.isfinite(solids.depth)[..., None], solids.colour, background)

    def _view(self) -> View:
        pose = self.inputs[_POSE_SIZE * self._carrier : _POSE_SIZE * (self._carrier + 1)]
        camera = quaternion_product(pose[3:], camera_attitude(self.parameters["tilt"]))
        eye = np.array(pose[:3]) + to_world(pose[3:], self.parameters["mounting"])
        ahead, up = (np.array(to_world(camera, axis)) for axis in ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))
        return OrientedView(eye, eye + ahead, self.parameters["angle"], up)

    def free(self) -> None:
        if self._stage.client >= 0:
            self._stage.__exit__()
            self._stage.client = -1


def _render_background(view: View, width: int, height: int) -> np.ndarray:
    """Water and sky, uint8 (height, width, 3): water that turns pale with distance, and the colours of the sky above it."""
    direction = pixel_rays(view, width, height).direction.reshape(3, -1)
    below = direction[2] < 0
    reach = np.where(below, float(view.eye[2]) / np.maximum(-direction[2], 1e-6), np.inf)
    clear = np.exp(-reach / HAZE_DISTANCE)
    colour = np.where(below, HORIZON_COLOUR + (WATER_COLOUR - HORIZON_COLOUR) * clear, sky_colour(direction))
    return np.rint(255 * np.clip(colour, 0, 1)).astype(np.uint8).T.reshape(height, width, 3)


def _platform_parts(reader: JsonReader, name: str, spec: Any) -> list[Part]:
    path = ("platforms", name)
    spec = reader.read_object(spec, path, ("size", "position"), ())
    size, position = (reader.vector(spec.get(key, [1.0] * 3), (*path, key), "xyz") for key in ("size", "position"))
    return list(platform_parts(size, position))
