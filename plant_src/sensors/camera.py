"""Onboard camera that writes PNG files, rendered in software without a display."""

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
from ..scene.sky_and_water import (
    HAZE_DISTANCE,
    HORIZON_COLOUR,
    WATER_COLOUR,
    pixel_rays,
    sky_colour,
)
from ..scene.solid_renderer import SolidRenderer
from ..scene.vehicle_parts import vehicle_parts
from .pinhole_camera import camera_attitude
from .rotations import quaternion_product, to_world
from .sampled_sensor import Measurement, SampledSensor, timing_variables
from .variable_declarations import pose_inputs, raise_problems, real_parameter, real_variable

_POSE_SIZE = 7  # scalars of a position and an orientation


@dataclass(frozen=True)
class OrientedView(View):
    """View with an arbitrary upward direction `up` (world axes)."""

    up: np.ndarray = field(default_factory=lambda: UP)

    def matrix(self) -> list[float]:
        """Return the view matrix, see `View.matrix`."""
        return list(
            pybullet.computeViewMatrix(self.eye.tolist(), self.target.tolist(), self.up.tolist())
        )

    def axes(self) -> np.ndarray:
        """Return the axes of the camera, see `View.axes`."""
        ahead = (self.target - self.eye) / np.linalg.norm(self.target - self.eye)
        right = np.cross(ahead, self.up)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(right, ahead), ahead])


class Camera(SampledSensor):
    """Ideal pinhole camera on a vehicle.

    Writes `folder`/NAME_0000.png, NAME_0001.png, ... at its rate.

    Vehicles and platforms are drawn as solids (`plant_src/scene`), water and sky as plain colours.
    Objects nearer than 0.4 m are not drawn. A picture of 320 by 240 pixels takes about 16 ms, so
    the default rate is 1 Hz.

    Inputs: `NAME.position` (m, world) and `NAME.orientation` (unit quaternion, body to world) of
    each vehicle. Outputs: `frames` (pictures written so far), `time` of the last one (s).
    Parameters: `mounting` (m, body axes), `tilt` (rad, from straight down to ahead), `angle` (rad,
    vertical field of view).

    Args:
        instance_name: Name of the component and of the files.
        vehicles: Vehicle of the catalogue by name ({"uav": "ar_drone"}).
        carrier: Name of the vehicle that carries the camera; it is not drawn.
        folder: Folder of the pictures, relative to the current directory.
        platforms: Platforms as in the arguments of the plant.
        size: Width and height (pixels).

    Raises:
        InputError: One or more arguments are invalid; lists all problems.
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
            reader.integer(
                size[i] if isinstance(size, list | tuple) and len(size) == 2 else size,
                ("size",),
                8,
                4096,
            )
        decks = [
            _platform_parts(reader, name, spec)
            for name, spec in reader.read_named_objects(platforms or {}, ("platforms",)).items()
        ]
        raise_problems(reader)
        super().__init__(
            instance_name,
            [
                *(variable for name in kinds for variable in pose_inputs(name)),
                real_parameter(
                    "tilt",
                    "rad",
                    0.0,
                    "of the camera, from straight down to ahead",
                    -math.pi,
                    math.pi,
                ),
                real_parameter("angle", "rad", 0.8, "opening from top to bottom", 0.05, 2.5),
                real_variable(
                    "mounting",
                    "m",
                    "parameter",
                    (0.0, 0.0, 0.0),
                    "place of the camera, body axes",
                    shape=(3,),
                ),
                real_variable("frames", "1", "output", description="pictures written so far"),
                *timing_variables(1.0),
            ],
        )
        self._folder, self._size, self._carrier = (
            Path(folder),
            (int(size[0]), int(size[1])),
            list(kinds).index(carrier),
        )
        visible_parts = [
            vehicle_parts(kind) if name != carrier else [] for name, kind in kinds.items()
        ]
        self._renderer = SolidRenderer(*visible_parts, [part for deck in decks for part in deck])

    def measure(self, number: int, elapsed: float) -> Measurement:
        """Write picture `number` and return the count of pictures."""
        from matplotlib.image import imsave

        self._folder.mkdir(parents=True, exist_ok=True)
        imsave(self._folder / f"{self.name}_{number:04d}.png", self.render())
        return (number + 1.0,), ()

    def render(self) -> np.ndarray:
        """Return the picture at the present inputs, uint8 (height, width, 3)."""
        for index in range(len(self.inputs) // _POSE_SIZE):
            x, y, z, qw, qx, qy, qz = self.inputs[_POSE_SIZE * index : _POSE_SIZE * (index + 1)]
            self._renderer.set_pose(index, (x, y, z), (qx, qy, qz, qw))
        view = self._view()
        solids, background = (
            self._renderer.render(view, *self._size, shadow=True),
            _render_background(view, *self._size),
        )
        return np.where(np.isfinite(solids.depth)[..., None], solids.colour, background)

    def _view(self) -> View:
        pose = self.inputs[_POSE_SIZE * self._carrier : _POSE_SIZE * (self._carrier + 1)]
        camera = quaternion_product(pose[3:], camera_attitude(self.parameters["tilt"]))
        eye = np.array(pose[:3]) + to_world(pose[3:], self.parameters["mounting"])
        ahead, up = (
            np.array(to_world(camera, axis)) for axis in ((0.0, 0.0, 1.0), (0.0, -1.0, 0.0))
        )
        return OrientedView(eye, eye + ahead, self.parameters["angle"], up)

    def free(self) -> None:
        """Disconnect the Bullet client."""
        self._renderer.close()


def _render_background(view: View, width: int, height: int) -> np.ndarray:
    """Return water in haze and sky, uint8 (height, width, 3)."""
    direction = pixel_rays(view, width, height).direction.reshape(3, -1)
    below = direction[2] < 0
    reach = np.where(below, float(view.eye[2]) / np.maximum(-direction[2], 1e-6), np.inf)
    clear = np.exp(-reach / HAZE_DISTANCE)
    colour = np.where(
        below, HORIZON_COLOUR + (WATER_COLOUR - HORIZON_COLOUR) * clear, sky_colour(direction)
    )
    picture: np.ndarray = (
        np.rint(255 * np.clip(colour, 0, 1)).astype(np.uint8).T.reshape(height, width, 3)
    )
    return picture


def _platform_parts(reader: JsonReader, name: str, spec: Any) -> list[Part]:
    path = ("platforms", name)
    spec = reader.read_object(spec, path, ("size", "position"), ())
    size, position = (
        reader.vector(spec.get(key, [1.0] * 3), (*path, key), "xyz") for key in ("size", "position")
    )
    return list(platform_parts(size, position))
