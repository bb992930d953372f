"""Onboard camera that writes PNG files, rendered in software without a display."""

from collections.abc import Mapping, Sequence
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np

from ..catalogue import VEHICLE_MODELS
from ..json_reader import JsonReader
from ..scene.landscape import (
    HAZE_DISTANCE,
    HORIZON_COLOUR,
    WATER_COLOUR,
    pixel_rays,
    sky_colour,
)
from ..scene.parts import platform_parts, vehicle_parts
from ..scene.solid_renderer import SolidRenderer, View
from .marker_camera import camera_attitude, mounting_parameters
from .rotations import add_scaled, quaternion_product, to_world
from .signal_component import Measurement, SampledSensor, timing_variables
from .variable_declarations import (
    check_arguments,
    pose_inputs,
    read_platforms,
    real_parameter,
    real_variable,
)

_POSE_SIZE = 7  # scalars of a position and an orientation


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
        edges = size if isinstance(size, list | tuple) and len(size) == 2 else [size]
        for edge in edges:
            reader.integer(edge, ("size",), 8, 4096)
        decks = [platform_parts(*box) for box in read_platforms(reader, platforms or {})]
        check_arguments(reader)
        poses, (tilt, mounting) = map(pose_inputs, kinds), mounting_parameters()
        super().__init__(
            instance_name,
            [
                *chain.from_iterable(poses),
                tilt,
                real_parameter("angle", "rad", 0.8, "opening from top to bottom", 0.05, 2.5),
                mounting,
                real_variable("frames", "1", "output", description="pictures written so far"),
                *timing_variables(1.0),
            ],
        )
        self._folder, self._carrier = Path(folder), list(kinds).index(carrier)
        self._size = (int(size[0]), int(size[1]))
        visible_parts = [
            vehicle_parts(kind) if name != carrier else [] for name, kind in kinds.items()
        ]
        self._renderer = SolidRenderer(*visible_parts, [*chain.from_iterable(decks)])

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
        solids = self._renderer.render(view, *self._size, shadow=True)
        background = _render_background(view, *self._size)
        return np.where(np.isfinite(solids.depth)[..., None], solids.colour, background)

    def _view(self) -> View:
        pose = self.inputs[_POSE_SIZE * self._carrier : _POSE_SIZE * (self._carrier + 1)]
        camera = quaternion_product(pose[3:], camera_attitude(self.parameters["tilt"]))
        eye = add_scaled(pose, 1.0, to_world(pose[3:], self.parameters["mounting"]))
        target = add_scaled(eye, 1.0, to_world(camera, (0.0, 0.0, 1.0)))
        up = to_world(camera, (0.0, -1.0, 0.0))
        return View(np.array(eye), np.array(target), self.parameters["angle"], up)

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
